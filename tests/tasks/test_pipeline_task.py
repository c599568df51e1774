"""The whole chain on the emulated testbed, and the log that it leaves."""

from pathlib import Path

import numpy as np
import yaml

from wipx.core.recording import Recording
from wipx.recordings.model_file import read_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.pipeline import FITTED, FRESH, logged_slower

SHORT = ("task.duration=1.5", "optimizer.starts=1", "optimizer.smoothing=[0.0]", "optimizer.iterations=3")


def test_a_slower_log_has_the_mean_of_the_commands_and_the_rows_between_are_gone():
    t = np.array([0.0, 1.0, 3.0, 4.0, 6.0, 7.0])  # uneven
    fast = Recording("r", {"t": t, "x": t**2, "u": np.arange(6.0), "u_measured": -np.arange(6.0)})
    slow = logged_slower(fast, 2)
    np.testing.assert_array_equal(slow.t, [0.0, 3.0])
    np.testing.assert_array_equal(slow["x"], [0.0, 9.0])
    np.testing.assert_allclose(slow["u"], [2.0 / 3.0, 8.0 / 3.0])
    np.testing.assert_allclose(slow["u_measured"], -slow["u"])
    assert slow.periods == 2
    assert logged_slower(fast, 1) is fast


def test_it_records_identifies_and_tells_what_was_hidden_apart(program, tmp_path: Path):
    answer = program("task=pipeline", "target.engine=analytic", *SHORT, "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    out = tmp_path / "out"
    recordings = RecordingSource(path=str(out / "recordings")).load()
    assert {r.name for r in recordings} == {*FITTED, *FRESH}
    for recording in recordings:
        assert recording.periods == 2
        assert 300.0 < recording.rate < 350.0
    hidden = read_model(out / "hidden.yaml")
    assert {"translation/lugre", "actuator/backlash"} <= set(hidden.effects)
    assert yaml.safe_load((out / "hidden_signals.yaml").read_text())["latency"] > 0.0
    completed = read_model(out / "model.yaml")
    # Even a short search on little data gets near the friction.
    level = hidden.value("translation/lugre.F_c")
    assert 0.5 * level < completed.value("translation/coulomb.F_c") < 1.5 * level
