"""Stiffness and damping of position drives: one joint by hand, where the effects exist, and their factors come back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wipx.core.drive import Drive
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import robot_plant
from wipx.effects.catalogue import vocabulary
from wipx.recordings.robot_model import read_tree
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

pytest.importorskip("mujoco")
MASS, LENGTH, INERTIA = 0.5, 0.2, 0.01  # of a pendulum that hangs at q = 0: kg, m, kg m^2
ONE = f"""<mujoco><worldbody><body name="upper"><inertial pos="0 0 {-LENGTH}" mass="{MASS}"
diaginertia="{INERTIA} {INERTIA} 0.001"/><joint name="shoulder" axis="0 -1 0"/></body></worldbody></mujoco>"""
SERVO = Drive("position", kp=8.0, kd=0.4)
FACTORS = {"kp": 0.7, "kd": 1.4}


def arm(folder: Path, drive: Drive, effects: dict) -> Model:
    path = folder / "arm.xml"
    path.write_text(ONE, encoding="utf-8")
    plant = robot_plant(read_tree(path), {"shoulder": drive})
    return Model(plant, plant.complete({}, "robot.yaml"), effects)


def missing(kinds: tuple[str, ...]) -> dict[str, dict[str, float]]:
    return {f"actuator_shoulder/{kind}": {"factor": FACTORS[kind]} for kind in kinds}


def by_hand(drive: Drive, t: np.ndarray, targets: np.ndarray, step: float = 1e-4) -> np.ndarray:
    """Position of the pendulum, shape (rows,), by the midpoint rule; `drive` has the true stiffness and damping."""
    inertia, weight = INERTIA + MASS * LENGTH**2, MASS * 9.81 * LENGTH
    limit = np.inf if drive.limit is None else drive.limit

    def loop(target: float, q: float, v: float) -> float:
        return min(max(drive.kp * (target - q) - drive.kd * v, -limit), limit)

    q, v, force, due, places = 0.0, 0.0, 0.0, 0, [0.0]
    per_row = round((t[1] - t[0]) / step)
    turn = 0 if drive.rate is None else round(1.0 / (drive.rate * step))
    for k in range(len(t) - 1):
        for i in range(per_row):
            if turn and k * per_row + i == due:
                force, due = loop(targets[k], q, v), due + turn
            first = force if turn else loop(targets[k], q, v)
            middle_q, middle_v = q + 0.5 * step * v, v + 0.5 * step * (first - weight * np.sin(q)) / inertia
            second = force if turn else loop(targets[k], middle_q, middle_v)
            q, v = q + step * middle_v, v + step * (second - weight * np.sin(middle_q)) / inertia
        places.append(q)
    return np.array(places)


@pytest.mark.parametrize("kinds", [("kp",), ("kd",), ("kp", "kd")], ids="+".join)
@pytest.mark.parametrize("drive", [SERVO, replace(SERVO, limit=1.2), replace(SERVO, rate=50.0)], ids=repr)
def test_a_joint_moves_as_by_hand(drive: Drive, kinds: tuple[str, ...], tmp_path: Path):
    t = np.arange(0.0, 0.401, 0.01)
    targets = 0.6 * np.sin(8.0 * t)
    true = replace(drive, **{kind: FACTORS[kind] * getattr(drive, kind) for kind in kinds})
    model = arm(tmp_path, drive, missing(kinds))
    inputs = Inputs.of([t], [targets[:, None]], [0])
    moved = AnalyticSimulator(1e-4).replay(ModelBatch(model), inputs, np.zeros((2, 1, 1))).coordinates[:, 0, 0, 0]
    expected = by_hand(true, t, targets)
    np.testing.assert_allclose(moved, expected, atol=1e-4)  # the kernel's integrator is of first order in its step
    assert np.abs(expected - by_hand(drive, t, targets)).max() > 1e-2


@pytest.mark.parametrize(
    ("drive", "kinds"),
    [(SERVO, {"kp", "kd"}), (replace(SERVO, kd=0.0), {"kp"}), (Drive("torque"), set()), (Drive("none"), set())],
)
def test_only_a_position_drive_has_them(drive: Drive, kinds: set[str], tmp_path: Path):
    names = {f"{site}/{kind}" for site in ("actuator_shoulder", "actuator", "shoulder") for kind in ("kp", "kd")}
    found = names & vocabulary(arm(tmp_path, drive, {}).plant).keys()
    assert found == {f"actuator_shoulder/{kind}" for kind in kinds}


def test_a_factor_of_one_is_no_effect(tmp_path: Path):
    t = np.arange(0.0, 0.2, 0.01)
    inputs = Inputs.of([t], [np.sin(9.0 * t)[:, None]], [0])
    runs = [
        AnalyticSimulator().replay(ModelBatch(arm(tmp_path, SERVO, effects)), inputs, np.zeros((2, 1, 1))).coordinates
        for effects in ({}, {f"actuator_shoulder/{kind}": {"factor": 1.0} for kind in FACTORS})
    ]
    np.testing.assert_array_equal(runs[0], runs[1])
