"""`wipx.diagnose`: the same answer from a folder, from files and from objects."""

import subprocess
import sys
from pathlib import Path

import pytest
from diagnosis.recorded import recorded, write_folder

import wipx
from wipx.core.diagnosis import Diagnosis
from wipx.core.errors import InputError
from wipx.recordings.robot_file import read_robot
from wipx.recordings.source import RecordingSource

SLOW_PACKAGES = {"numba", "scipy", "matplotlib", "plotly", "mlflow", "pandas", "hydra"}
COLUMNS = ("t", "x", "u")


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An axis with Coulomb friction of 0.5 N."""
    recordings = recorded("linear_axis", {"translation/coulomb": {"F_c": 0.5}}, seed=12)
    return write_folder(tmp_path_factory.mktemp("library") / "axis", "linear_axis", recordings, COLUMNS)


def content(answer: Diagnosis) -> tuple:
    """What the answer says, without title, source and time."""
    effects = [(e.name, e.parameters, e.equivalent, e.log_evidence_gain, e.heldout_gain) for e in answer.effects]
    return answer.verdict, answer.sentence, effects, answer.fit, answer.held_out, answer.bounds, answer.weak


@pytest.mark.slow
def test_a_folder_and_its_objects_give_the_same_answer(axis: Path):
    source = RecordingSource(path=str(axis))
    from_folder = wipx.diagnose(axis)
    assert [effect.name for effect in from_folder.effects] == ["translation/coulomb"]
    assert from_folder.effects[0].parameters[0].value == pytest.approx(0.5, rel=0.01)
    for robot in (axis / "robot.yaml", read_robot(axis / "robot.yaml")):
        assert content(wipx.diagnose(source.load(), robot)) == content(from_folder)
    assert content(wipx.diagnose(str(axis), str(axis / "robot.yaml"))) == content(from_folder)


def test_suspects_are_answered(axis: Path):
    (suspect,) = wipx.diagnose(axis, suspects={"translation/coulomb": {"F_c": 0.5}}).suspects
    assert suspect.named
    assert suspect.size is not None
    assert not suspect.size.excluded
    with pytest.raises(InputError, match="did you mean translation/coulomb"):
        wipx.diagnose(axis, suspects={"translation/coulom": {}})


def test_recordings_without_a_robot_are_refused(axis: Path):
    with pytest.raises(InputError, match=r"robot: .* give robot\.yaml's path"):
        wipx.diagnose(RecordingSource(path=str(axis)).load())


def test_a_folder_that_does_not_exist_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="does not exist"):
        wipx.diagnose(tmp_path / "nowhere")


def test_importing_the_package_is_quick():
    question = f"import sys, wipx; assert callable(wipx.diagnose); print(sorted({SLOW_PACKAGES!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", question], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "[]\n"
