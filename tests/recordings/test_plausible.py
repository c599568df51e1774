"""Recordings of a robot that are not what they are said to be are refused; honest ones are not."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from moving_arm import JOINTS, MovingArm

from wipx.core.errors import InputError
from wipx.core.recording import Recording
from wipx.recordings.source import RecordingSource

ARMS = Path(os.environ.get("WIPX_ARMS", Path(__file__).parents[3] / "shared" / "arms"))
STIFFNESS = np.array([30.0, 60.0, 30.0, 5.0])
SWAPPED = [0, 2, 1, 3]
Load = Callable[..., tuple[Recording, ...]]


@pytest.fixture
def load(moving_arm: MovingArm, tmp_path: Path) -> Load:
    """Writes a recording of these positions and commands, and reads it."""

    def written(q: np.ndarray, u: np.ndarray, *, position: bool = False) -> tuple[Recording, ...]:
        shutil.copy(moving_arm.path, tmp_path)
        drives = [f"{{kind: position, kp: {k}, kd: 0.0}}" if position else "{kind: torque}" for k in STIFFNESS]
        listed = "\n".join(f"  {joint}: {drive}" for joint, drive in zip(JOINTS, drives, strict=True))
        (tmp_path / "robot.yaml").write_text(f"plant: robot\nmodel: arm.xml\ndrives:\n{listed}\n", encoding="utf-8")
        head = ",".join(["t", *JOINTS, *(f"u_{joint}" for joint in JOINTS)])
        table = np.column_stack([moving_arm.t, q, u])
        np.savetxt(tmp_path / "r1.csv", table, delimiter=",", header=head, comments="", fmt="%.9g")
        return RecordingSource(path=str(tmp_path)).load()

    return written


def targets(arm: MovingArm) -> np.ndarray:
    return arm.q + arm.u / STIFFNESS


def test_honest_recordings_are_read_without_a_word(
    load: Load, moving_arm: MovingArm, capsys: pytest.CaptureFixture[str]
):
    assert len(load(moving_arm.q, moving_arm.u)) == 1
    assert len(load(moving_arm.q, targets(moving_arm), position=True)) == 1
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("arm", ["staubli_tx40", "kuka_kr300", "ur10_unisa"])
@pytest.mark.parametrize("part", ["visible", "unseen"])
def test_recordings_of_real_arms_are_read_without_a_word(arm: str, part: str, capsys: pytest.CaptureFixture[str]):
    folder = ARMS / arm / part
    if not folder.is_dir():
        pytest.skip(f"{folder} is missing: recordings of real arms; WIPX_ARMS names their folder")
    RecordingSource(path=str(folder)).load()
    assert capsys.readouterr().err == ""


def test_degrees_are_told_by_the_limits(load: Load, moving_arm: MovingArm):
    with pytest.raises(InputError, match=r"pan moves from .* its limits are -3 and 3; .*\{pan: \{unit: deg\}\}"):
        load(np.rad2deg(moving_arm.q), moving_arm.u)
    with pytest.raises(InputError, match="unit: deg"):
        load(np.rad2deg(moving_arm.q), np.rad2deg(targets(moving_arm)), position=True)


@pytest.mark.parametrize(
    ("positions", "commands", "said"), [(True, True, "columns"), (True, False, "positions"), (False, True, "commands")]
)
def test_swapped_joints_are_told_by_the_motion(
    load: Load, moving_arm: MovingArm, positions: bool, commands: bool, said: str
):
    q = moving_arm.q[:, SWAPPED] if positions else moving_arm.q
    u = moving_arm.u[:, SWAPPED] if commands else moving_arm.u
    with pytest.raises(InputError, match=f"the {said} of shoulder and elbow are swapped"):
        load(q, u)


def test_swapped_targets_are_told_by_who_follows_them(load: Load, moving_arm: MovingArm):
    with pytest.raises(InputError, match="shoulder follows the targets of elbow"):
        load(moving_arm.q, targets(moving_arm)[:, SWAPPED], position=True)


def test_targets_in_ticks_are_told_by_the_position(load: Load, moving_arm: MovingArm):
    ticks = np.round(2048.0 + targets(moving_arm) * 4096.0 / (2.0 * np.pi))
    with pytest.raises(InputError, match=r"ticks of 4096 a turn.*\{u_pan: \{column: u_pan, scale: 0.00153398"):
        load(moving_arm.q, ticks, position=True)


def test_positions_beyond_the_limits_are_worth_a_warning(
    load: Load, moving_arm: MovingArm, capsys: pytest.CaptureFixture[str]
):
    load(moving_arm.q + np.array([2.5, 0.0, 0.0, 0.0]), moving_arm.u)  # gravity does not see where the base points to
    said = capsys.readouterr().err
    assert said.startswith("warning: ")
    assert "pan moves from" in said
    assert said.count("\n") == 1


def test_positions_far_beyond_the_limits_are_refused(load: Load, moving_arm: MovingArm):
    with pytest.raises(InputError, match="shoulder moves from"):
        load(moving_arm.q + np.array([0.0, 4.0, 0.0, 0.0]), moving_arm.u)


def test_a_joint_without_a_column_may_be_locked(load: Load, moving_arm: MovingArm, tmp_path: Path):
    load(moving_arm.q, moving_arm.u)
    path = tmp_path / "r1.csv"
    path.write_text(path.read_text(encoding="utf-8").replace("elbow", "other"), encoding="utf-8")
    with pytest.raises(InputError, match=r"column elbow \[rad\] is missing.*locked: \{elbow: 0.0\}"):
        RecordingSource(path=str(tmp_path)).load()
