"""Pictures are written whole for every kind of result."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from report import synthetic

from wipx.core.results import IdentificationResult, SearchHistory
from wipx.report.figure import draw_fit, draw_search

PNG = b"\x89PNG\r\n\x1a\n"


def holed() -> IdentificationResult:
    whole = synthetic.trace("holes.csv", held_out=True)
    recorded, nominal = whole.recorded["x"].copy(), whole.nominal["x"].copy()
    recorded[100:400], nominal[:50], nominal[700:] = np.nan, np.nan, 1e9
    return synthetic.with_trace(
        replace(whole, recorded={**whole.recorded, "x": recorded}, nominal={**whole.nominal, "x": nominal})
    )


def unpredicted() -> IdentificationResult:
    whole = synthetic.trace("none.csv", held_out=False)
    nothing = {column: np.full(len(whole.t), np.nan) for column in whole.recorded}
    return synthetic.with_trace(replace(whole, nominal=nothing, completed=nothing))


@pytest.mark.parametrize(
    "result",
    [
        synthetic.result(),
        synthetic.result({"theta": "rad", "u": "N m"}),
        synthetic.result(synthetic.DOUBLE_PENDULUM_UNITS),
        synthetic.without_held_out(),
        replace(synthetic.result(), traces=(), title="$<b>_^"),
        synthetic.with_trace(synthetic.trace("short.csv", held_out=True, rows=30)),
        holed(),
        unpredicted(),
    ],
    ids=["wip", "one signal", "double pendulum", "no held-out", "no traces", "short", "holes", "no predictions"],
)
def test_fit_is_drawn(result: IdentificationResult, tmp_path: Path):
    path = tmp_path / "fit.png"
    draw_fit(result, path)
    assert path.read_bytes().startswith(PNG)
    assert path.stat().st_size > 10_000


@pytest.mark.parametrize("losses", [[np.inf, 40.0, 1.0], [3.0], [np.inf], [], [2.0, -1.0]])
def test_search_is_drawn(losses: list[float], tmp_path: Path):
    steps = np.arange(float(len(losses)))
    history = SearchHistory("CMA-ES", steps, steps, np.array(losses), "converged")
    path = tmp_path / "search.png"
    draw_search(replace(synthetic.result(), history=history), path)
    assert path.read_bytes().startswith(PNG)
