"""`task=real_diagnosis`: recordings of real hardware, diagnosed without what their authors know."""

import json
from pathlib import Path

import numpy as np
import pytest

from wipx.core.diagnosis import FoundEffect
from wipx.core.recording import Recording
from wipx.recordings.source import RecordingSource
from wipx.tasks.real_diagnosis import Case, Outcome, only, row, score

RESULTS = {"diagnosis.json", "diagnosis.png", "heldout.json", "model.yaml", "report.html"}


def found(name: str, *equivalent: str) -> FoundEffect:
    return FoundEffect(name, "", "", False, (), equivalent, (), 100.0, 0.9, 0.99, 1.0, None)


def test_a_tie_is_told_from_a_name():
    known = {"pitch/coulomb": "F_c = 1 N m", "actuator/offset": "-0.1 N m"}
    effects = (found("pitch/coulomb"), found("sensor_theta/bias", "actuator/offset"), found("actuator/delay"))
    assert score(known, effects) == "1 of 2, 1 tied, 2 beside"


def test_nothing_found_names_nothing():
    assert score({"pitch/coulomb": "F_c = 1 N m"}, ()) == "0 of 1"


def test_a_refusal_stays_in_the_table():
    line = row(Outcome("Rig", {"pitch/coulomb": "F_c = 1 N m"}, None, None, "the recordings contradict its sign of u"))
    assert "no answer: the recordings contradict its sign of u" in line
    assert line.count("|") == 7


def test_a_case_widens_the_uncertainty_of_a_dataset():
    robot = {"plant": "pendulum", "uncertainty": {"body_inertia": 0.3}}
    chosen = Case("rig", {}, uncertainty={"com_height": 0.1}).of(RecordingSource(robot=robot))
    assert chosen.robot is not None
    assert chosen.robot["uncertainty"] == {"body_inertia": 0.3, "com_height": 0.1}
    assert robot["uncertainty"] == {"body_inertia": 0.3}


def test_the_diagnosis_is_given_the_rows_to_fit_alone(folder):
    source = RecordingSource(path=str(folder.path), held_out=0.3)
    split = source.split(source.load())
    seen = only(source, split.fit).load()
    assert [r.name for r in seen] == [r.name for r in split.fit]
    for loaded, fit in zip(seen, split.fit, strict=True):
        np.testing.assert_array_equal(loaded.t, fit.t)
    held = only(source, split.held_out).load()
    assert isinstance(held[0], Recording)
    assert held[0].t[0] > seen[0].t[-1]


def test_an_unknown_case_is_refused(program):
    answer = program("task=real_diagnosis", "task.only=[tuee]", "hydra.run.dir=out")
    assert answer.status == 2
    assert "did you mean tue?" in answer.error


def test_missing_recordings_are_named_with_their_origin(program, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("WIPX_RECORDINGS", str(tmp_path / "nowhere"))
    answer = program("task=real_diagnosis", "task.only=[dfki]", "hydra.run.dir=out")
    assert answer.status == 2
    assert "dfki_simple_pendulum" in answer.error
    assert "https://github.com/dfki-ric-underactuated-lab" in answer.error
    assert not (tmp_path / "out" / "table.md").exists()


@pytest.mark.slow
def test_a_real_pendulum_is_diagnosed_and_its_row_written(
    program, recordings_root: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
):
    monkeypatch.setenv("WIPX_RECORDINGS", str(recordings_root))
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- table: begin -->\nold\n<!-- table: end -->\nafter\n")
    arguments = ("task=real_diagnosis", "task.only=[dfki]", "sim.threads=1", f"task.page={page}", "hydra.run.dir=out")
    answer = program(*arguments)
    assert (answer.status, answer.error) == (0, "")
    assert {path.name for path in (tmp_path / "out" / "dfki").iterdir()} >= RESULTS
    written = page.read_text()
    assert written.startswith("before\n")
    assert written.endswith("after\n")
    assert "old" not in written
    assert "Torque-limited pendulum (DFKI)" in written
    held_out = json.loads((tmp_path / "out" / "dfki" / "heldout.json").read_text())
    assert held_out["recordings"] == ["constant_torque_0p9Nm.csv"]
    assert held_out["noise_floor"]["theta"] < held_out["completed"]["theta"]
    assert held_out["completed"]["theta"] < 1.05 * held_out["nominal"]["theta"]  # the decay says little of the swing-up
