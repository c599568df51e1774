"""Columns of logs find their joints, signs, zeros and units; honest logs stay as their names say.

The logs are exact: a motion of sines, and the forces that the robot needs for it, with friction that the model lacks.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from moving_arm import JOINTS, MovingArm

from wipx.core.drive import Drive
from wipx.core.errors import InputError
from wipx.recordings.matching.log import Log, read_log
from wipx.recordings.matching.names import read_name
from wipx.recordings.matching.setup import Setup, set_up

SHUFFLED = [2, 0, 3, 1]
TICKS = 4096.0 / (2.0 * np.pi)


def log_of(moving_arm: MovingArm, names: Sequence[str], columns: np.ndarray) -> Log:
    return Log(Path("run.csv"), dict(zip(names, columns.T, strict=True)), "t", "s", 0.0, moving_arm.t, ())


def placed(setup: Setup) -> list[str]:
    return [setup.signals[joint].column for joint in JOINTS]


def test_an_honest_log_stays_as_its_names_say(moving_arm: MovingArm):
    names = [*JOINTS, *(f"u_{joint}" for joint in JOINTS)]
    setup = set_up(moving_arm.tree, {}, [log_of(moving_arm, names, np.hstack([moving_arm.q, moving_arm.u]))])
    for joint in JOINTS:
        assert setup.signals[joint].column == joint
        assert (setup.signals[joint].unit, setup.signals[joint].scale, setup.signals[joint].offset) == ("rad", 1.0, 0.0)
        assert (setup.signals[f"u_{joint}"].unit, setup.signals[f"u_{joint}"].scale) == ("N m", 1.0)
        assert setup.drives[joint] == Drive("torque", logged="motor")  # friction shows in the forces


def test_columns_without_names_find_their_joints_by_the_motion(moving_arm: MovingArm):
    columns = np.hstack([moving_arm.q[:, SHUFFLED], moving_arm.u[:, SHUFFLED]])
    setup = set_up(moving_arm.tree, {}, [log_of(moving_arm, list("abcdefgh"), columns)])
    assert placed(setup) == ["b", "d", "a", "c"]
    assert [setup.signals[f"u_{joint}"].column for joint in JOINTS] == ["f", "h", "e", "g"]
    assert any("say otherwise" in doubt for doubt in setup.doubts)


@pytest.mark.slow
def test_swapped_joints_are_told_in_spite_of_their_names(moving_arm: MovingArm):
    names, order = [*JOINTS, *(f"u_{joint}" for joint in JOINTS)], [0, 2, 1, 3]
    setup = set_up(
        moving_arm.tree, {}, [log_of(moving_arm, names, np.hstack([moving_arm.q[:, order], moving_arm.u[:, order]]))]
    )
    assert placed(setup) == ["pan", "elbow", "shoulder", "wrist"]


def test_degrees_are_told_by_limits_and_motion(moving_arm: MovingArm):
    names = [*(f"{joint}_pos" for joint in JOINTS), *(f"{joint}_effort" for joint in JOINTS)]
    setup = set_up(
        moving_arm.tree, {}, [log_of(moving_arm, names, np.hstack([np.rad2deg(moving_arm.q), moving_arm.u]))]
    )
    assert {setup.signals[joint].unit for joint in JOINTS} == {"deg"}


@pytest.mark.slow
def test_signs_and_zeros_are_told_by_gravity(moving_arm: MovingArm):
    sign, zero = np.array([1.0, -1.0, 1.0, 1.0]), np.array([0.0, np.pi / 2.0, -0.7, 0.0])
    names = [*JOINTS, *(f"u_{joint}" for joint in JOINTS)]
    setup = set_up(
        moving_arm.tree, {}, [log_of(moving_arm, names, np.hstack([(moving_arm.q + zero) * sign, moving_arm.u * sign]))]
    )
    signals = setup.signals
    assert (signals["shoulder"].scale, signals["u_shoulder"].scale, signals["elbow"].scale) == (-1.0, -1.0, 1.0)
    assert signals["shoulder"].offset == pytest.approx(-np.pi / 2.0, abs=0.05)
    assert signals["elbow"].offset == pytest.approx(0.7, abs=0.05)
    assert signals["wrist"].offset == 0.0


def test_a_servo_in_ticks_has_its_unit_and_stiffness(moving_arm: MovingArm):
    stiffness = np.array([30.0, 60.0, 30.0, 5.0])
    positions, goals = (
        np.round(2048.0 + TICKS * each) for each in (moving_arm.q, moving_arm.q + moving_arm.u / stiffness)
    )
    names = [*(f"present_position_{k}" for k in range(1, 5)), *(f"goal_position_{k}" for k in range(1, 5))]
    setup = set_up(moving_arm.tree, {}, [log_of(moving_arm, names, np.hstack([positions, goals]))])
    for k, joint in enumerate(JOINTS):
        assert setup.drives[joint].kind == "position"
        assert setup.drives[joint].kp == pytest.approx(stiffness[k], rel=0.15)
        for name in (joint, f"u_{joint}"):
            assert setup.signals[name].scale == pytest.approx(1.0 / TICKS)
            assert setup.signals[name].offset == pytest.approx(-np.pi)


@pytest.mark.slow
def test_currents_get_the_gain_of_each_drive(moving_arm: MovingArm):
    constants = np.array([2.1, 2.1, 0.9, 0.9])  # N m per A
    names = [*JOINTS, *(f"current_{joint}" for joint in JOINTS)]
    setup = set_up(
        moving_arm.tree, {}, [log_of(moving_arm, names, np.hstack([moving_arm.q, moving_arm.u / constants]))]
    )
    gains = [setup.drives[joint].gain for joint in JOINTS]
    np.testing.assert_allclose(gains, constants, rtol=0.15)
    assert "shoulder.gain" in setup.uncertainty


def test_a_joint_without_a_column_is_named(moving_arm: MovingArm):
    with pytest.raises(InputError, match=r"position of joint wrist.*task\.locked"):
        set_up(moving_arm.tree, {}, [log_of(moving_arm, ["pan", "shoulder", "elbow"], moving_arm.q[:, :3])])


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("tauJ3", "force"),
        ("actual_qd_0", "rate"),
        ("target_moment_2", "command"),
        ("goal_1", "target"),
        ("u_elbow", "command"),
        ("elbow_joint_dot", "rate"),
        ("motor_temperature_4", "other"),
        ("q1", "position"),
        ("elbow", "unknown"),
    ],
)
def test_roles_of_usual_names(name: str, role: str):
    assert read_name(name).role == role


def test_time_in_nanoseconds_counts_from_the_first_row(tmp_path: Path):
    path = tmp_path / "run.csv"
    rows = "\n".join(f"{1_700_000_000_000_000_000 + k * 5_000_000},{np.sin(0.1 * k):.6f}" for k in range(100))
    path.write_text(f"stamp,elbow\n{rows}\n", encoding="utf-8")
    log = read_log(path)
    assert log.rate == pytest.approx(200.0, rel=1e-3)
    assert log.t[0] == 0.0
