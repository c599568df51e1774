"""Elasticity of a drive: a second inertia on a spring, against its equations of motion and their limits."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sim.robots import Effects, move, sines

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.plant import robot_plant
from wipx.effects.catalogue import check_together
from wipx.recordings.robot_model import read_tree
from wipx.sim.analytic import AnalyticSimulator

MASS, GRAVITY = 2.0, 9.81
SLIDE = f"""<mujoco><worldbody><body name="carriage"><joint name="lift" type="slide" axis="0 0 1"/>
<inertial pos="0 0 0" mass="{MASS}" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
T = np.linspace(0.0, 1.0, 501)
SPRING = {"drive_inertia": 0.7, "stiffness": 900.0, "damping": 1.5}
LIFTED = MASS * GRAVITY + sines(T, 8.0)[:, 0]  # [N]
FINE = AnalyticSimulator(step=2e-4)


def lift(folder: Path, effects: Effects) -> Model:
    """A carriage of 2 kg that its drive lifts against gravity."""
    file = folder / "lift.xml"
    file.write_text(SLIDE, encoding="utf-8")
    plant = robot_plant(read_tree(file), {})
    return Model(plant, plant.complete({}, "robot.yaml"), effects)


def reference(friction: float = 0.0) -> np.ndarray:
    """Place and rate of the carriage by an adaptive integrator, shape (rows, 2)."""
    J, k, c = (SPRING[name] for name in ("drive_inertia", "stiffness", "damping"))

    def slopes(t: float, y: np.ndarray) -> list[float]:
        row = min(int(t / T[1] + 1e-9), len(LIFTED) - 1)
        passed = k * (y[2] - y[0]) + c * (y[3] - y[1])
        return [y[1], (passed - friction * y[1]) / MASS - GRAVITY, y[3], (LIFTED[row] - passed) / J]

    start = [0.0, 0.0, LIFTED[0] / k, 0.0]
    return solve_ivp(slopes, (0.0, T[-1]), start, t_eval=T, rtol=1e-8, atol=1e-10, max_step=T[1]).y[:2].T


@pytest.mark.parametrize("friction", [0.0, 3.0])
def test_an_elastic_drive_moves_its_link_as_two_masses_on_a_spring_do(friction: float, tmp_path: Path):
    effects: Effects = {"actuator_lift/elasticity": SPRING, "lift/viscous": {"sigma": friction}}
    motion = move(lift(tmp_path, effects), (0.0, 0.0), T, LIFTED, FINE)
    expected = reference(friction)
    np.testing.assert_allclose(motion.q[:, 0], expected[:, 0], rtol=0.0, atol=2e-5 * np.ptp(expected[:, 0]))
    np.testing.assert_allclose(motion.v[:, 0], expected[:, 1], rtol=0.0, atol=1e-3 * np.ptp(expected[:, 1]))


def test_its_error_shrinks_with_the_square_of_the_step(tmp_path: Path):
    model = lift(tmp_path, {"actuator_lift/elasticity": SPRING})
    fine, middle, coarse = (move(model, (0.0, 0.0), T, LIFTED, AnalyticSimulator(h)).q for h in (1e-4, 1e-3, 2e-3))
    ratio = np.abs(coarse - fine).max() / np.abs(middle - fine).max()
    assert ratio == pytest.approx(4.0, rel=0.1)


def test_a_stiff_spring_makes_the_drive_a_part_of_the_link(tmp_path: Path):
    stiff = {"drive_inertia": 0.7, "stiffness": 1e7, "damping": 100.0}
    one = move(lift(tmp_path, {"actuator_lift/elasticity": stiff}), (0.0, 0.0), T, LIFTED)
    same = move(lift(tmp_path, {"lift/rotor_inertia": {"J": 0.7}}), (0.0, 0.0), T, LIFTED)
    np.testing.assert_allclose(one.q, same.q, rtol=0.0, atol=1e-3 * np.ptp(same.q))


def test_a_drive_without_inertia_passes_its_force_on(tmp_path: Path):
    light = {"drive_inertia": 0.0, "stiffness": 50.0, "damping": 0.0}
    one = move(lift(tmp_path, {"actuator_lift/elasticity": light}), (0.0, 0.3), T, LIFTED)
    np.testing.assert_allclose(one.q, move(lift(tmp_path, {}), (0.0, 0.3), T, LIFTED).q, rtol=0.0, atol=1e-12)


def test_a_spring_that_holds_a_weight_at_rest_stays_at_rest(tmp_path: Path):
    holding = np.full(len(T) - 1, MASS * GRAVITY)
    motion = move(lift(tmp_path, {"actuator_lift/elasticity": SPRING}), (0.1, 0.0), T, holding)
    np.testing.assert_allclose(motion.q, 0.1, rtol=0.0, atol=1e-12)


def test_a_link_that_sticks_lets_its_drive_swing(tmp_path: Path):
    """The spring pulls the link loose although the motor alone never would: it swings to twice its force."""
    pull = MASS * GRAVITY + np.where(T[:-1] < 0.1, 0.0, 4.0)
    dry = {"lift/coulomb": {"F_c": 6.0}}
    rigid = move(lift(tmp_path, dry), (0.0, 0.0), T, pull)
    swings = {**SPRING, "damping": 0.0}
    elastic = move(lift(tmp_path, {**dry, "actuator_lift/elasticity": swings}), (0.0, 0.0), T, pull)
    np.testing.assert_array_equal(rigid.q, 0.0)
    assert np.all(elastic.q[T < 0.1] == 0.0)
    assert elastic.q.max() > 1e-3


def test_a_drive_has_play_or_a_spring(tmp_path: Path):
    plant = lift(tmp_path, {}).plant
    with pytest.raises(InputError, match="keep one of them"):
        check_together(("actuator_lift/backlash", "actuator_lift/elasticity"), plant)
