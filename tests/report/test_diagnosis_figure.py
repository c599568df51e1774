"""The picture of a diagnosis is written whole for every verdict."""

from dataclasses import replace

import pytest
from report import synthetic, synthetic_diagnosis

from wipx.core.diagnosis import Diagnosis
from wipx.report.diagnosis_figure import draw_diagnosis

WHOLE = synthetic_diagnosis.mismatch()


@pytest.mark.parametrize(
    "diagnosis",
    [
        WHOLE,
        synthetic_diagnosis.consistent(),
        synthetic_diagnosis.unexplained(),
        replace(WHOLE, effects=WHOLE.effects[1:]),
        replace(WHOLE, traces=(), candidates=(), title="$<b>_^"),
        replace(WHOLE, traces=(synthetic.trace("$x_$.csv", held_out=True, units={"theta": "rad", "u": "N m"}),)),
    ],
    ids=["mismatch", "consistent", "unexplained", "map", "nothing to draw", "one signal"],
)
def test_diagnosis_is_drawn(diagnosis: Diagnosis, tmp_path):
    path = tmp_path / "diagnosis.png"
    draw_diagnosis(diagnosis, path)
    assert path.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    assert path.stat().st_size > 10_000
