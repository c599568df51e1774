"""Robots with many joints and hidden physics: their equations are right, and equal those that are fitted to them."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from wipx.core.model import ModelBatch
from wipx.effects.catalogue import kinds, of_trees
from wipx.proof.blind_robots.trees.choices import effects_of
from wipx.proof.blind_robots.trees.dynamics import Body, at_poses, room
from wipx.proof.blind_robots.trees.files import model_file, model_name, robot_file
from wipx.proof.blind_robots.trees.logging import Run, Tuning, control_of, record
from wipx.proof.blind_robots.trees.physics import Hidden, UnmodelledPhysics, body_of, real
from wipx.proof.blind_robots.trees.plans import LogSettings, draw_scenario
from wipx.proof.blind_robots.trees.robots import GRAVITY, Robot, draw_robot
from wipx.proof.blind_robots.trees.sizes import Draw, doing, draw_values
from wipx.recordings.robot_file import read_robot
from wipx.recordings.robot_model import read_drives
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

KNOWN = frozenset((*kinds(), *of_trees()))
SECONDS = 2.0
# its drive crosses a gap in another way than the one that is fitted
MODELLERS_CHOICE = ("backlash",)


def mass_and_bias(q: np.ndarray, body: Body, v: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix (N, N) and bias (N,) of a state; at rest without rates."""
    n = len(q)
    matrices, biases = np.zeros((1, n, n)), np.zeros((1, n))
    rates = np.zeros((1, n)) if v is None else v[None]
    at_poses(q[None], rates, body, room(n), np.zeros((2, 3, 3)), matrices, biases)
    return matrices[0], biases[0]


def perfect(joints: int) -> LogSettings:
    """A log without noise."""
    zeros = (0.0,) * joints
    return LogSettings(1, 0.0, 0.0, zeros, zeros, None, None)


class Bench:
    """A robot that does the same motion with different physics."""

    def __init__(self, robot: Robot, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.robot, self.settings = robot, perfect(len(robot.links))
        self.control = control_of(robot, Tuning(12.0, 0.8))
        self.scenario = draw_scenario(robot, self.settings, "fourier", self.rng, (3.0, 3.1))
        run = self.run(Hidden())
        assert run is not None
        self.draw = Draw(robot, doing(robot, (run,)), self.rng)

    def run(self, hidden: Hidden) -> Run | None:
        truth = real(self.robot.links, self.robot.drives, GRAVITY, hidden)
        return record(self.robot, truth, self.control, self.scenario, self.settings)

    def difference(self, hidden: Hidden, folder: Path) -> float:
        """Largest difference of the fitted model's motion under the same commands, over the way of the joint."""
        run = self.run(hidden)
        if run is None:  # it leaves its limits, as without enough force
            return 0.0
        (folder / model_name(self.robot)).write_text(model_file(self.robot), encoding="utf-8")
        (folder / "robot.yaml").write_text(yaml.safe_dump(robot_file(self.robot, {}, {})), encoding="utf-8")
        model = read_robot(folder / "robot.yaml").model.with_effects(hidden.effects)
        t = run.columns["t"]
        rows = int(np.searchsorted(t, SECONDS))
        commands = np.stack([run.columns[name] for name in model.plant.commands], axis=1)
        recorded = np.stack([run.columns[name] for name in model.plant.joints], axis=1)[:rows]
        held = [self.scenario.plan.reference[0, 0, self.robot.joints.index(joint)] for joint in model.plant.joints]
        start = np.concatenate([held, np.zeros(len(held))])[:, None, None]
        inputs = Inputs.of([t[:rows]], [commands[:rows]], [0])
        moved = AnalyticSimulator(threads=1, step=1e-4).replay(ModelBatch(model), inputs, start).coordinates[:, :, 0, 0]
        return float((np.abs(moved - recorded) / np.ptp(recorded, axis=0)).max())


@pytest.fixture(scope="module")
def servos() -> Bench:
    """Two position drives, whose motion forgets small errors."""
    return Bench(draw_robot(np.random.default_rng(28), 2), 28)


@pytest.mark.slow
def test_the_servos_are_position_drives(servos: Bench):
    assert {drive.kind for drive in servos.robot.drives} == {"position"}


@pytest.mark.parametrize("seed", range(4))
def test_mass_matrix_and_bias_of_the_written_file_are_those_of_mujoco(seed: int, tmp_path: Path):
    mujoco = pytest.importorskip("mujoco")
    rng = np.random.default_rng(seed)
    robot = draw_robot(rng)
    path = tmp_path / model_name(robot)
    path.write_text(model_file(robot), encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(path))
    data, n = mujoco.MjData(model), len(robot.links)
    order = [robot.joints.index(model.joint(j).name) for j in range(n)]
    q, v = rng.normal(size=n), 3.0 * rng.normal(size=n)
    data.qpos[:], data.qvel[:] = q[order], v[order]
    mujoco.mj_forward(model, data)
    matrix = np.zeros((n, n))
    mujoco.mj_fullM(model, data, matrix)
    own, bias = mass_and_bias(q, body_of(robot.links, GRAVITY), v)
    own += np.diag([link.armature for link in robot.links])
    np.testing.assert_allclose(own[np.ix_(order, order)], matrix, atol=1e-11 * np.abs(matrix).max())
    np.testing.assert_allclose(bias[order], data.qfrc_bias, atol=1e-11 * np.abs(data.qfrc_bias).max())


def test_drives_of_the_written_file_are_read_as_they_are(tmp_path: Path):
    robot = next(r for r in map(draw_robot, map(np.random.default_rng, range(50))) if r.drives[0].in_file)
    path = tmp_path / model_name(robot)
    path.write_text(model_file(robot), encoding="utf-8")
    found = read_drives(path)
    for joint, drive in zip(robot.joints, robot.drives, strict=True):
        if drive.kind != "none":
            assert (found[joint].kind, found[joint].kp, found[joint].kd) == (drive.kind, drive.kp, drive.kd)
            assert found[joint].gain == drive.gain


@pytest.mark.slow
def test_every_effect_moves_the_robot_as_the_model_that_is_fitted(servos: Bench, tmp_path: Path):
    names = [*effects_of(servos.robot, 0, KNOWN), "actuator/delay", "environment/base_tilt"]
    for name in names:
        kind = name.partition("/")[2]
        if kind in MODELLERS_CHOICE:
            continue
        hidden = Hidden({name: draw_values(name, servos.draw)})
        # dry friction and bristles that reverse between two steps of 0.1 ms
        assert servos.difference(hidden, tmp_path) < (2e-3 if kind in ("presliding", "sticky_spot") else 2e-4), name


@pytest.mark.slow
def test_a_free_drive_in_its_gap_hardly_differs_from_the_fitted_one(servos: Bench, tmp_path: Path):
    name = f"actuator_{servos.robot.joints[0]}/backlash"
    hidden = Hidden({name: draw_values(name, servos.draw)}, {name: {"drive_inertia": 0.01 * servos.robot.inertia[0]}})
    assert servos.difference(hidden, tmp_path) < 0.03


@pytest.mark.parametrize("name", ["flexible_link", "slosh"])
def test_what_moves_inside_changes_no_mass_while_it_rests(name: str):
    robot = draw_robot(np.random.default_rng(2), 4)
    hand = {"mass": 0.3 * robot.links[3].mass, "axis_x": 0.0, "axis_y": 0.6, "axis_z": 0.8}
    unmodelled = UnmodelledPhysics(
        name, 1 if name == "flexible_link" else 3, {"stiffness": 1.0, "damping": 1.0, **hand}
    )
    plain = real(robot.links, robot.drives, GRAVITY, Hidden())
    odd = real(robot.links, robot.drives, GRAVITY, Hidden(unmodelled=unmodelled))
    assert len(odd.joints) == 5
    q = np.random.default_rng(3).normal(size=4)
    inside = np.zeros(5)
    inside[odd.visible] = q
    (matrix, bias), (other, pull) = mass_and_bias(q, plain.body), mass_and_bias(inside, odd.body)
    np.testing.assert_allclose(other[np.ix_(odd.visible, odd.visible)], matrix, atol=1e-9 * matrix.max())
    np.testing.assert_allclose(pull[odd.visible], bias, atol=1e-9 * np.abs(bias).max())
