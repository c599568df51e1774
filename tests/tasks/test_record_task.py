"""`task=record` as a user types it: a set for task=diagnose, also where it was stopped, and proposed experiments."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from wipx.hardware.testbed import EmulatedTestbed
from wipx.recordings.source import RecordingSource

QUICK = ("target=emulated", "sim@target.engine=analytic", "target.engine.step=1e-3", "task.duration=1.2")
RECORD = ("task=record", *QUICK, "task.excitations=[release,slow,slow]", "hydra.run.dir=set")


def experiment(folder: Path, **changes: object) -> Path:
    """What task=diagnose leaves of its proposal."""
    folder.mkdir()
    proposed = {"name": "slow reversals", "reference": ["t", "x_ref"], "release": 0.0, "mass": 0.0, "repeats": 2}
    content = {"source": "old", "identifiability": {"experiment": {**proposed, **changes}}}
    (folder / "diagnosis.json").write_text(json.dumps(content))
    (folder / "next_experiment.csv").write_text("t,x_ref,x_dot_ref\n0,0,0.1\n0.6,0.06,0.1\n1.2,0.12,0.1\n")
    return folder


def test_a_set_is_left_that_other_tasks_read_and_that_says_that_it_is_emulated(program, tmp_path: Path):
    answer = program(*RECORD)
    assert (answer.status, answer.error) == (0, "")
    assert "3 of 3 recordings" in answer.out
    assert "of an emulated robot, not of a real one" in answer.out
    source = RecordingSource(path=str(tmp_path / "set"))
    recordings = source.load()
    assert [r.name for r in recordings] == ["release.csv", "slow.csv", "slow2.csv"]
    assert all(r.periods == 6 and r.duration > 1.1 for r in recordings)
    assert abs(recordings[0]["theta"][0]) > 0.02
    assert source.describe().emulated
    answer = program("task=predict", "recordings.path=set", "hydra.run.dir=seen")
    assert (answer.status, answer.error) == (0, "")


def test_an_interruption_leaves_what_was_recorded_and_the_same_command_does_the_rest(
    program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    run = EmulatedTestbed.run

    def interrupted(*arguments):
        runs = run(*arguments)
        yield next(runs)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(EmulatedTestbed, "run", interrupted)
        answer = program(*RECORD)
    assert answer.status == 130
    assert "1 of 3 recordings" in answer.out
    before = (tmp_path / "set" / "release.csv").read_text()
    assert len(RecordingSource(path=str(tmp_path / "set")).load()) == 1
    answer = program(*RECORD)
    assert (answer.status, answer.error) == (0, "")
    assert "3 of 3 recordings" in answer.out
    assert (tmp_path / "set" / "release.csv").read_text() == before
    other = program(*RECORD, "seed=5")
    assert other.status == 2
    assert "made by another command" in other.error


def test_a_recording_that_is_too_short_to_be_diagnosed_is_left_out_and_told(program, tmp_path: Path):
    answer = program(
        "task=record", *QUICK, "target.release_error=0.9", "task.excitations=[slow,slow]", "hydra.run.dir=set"
    )
    assert answer.status == 0, answer.error
    assert "left out" in answer.out


@pytest.mark.slow
def test_the_proposed_experiment_is_recorded_and_both_sets_are_one_override(program, tmp_path: Path):
    folder = experiment(tmp_path / "answer")
    answer = program("task=record", *QUICK, f"task.experiment={folder}", "hydra.run.dir=new")
    assert (answer.status, answer.error) == (0, "")
    assert f"recordings.path=[old,{tmp_path / 'new'}]" in answer.out
    assert program(*RECORD).status == 0
    source = RecordingSource(path=[str(tmp_path / "set"), str(tmp_path / "new")])
    recordings = {recording.name: recording for recording in source.load()}
    assert set(recordings) == {
        "set/release.csv", "set/slow.csv", "set/slow2.csv", "new/slow_reversals.csv", "new/slow_reversals2.csv"
    }  # fmt: skip
    rows = (tmp_path / "new" / "slow_reversals.csv").read_text().splitlines()
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows[1:]])
    t, reference = table[:, 0], table[:, rows[0].split(",").index("x_ref")]
    np.testing.assert_allclose(reference, 0.1 * t, atol=1e-6)
    answer = program("task=predict", "recordings.path=[set,new]", "hydra.run.dir=seen")
    assert (answer.status, answer.error) == (0, "")
    assert (tmp_path / "seen" / "new_slow_reversals.csv").is_file()


def test_sets_of_two_robots_are_not_joined(program, folder, tmp_path: Path):
    other = tmp_path / "other"
    shutil.copytree(folder.path, other)
    changes = {"emulated": True, "parameters": {**folder.robot["parameters"], "body_mass": 9.0}}
    for key, value in changes.items():
        (other / "robot.yaml").write_text(yaml.safe_dump({**folder.robot, key: value}))
        answer = program("task=predict", "recordings.path=[swing,other]", "hydra.run.dir=seen")
        assert answer.status == 2
        assert f"swing and other are not of one robot: {key} differs" in answer.error
    answer = program("task=predict", "recordings.path=[swing,swing]", "hydra.run.dir=seen")
    assert (answer.status, "listed twice" in answer.error) == (2, True)


FAULTS = {
    "recordings cannot be driven": (["target=recordings", "target.path=."], "recordings cannot be driven"),
    "no such excitation": (["task.excitations=[slwo]"], "did you mean slow?"),
    "no excitation": (["task.excitations=[]"], "task.excitations is empty"),
    "a controller that robot.yaml cannot describe": (["controller=mpc"], "use controller=lqr"),
    "no such experiment": (["task.experiment=none"], "task.experiment none does not exist"),
    "a folder without an answer": (["task.experiment=."], "give the folder that task=diagnose has left"),
    "a reference that leaves the rail": (["task.experiment=far.csv"], "the reference reaches 5 m"),
    "commands in the place of a reference": (["task.experiment=open.csv"], "expected x_ref or theta_ref"),
    "time that goes back": (["task.experiment=back.csv"], "back.csv line 3: t decreases"),
    "a weight": (["task.experiment=heavy"], "needs a weight of 0.25 kg"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_the_input_is_one_line_and_nothing_is_left(program, tmp_path: Path, name: str):
    (tmp_path / "far.csv").write_text("t,x_ref\n0,0\n1,0\n2,5\n3,5\n")
    (tmp_path / "open.csv").write_text("t,u\n0,0\n1,2\n2,0\n")
    (tmp_path / "back.csv").write_text("t,x_ref\n1,0\n0.5,0\n2,0\n")
    experiment(tmp_path / "heavy", mass=0.25)
    arguments, expected = FAULTS[name]
    chosen = QUICK if "target=recordings" not in arguments else ()
    answer = program("task=record", *chosen, *arguments, "hydra.run.dir=out")
    assert answer.status == 2
    assert answer.error.count("\n") == 1, answer.error
    assert expected in answer.error
    assert not (tmp_path / "out").exists()
