"""Inverse dynamics of a robot from a model file, and what a regression on it finds."""

from pathlib import Path

import numpy as np
import pytest

from wipx.baselines.case import Problem
from wipx.baselines.instrumental_variables import InstrumentalVariables
from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.identify.inverse_dynamics import Signals, missing, regressor, weight_of
from wipx.proof.blind_robots.trees.dynamics import at_poses, room
from wipx.proof.blind_robots.trees.files import model_file, model_name, robot_file
from wipx.proof.blind_robots.trees.links import changed
from wipx.proof.blind_robots.trees.logging import Tuning, control_of, record
from wipx.proof.blind_robots.trees.physics import Drive, Hidden, body_of, real
from wipx.proof.blind_robots.trees.plans import LogSettings, draw_scenario
from wipx.proof.blind_robots.trees.robots import GRAVITY, Robot, draw_robot
from wipx.recordings.robot_file import robot_from_mapping
from wipx.sim.analytic import AnalyticSimulator

HIDDEN = {
    "j1/coulomb": {"F_c": 0.3},
    "j2/viscous": {"sigma": 0.2},
    "link_j2_link/payload": {"mass": 0.2, "x": 0.01, "y": -0.02, "z": 0.05},
}


def robot() -> Robot:
    """Two torque drives; the file knows no friction."""
    drawn = (draw_robot(np.random.default_rng(seed), 2) for seed in range(200))
    return next(
        one
        for one in drawn
        if one.joints == ("j1", "j2")
        and all(drive == Drive("torque") for drive in one.drives)
        and not any(link.slides or link.damping for link in one.links)
        and one.links[1].body == "j2_link"
        and 1.0 < one.links[1].mass < 4.0
    )


def nominal(drawn: Robot, folder: Path) -> Model:
    (folder / model_name(drawn)).write_text(model_file(drawn), encoding="utf-8")
    return robot_from_mapping(robot_file(drawn, {}, {}), "robot.yaml", folder).model


def test_a_true_model_misses_no_force(tmp_path: Path):
    drawn, rng, rows = robot(), np.random.default_rng(1), 20
    model = nominal(drawn, tmp_path).with_effects(HIDDEN)
    q, v, a = rng.normal(size=(3, rows, 2))
    matrices, biases = np.zeros((rows, 2, 2)), np.zeros((rows, 2))
    body = body_of(changed(drawn.links, HIDDEN), GRAVITY)
    at_poses(q, v, body, room(2), np.zeros((2, 3, 3)), matrices, biases)
    matrices += np.diag([link.armature for link in drawn.links])
    friction = np.stack([0.3 * np.sign(v[:, 0]), 0.2 * v[:, 1]], axis=1)
    forces = np.einsum("rij,rj->ri", matrices, a) + biases + friction
    signals = Signals(q, v, a, forces, np.sign(v))
    assert model.plant.tree is not None
    left = missing(model, signals, regressor(model.plant.tree, signals, weight_of(model)))
    np.testing.assert_allclose(left, 0.0, atol=1e-9 * np.abs(forces).max())


@pytest.mark.slow
def test_friction_and_payload_of_an_arm_are_found(tmp_path: Path):
    drawn, rng = robot(), np.random.default_rng(2)
    settings = LogSettings(1, 0.0, 0.0, (1e-5, 1e-5), (0.0, 0.0), None, None)
    truth = real(drawn.links, drawn.drives, GRAVITY, Hidden(HIDDEN))
    control = control_of(drawn, Tuning(12.0, 0.8))
    runs = [
        record(drawn, truth, control, draw_scenario(drawn, settings, "fourier", rng, (8.0, 8.1)), settings)
        for _ in range(3)
    ]
    recordings = tuple(Recording(f"r{i}.csv", run.columns) for i, run in enumerate(runs) if run is not None)
    case = Problem(recordings, nominal(drawn, tmp_path), {}, AnalyticSimulator(threads=1))
    answer = InstrumentalVariables().answer(case, rng)
    found = {one.name: one.parameters for one in answer.found}
    assert {"j1/coulomb", "j2/viscous"} <= set(found)
    # smoothed rates round off what happens at a reversal
    assert found["j1/coulomb"]["F_c"] == pytest.approx(0.3, rel=0.1)
    assert found["j2/viscous"]["sigma"] == pytest.approx(0.2, rel=0.1)


def test_one_of_the_five_plants_is_refused():
    plant = plant_of("pendulum")
    values = {"body_mass": 1.0, "com_height": 0.3, "body_inertia": 0.1}
    case = Problem((), Model(plant, plant.complete(values, "test"), {}), {}, AnalyticSimulator(threads=1))
    with pytest.raises(InputError, match="model files"):
        InstrumentalVariables().answer(case, np.random.default_rng(0))
