"""Robots from model files: equations against MuJoCo's, exact sticking, and their own plants where there is one."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sim.random_trees import mjcf

from wipx.core.drive import Drive
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of, robot_plant
from wipx.recordings.robot_model import read_tree
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.tree import equations as E
from wipx.sim.tree.graph import Node
from wipx.sim.tree.inertias import gravity, inertial_numbers

mujoco: Any = pytest.importorskip("mujoco")
TWO = """<mujoco><worldbody><body name="upper"><inertial pos="0 0 -0.2" mass="0.5" diaginertia="0.01 0.01 0.001"/>
<joint name="shoulder" axis="0 -1 0" damping="0.01"/><body name="lower" pos="0 0 -0.3">
<inertial pos="0 0 -0.15" mass="0.3" diaginertia="0.004 0.004 0.0005"/>
<joint name="elbow" axis="0 -1 0" frictionloss="0.02" armature="0.001"/></body></body></worldbody></mujoco>"""
SAME = {
    "link1_mass": 0.5,
    "link1_length": 0.3,
    "link1_com": 0.2,
    "link1_inertia": 0.01 + 0.5 * 0.2**2,
    "link2_mass": 0.3,
    "link2_length": 0.3,
    "link2_com": 0.15,
    "link2_inertia": 0.004 + 0.3 * 0.15**2,
}


def model_of(path: Path, text: str, effects: dict | None = None, drives: dict[str, Drive] | None = None) -> Model:
    path.write_text(text, encoding="utf-8")
    plant = robot_plant(read_tree(path), drives or {})
    return Model(plant, plant.complete({}, "robot.yaml"), effects or {})


def replayed(model: Model, t: np.ndarray, commands: np.ndarray, initial: np.ndarray, step: float = 1e-3) -> np.ndarray:
    """Coordinates and rates, shape (rows, 2 joints)."""
    inputs = Inputs.of([t], [commands], [0])
    run = AnalyticSimulator(step).replay(ModelBatch(model), inputs, initial[:, None, None])
    return np.concatenate([run.coordinates[:, :, 0, 0], run.rates[:, :, 0, 0]], axis=1)


def equations(model: Model, q: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix (N, N) and bias forces (N,)."""
    tree, batch = model.plant.tree, ModelBatch(model)
    assert tree is not None
    poses = [E.pose(link, float(x), float(np.sin(x)), float(np.cos(x))) for link, x in zip(tree.links, q, strict=True)]
    inertias = []
    for link in tree.links:
        mass, x, y, z, *rest = inertial_numbers(batch, link)[:, 0].tolist()
        inertias.append(E.Inertia(mass, (x, y, z), *rest))
    entries = E.mass_matrix(tree, poses, inertias, [link.armature for link in tree.links])
    matrix = np.zeros((len(q), len(q)))
    for (i, j), entry in entries.items():
        assert not isinstance(entry, Node)
        matrix[i, j] = matrix[j, i] = entry
    down = gravity(batch, tree)[:, 0]
    return matrix, np.array(E.bias(tree, poses, rates.tolist(), inertias, (down[0], down[1], down[2])))


@pytest.mark.parametrize("joints", [1, 2, 4, 7, 12])
def test_mass_matrix_and_bias_are_mujocos(joints: int, tmp_path: Path, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    for k in range(5):
        text = mjcf(joints, rng)
        model = model_of(tmp_path / f"{k}.xml", text)
        engine = mujoco.MjModel.from_xml_string(text)
        data, full = mujoco.MjData(engine), np.zeros((joints, joints))
        order = [engine.joint(name).id for name in model.plant.joints]
        for _ in range(5):
            q, rates = rng.uniform(-3.0, 3.0, joints), rng.normal(size=joints)
            data.qpos[order], data.qvel[order] = q, rates
            mujoco.mj_forward(engine, data)
            mujoco.mj_fullM(engine, data, full)
            matrix, bias = equations(model, q, rates)
            np.testing.assert_allclose(matrix, full[np.ix_(order, order)], atol=1e-10)
            np.testing.assert_allclose(bias, data.qfrc_bias[order], atol=1e-9)  # of forces of some 100 N m


@pytest.mark.parametrize("joints", [1, 3, 6])
def test_a_tree_moves_as_mujoco_moves_it(joints: int, tmp_path: Path, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    text = mjcf(joints, rng)
    model = model_of(tmp_path / "arm.xml", text)
    engine = mujoco.MjModel.from_xml_string(text)
    engine.opt.integrator, engine.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 1e-4
    data = mujoco.MjData(engine)
    order = [engine.joint(name).id for name in model.plant.joints]
    initial = rng.normal(size=2 * joints) * 0.3
    data.qpos[order], data.qvel[order] = initial[:joints], initial[joints:]
    t = np.linspace(0.0, 0.2, 21)
    forces = rng.normal(size=joints)
    moved = replayed(model, t, np.tile(forces, (21, 1)), initial, step=1e-4)
    data.qfrc_applied[order] = forces
    for _ in range(2000):
        mujoco.mj_step(engine, data)
    np.testing.assert_allclose(moved[-1, :joints], data.qpos[order], atol=1e-5)  # second order in steps of 0.1 ms


def test_two_links_move_as_a_double_pendulum(tmp_path: Path):
    t = np.linspace(0.0, 1.0, 201)
    commands = np.stack([0.8 * np.sin(3.0 * t), 0.2 * np.sin(5.0 * t)], axis=1)
    initial = np.array([0.3, -0.5, 0.1, 0.2])
    arm = model_of(tmp_path / "arm.xml", TWO)
    own = plant_of("double_pendulum")
    effects = {"joint1/viscous": {"sigma": 0.01}, "joint2/coulomb": {"F_c": 0.02}, "joint2/rotor_inertia": {"J": 0.001}}
    same = Model(own, own.complete(SAME, "robot.yaml"), effects)
    np.testing.assert_allclose(replayed(arm, t, commands, initial), replayed(same, t, commands, initial), atol=1e-12)


def exactly(matrix: np.ndarray, without: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Rates with dry friction, by trying every combination of sides."""
    joints = len(levels)
    for number in range(3**joints):
        sides = np.array([number // 3**i % 3 - 1 for i in range(joints)])
        slides = sides != 0
        right = matrix @ without + sides * levels
        rates = np.zeros(joints)
        if slides.any():
            rates[slides] = np.linalg.solve(matrix[np.ix_(slides, slides)], right[slides])
        impulses = matrix @ (rates - without)
        held = np.all(np.abs(impulses[~slides]) <= levels[~slides] + 1e-12)
        if held and np.all(rates[slides] * sides[slides] <= 1e-12):
            return rates
    raise AssertionError("no combination fits")


def test_sticking_of_many_joints_is_exact(tmp_path: Path, fresh_seed: int):
    """One step from rest: rates without friction, those with it, and the exact solution of the complementarity."""
    rng = np.random.default_rng(fresh_seed)
    joints, step, stuck, slid = 4, 1e-3, 0, 0
    for k in range(2):
        arm = model_of(tmp_path / f"{k}.xml", mjcf(joints, rng))
        for _ in range(12):
            forces = rng.normal(size=joints) * 30.0
            levels = np.abs(rng.normal(size=joints)) * 20.0
            initial = np.concatenate([rng.uniform(-2.0, 2.0, joints), np.zeros(joints)])
            t, commands = np.array([0.0, step]), np.stack([forces, forces])
            free = replayed(arm, t, commands, initial)[1, joints:]
            frictions = {
                f"{joint}/coulomb": {"F_c": level} for joint, level in zip(arm.plant.joints, levels, strict=True)
            }
            rates = replayed(arm.with_effects(frictions), t, commands, initial)[1, joints:]
            matrix, _ = equations(arm, initial[:joints], np.zeros(joints))
            np.testing.assert_allclose(rates, exactly(matrix, free, step * levels), atol=1e-8)
            stuck, slid = stuck + int(np.sum(rates == 0.0)), slid + int(np.sum(rates != 0.0))
    assert min(stuck, slid) > 10


def test_a_payload_is_a_mass_in_the_file(tmp_path: Path):
    loaded = TWO.replace(
        '<body name="lower" pos="0 0 -0.3">',
        '<body name="lower" pos="0 0 -0.3"><body pos="0.05 0 -0.2"><inertial pos="0 0 0" mass="0.4" '
        'diaginertia="1e-12 1e-12 1e-12"/></body>',
    )
    with_mass = model_of(tmp_path / "loaded.xml", loaded)
    payload = {"link_lower/payload": {"mass": 0.4, "x": 0.05, "y": 0.0, "z": -0.2}}
    with_effect = model_of(tmp_path / "arm.xml", TWO, payload)
    q, rates = np.array([0.4, -0.7]), np.array([1.0, 2.0])
    for one, other in zip(equations(with_mass, q, rates), equations(with_effect, q, rates), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-10)


def test_a_tilted_base_turns_gravity(tmp_path: Path):
    """A base pitched by an angle: the robot hangs at that angle to its own vertical."""
    angle = 0.2
    arm = model_of(tmp_path / "arm.xml", TWO, {"environment/base_tilt": {"roll": 0.0, "pitch": angle}})
    _, bias = equations(arm, np.array([angle, 0.0]), np.zeros(2))
    np.testing.assert_allclose(bias, 0.0, atol=1e-12)


@pytest.mark.parametrize("rate", [None, 100.0])
def test_a_position_drive_holds_its_target(rate: float | None, tmp_path: Path):
    drives = {"shoulder": Drive("position", kp=60.0, kd=3.0, rate=rate), "elbow": Drive("position", kp=30.0, kd=0.3)}
    arm = model_of(tmp_path / "arm.xml", TWO.replace(' frictionloss="0.02"', ""), drives=drives)
    target = np.array([0.5, -0.4])
    t = np.linspace(0.0, 4.0, 401)
    end = replayed(arm, t, np.tile(target, (401, 1)), np.zeros(4))[-1]
    _, weight = equations(arm, end[:2], np.zeros(2))
    np.testing.assert_allclose(end[2:], 0.0, atol=1e-4)
    np.testing.assert_allclose(np.array([60.0, 30.0]) * (target - end[:2]), weight, atol=1e-3)
