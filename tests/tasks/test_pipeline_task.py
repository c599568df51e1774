"""The whole chain on the emulated testbed, and the log that it leaves."""

import json
from pathlib import Path

import numpy as np
import pytest

from wipx.core.recording import Recording
from wipx.recordings.model_file import read_model
from wipx.recordings.source import RecordingSource
from wipx.tasks.shared.driven import logged_slower

SHORT = (
    "task.fitted=3",
    "task.fresh=1",
    "task.duration=3.0",
    "task.log_every=3",
    "task.samples=100",
    "task.loads=[a2]",
    "task.per_load=1",
    "task.scenarios=[balancing]",
    "estimator.epochs=3",
    "sim@target.engine=analytic",
    "target.engine.step=5e-4",
)


def test_a_slower_log_has_the_mean_of_the_commands_and_the_rows_between_are_gone():
    t = np.array([0.0, 1.0, 3.0, 4.0, 6.0, 7.0])  # uneven
    fast = Recording("r", {"t": t, "x": t**2, "u": np.arange(6.0), "u_measured": -np.arange(6.0)})
    slow = logged_slower(fast, 2, 1 / 1.5)
    np.testing.assert_array_equal(slow.t, [0.0, 3.0])
    np.testing.assert_array_equal(slow["x"], [0.0, 9.0])
    np.testing.assert_allclose(slow["u"], [2.0 / 3.0, 8.0 / 3.0])
    np.testing.assert_allclose(slow["u_measured"], -slow["u"])
    assert slow.periods == 2
    assert logged_slower(fast, 1, 1 / 1.5) is fast


def test_where_steps_were_skipped_rows_stay_as_close_as_they_were_asked_for():
    t = np.concatenate([np.arange(0.0, 1.0, 0.01), np.arange(1.0, 2.0, 0.04), np.arange(2.0, 3.0, 0.01)])
    slow = logged_slower(Recording("r", {"t": t, "u": np.ones(len(t))}), 4, 100.0)
    np.testing.assert_allclose(np.diff(slow.t), 0.04, atol=1e-9)
    np.testing.assert_allclose(slow["u"], 1.0)


@pytest.mark.slow
def test_the_chain_goes_from_recordings_to_control_and_tells_it_on_one_page(program, tmp_path: Path):
    answer = program("task=pipeline", *SHORT, "hydra.run.dir=out")
    assert answer.status == 0, answer.error
    out = tmp_path / "out"
    recordings = RecordingSource(path=str(out / "recordings")).load()
    assert {r.name for r in recordings} == {"r1.csv", "r2.csv", "r3.csv", "fresh1.csv"}
    assert all(r.periods == 3 and 200.0 < r.rate < 230.0 for r in recordings)
    found = json.loads((out / "diagnosis" / "diagnosis.json").read_text())
    assert any(effect["name"].startswith("translation/") for effect in found["effects"])
    # What the estimator learned in is the completed model, and the truth was not part of it.
    card = json.loads((out / "estimator" / "result.json").read_text())["result"]["card"]
    assert card["model"]["effects"] == dict(read_model(out / "diagnosis" / "model.yaml").effects)
    assert {"translation/lugre", "actuator/backlash"} <= set(read_model(out / "hidden.yaml").effects)
    page = (out / "story.html").read_text()
    assert "emulated testbed" in page
    assert page.count("data:image/png") == 3
    assert "data:image/gif" in page
    again = program("task=pipeline", *SHORT, "hydra.run.dir=out")
    assert again.status == 0, again.error
    assert again.out == answer.out
    other = program("task=pipeline", *SHORT, "seed=5", "hydra.run.dir=out")
    assert other.status == 2
    assert "made by another command" in other.error


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("friction=paper",), "friction=paper: task=pipeline has no use for it"),
        (("target=recordings", "target.path=."), "drives a robot"),
        (("task.loads=[]",), "task.loads is empty"),
        (("task.loads=[c9]",), "unknown load 'c9'"),
        (("task.fitted=0",), "fitted"),
    ],
)
def test_what_the_chain_cannot_do_is_refused_before_anything_is_recorded(
    program, tmp_path: Path, arguments: tuple[str, ...], expected: str
):
    answer = program("task=pipeline", *arguments, "hydra.run.dir=out")
    assert answer.status == 2
    assert expected in answer.error
    assert len(answer.error.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
