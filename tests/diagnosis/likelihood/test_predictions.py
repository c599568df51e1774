"""What predictions of half a second see of a log."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnosis.recorded import Bench, forecasts
from diagnosis.recorded_arm import arm, recorded

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood import predictions
from wipx.diagnosis.likelihood.predictions import condensed


def test_a_fast_log_is_condensed_without_losing_time_or_level(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    t = np.arange(0.0, 2.0, 0.001)
    columns = {"t": t, "x": 3.0 * t + rng.normal(0.0, 1e-3, len(t)), "u": np.cos(t)}
    short = condensed(Recording("fast", columns), ("u",))
    assert 0.003 < np.median(np.diff(short.t)) < 0.006
    assert np.std(short["x"] - 3.0 * short.t) < 0.7e-3
    acting = [
        np.cos(t[(t >= a - 1e-9) & (t < b - 1e-9)]).mean() for a, b in zip(short.t[:-1], short.t[1:], strict=True)
    ]
    np.testing.assert_allclose(short["u"][:-1], acting, atol=1e-9)


SPRING = {"actuator_elbow/elasticity": {"drive_inertia": 0.02, "stiffness": 20.0, "damping": 0.02}}
BRISTLE = {"elbow/presliding": {"F_c": 0.06, "stiffness": 30.0}}


@pytest.mark.parametrize("hidden", [SPRING, BRISTLE], ids=["a drive on a spring", "a bent bristle"])
def test_what_a_joint_carries_along_a_recording_is_there_where_a_prediction_starts(
    hidden: dict[str, dict[str, float]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fresh_seed: int
):
    """A drive that swings for seconds on its spring, or a bristle that was bent at the last turn."""
    model = arm(tmp_path)
    true = model.with_effects(hidden)
    case = Bench(model, tuple(recorded(true, fresh_seed + i, (0.2, 0.05)) for i in range(2)), {})
    seen = forecasts(case).predictions

    def error_of_elbow() -> float:
        found = seen.errors(ModelBatch(true), seen.filters(true, [np.full(2, 100.0)]))[0]
        return float(np.sqrt(np.mean(found[seen.counted, -1] ** 2)))

    own, at_once = error_of_elbow(), predictions.starts_at_once

    def at_rest(*seen: Any) -> tuple[np.ndarray, None]:
        return at_once(*seen)[0], None

    monkeypatch.setattr(predictions, "starts_at_once", at_rest)
    assert own < 0.5 * error_of_elbow()
