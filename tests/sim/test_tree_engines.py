"""Robots from model files in every engine: same model, same inputs, same motion as in the compiled kernel."""

from pathlib import Path

import numpy as np
import pytest
from sim.random_trees import mjcf

from wipx.core.drive import Drive
from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import robot_plant
from wipx.recordings.robot_model import read_tree
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.bullet import BulletSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.mujoco import MujocoSimulator
from wipx.sim.simulator import Simulator
from wipx.sim.stepped import SteppedSimulator

ENGINES = (BulletSimulator(), MujocoSimulator())
EVERY = pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)
ROUND_OFF = 1e-9  # [rad, m]; all engines have the same integrator
JOINTS = 4
DRIVES = {
    "j0": Drive("torque", gain=2.0),
    "j1": Drive("position", kp=8.0, kd=0.4, limit=3.0, rate=100.0),
    "j2": Drive("position", kp=5.0, kd=0.2),
    "j3": Drive("none"),
}
FRICTION = {
    "j0/stribeck": {"F_c": 0.2, "F_s": 0.3, "v_s": 0.1},
    "j1/viscous": {"sigma": 0.05},
    "j2/presliding": {"F_c": 0.1, "stiffness": 30.0, "damping": 0.1},
    "j3/coulomb": {"F_c": 0.3},
}
TRANSMISSION = {
    "actuator/delay": {"tau": 0.004},
    "actuator_j0/gain": {"k": 0.8},
    "actuator_j0/dead_zone": {"band": 0.1},
    "actuator_j0/lag": {"tau": 0.01},
    "actuator_j0/elasticity": {"drive_inertia": 0.05, "stiffness": 20.0, "damping": 0.1},
    "actuator_j1/saturation": {"F_max": 2.0},
    "actuator_j1/ripple": {"A": 0.2, "n": 6.0, "phase": 0.3},
    "actuator_j1/kp": {"factor": 0.8},
    "actuator_j2/kd": {"factor": 1.3},
    "actuator_j2/backlash": {"gap": 0.02},
    "j1/rotor_inertia": {"J": 0.02},
    "j2/spring": {"k": 1.0, "q0": 0.2},
}
BODIES = {
    "link_b1/payload": {"mass": 0.4, "x": 0.05, "y": -0.1, "z": 0.1},
    "link_b2/com_offset": {"x": 0.02, "y": 0.01, "z": -0.03},
    "link_b3/inertia": {"scale": 1.3},
    "environment/base_tilt": {"roll": 0.1, "pitch": -0.05},
}
SENSORS = {"sensor_j0/delay": {"tau": 0.006}, "sensor_j1/bias": {"b": 0.02}, "sensor_j2/scale": {"e": 0.03}}
EFFECTS = {
    "rigid body": {},
    "friction": FRICTION,
    "transmission": TRANSMISSION,
    "bodies": BODIES,
    "everything": {**FRICTION, **TRANSMISSION, **BODIES, **SENSORS},
}
PLANAR = """<mujoco><worldbody><body name="base" pos="0 0 0.3">
<joint name="way" type="slide" axis="1 0 0" damping="0.4"/>
<joint name="pitch" axis="0 1 0" pos="0 0 -0.1"/><inertial pos="0 0 0.1" mass="2" diaginertia="0.1 0.12 0.05"/>
<body name="arm" pos="0.1 0 0.3" euler="0 30 0"><joint name="arm" axis="0 1 0" frictionloss="0.05"/>
<inertial pos="0 0 -0.2" mass="0.4" diaginertia="0.01 0.01 0.001"/></body></body></worldbody></mujoco>"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory):
    """A random tree; links of a branch come after those of another one."""
    path = tmp_path_factory.mktemp("tree") / "tree.xml"
    path.write_text(mjcf(JOINTS, np.random.default_rng(7), friction=0.2), encoding="utf-8")
    return read_tree(path)


def moved(model: Model, simulator: Simulator, rng: np.random.Generator) -> np.ndarray:
    """Coordinates and rates on uneven rows, shape (rows, 2 joints)."""
    t = np.cumsum(np.concatenate([[0.0], rng.uniform(0.003, 0.012, 25)]))
    inputs = Inputs.of([t], [rng.normal(size=(26, len(model.plant.commands)))], [0])
    start = 0.3 * rng.normal(size=2 * len(model.plant.joints))
    run = simulator.replay(ModelBatch(model), inputs, start[:, None, None])
    return np.concatenate([run.coordinates[:, :, 0, 0], run.rates[:, :, 0, 0]], axis=1)


@EVERY
@pytest.mark.parametrize("effects", EFFECTS.values(), ids=list(EFFECTS))
def test_a_tree_moves_in_an_engine_as_in_the_kernel(engine: SteppedSimulator, effects: dict, tree, fresh_seed: int):
    plant = robot_plant(tree, DRIVES)
    model = Model(plant, plant.complete({}, "robot.yaml"), effects)
    ours, theirs = (moved(model, sim, np.random.default_rng(fresh_seed)) for sim in (AnalyticSimulator(), engine))
    np.testing.assert_allclose(theirs[:, :JOINTS], ours[:, :JOINTS], rtol=0.0, atol=ROUND_OFF)
    np.testing.assert_allclose(theirs[:, JOINTS:], ours[:, JOINTS:], rtol=0.0, atol=100.0 * ROUND_OFF)


@EVERY
def test_a_bare_tree_falls_in_an_engine_as_in_the_kernel(engine: SteppedSimulator, tmp_path: Path):
    """Without friction MuJoCo's own batches serve, whose steps are others; two joints of one body carry it once."""
    path = tmp_path / "planar.xml"
    path.write_text(PLANAR.replace(' damping="0.4"', "").replace(' frictionloss="0.05"', ""), encoding="utf-8")
    plant = robot_plant(read_tree(path), {})
    model = Model(plant, plant.complete({}, "robot.yaml"), {})
    inputs = Inputs.regular(0.3, 100.0, 3)
    start = np.array([0.0, 0.2, -0.5, 0.3, 0.0, 1.0])[:, None, None]
    ours, theirs = (s.replay(ModelBatch(model), inputs, start) for s in (AnalyticSimulator(2.5e-4), engine))
    np.testing.assert_allclose(theirs.coordinates, ours.coordinates, rtol=0.0, atol=1e-5)


def test_two_joints_of_one_body_move_its_mass_once(tmp_path: Path):
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "planar.xml"
    path.write_text(PLANAR, encoding="utf-8")
    plant = robot_plant(read_tree(path), {})
    assert [name for name in plant.parameters if name.endswith(".mass")] == ["base.mass", "arm.mass"]
    assert [site for site in plant.sites if site.startswith("link_")] == ["link_base", "link_arm"]
    model = Model(plant, plant.complete({}, "robot.yaml"), {})
    engine = mujoco.MjModel.from_xml_string(PLANAR)
    engine.opt.integrator, engine.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 1e-4
    engine.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS
    without = model.with_values({"arm.friction": 0.0})
    data = mujoco.MjData(engine)
    start = np.array([0.0, 0.2, -0.5, 0.3, 0.0, 1.0])
    data.qpos[:], data.qvel[:] = start[:3], start[3:]
    mujoco.mj_step(engine, data, 3000)
    run = AnalyticSimulator(1e-4).replay(ModelBatch(without), Inputs.regular(0.3, 100.0, 3), start[:, None, None])
    np.testing.assert_allclose(run.coordinates[-1, :, 0, 0], data.qpos, rtol=0.0, atol=1e-6)


@EVERY
def test_a_batch_of_trees_stands_where_it_does_in_the_kernel(engine: SteppedSimulator, tree, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    plant = robot_plant(tree, DRIVES)
    model = Model(plant, plant.complete({}, "robot.yaml"), FRICTION)
    nominal = np.array([model.value("b1.mass"), model.value("j1.kp")])
    batch = ModelBatch(model, ("b1.mass", "j1.kp"), nominal * rng.uniform(0.9, 1.1, (2, 2)))
    inputs = Inputs.regular(0.05, 100.0, 3, windows=3)
    start = 0.3 * rng.normal(size=(2 * JOINTS, 2, 3))
    ours, theirs = (sim.replay(batch, inputs, start) for sim in (AnalyticSimulator(), engine))
    np.testing.assert_allclose(theirs.coordinates, ours.coordinates, rtol=0.0, atol=ROUND_OFF)


@EVERY
def test_a_link_that_is_no_rigid_body_is_refused_with_a_remedy(engine: SteppedSimulator, tree):
    plant = robot_plant(tree, DRIVES)
    lighter = {"link_b1/payload": {"mass": -5.0, "x": 0.5, "y": 0.0, "z": 0.0}}
    model = Model(plant, plant.complete({}, "robot.yaml"), lighter)
    with pytest.raises(InputError, match=rf"sim={engine.name} cannot do link b1 .*sim=analytic"):
        moved(model, engine, np.random.default_rng(0))
