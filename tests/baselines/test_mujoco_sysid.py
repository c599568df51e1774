"""MuJoCo's toolbox on carriages and pendulums driven by sums of sines; what needs MuJoCo is skipped without it."""

import sys
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from wipx.baselines.case import Problem
from wipx.baselines.mujoco_problem import Piece
from wipx.baselines.mujoco_sysid import MujocoSysid
from wipx.baselines.rigid_body import RigidBody
from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import PLANTS, plant_of
from wipx.core.recording import Recording
from wipx.identify.evaluation import Judge
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.mjcf import BUILT_IN, mjcf

Effects = Mapping[str, Mapping[str, float]]

SIMULATOR = AnalyticSimulator(threads=1)
BASELINE = MujocoSysid(seconds=1.0, windows=12)
BODY = {"body_mass": 2.6, "wheel_mass": 1.2, "com_height": 0.35, "body_inertia": 0.11}
LINKS = {
    f"link{i}_{n}": v for i in (1, 2) for n, v in (("mass", 0.5), ("length", 0.2), ("com", 0.15), ("inertia", 0.02))
}
ROBOTS = {
    "wip": {**BODY, "wheel_inertia": 0.0023, "wheel_radius": 0.0625, "input_gain": 1.3},
    "cartpole": BODY,
    "pendulum": {"body_mass": 0.8, "com_height": 0.45, "body_inertia": 0.037},
    "linear_axis": {"body_mass": 2.0, "wheel_mass": 0.5, "wheel_inertia": 0.001, "wheel_radius": 0.05},
    "double_pendulum": LINKS,
}
FRICTION: Effects = {"translation/viscous": {"sigma": 1.5}, "pitch/coulomb": {"F_c": 0.1}}
NOISE = {"linear_axis": 5e-5, "pendulum": 3e-4}  # [m], [rad]
DRIVE = {"linear_axis": 3.0, "pendulum": 0.4}  # [N], [N m]
RATE = 200.0  # [Hz]


@pytest.fixture(scope="module")
def mujoco() -> Any:
    return pytest.importorskip("mujoco", reason="needs the extra `mujoco`")


def robot(kind: str, effects: Effects) -> Model:
    plant = plant_of(kind)
    return Model(plant, plant.complete(ROBOTS[kind], "test"), effects)


def record(model: Model, rng: np.random.Generator, count: int = 2) -> tuple[Recording, ...]:
    """Eight seconds each; a pendulum hangs, so that no controller is needed."""
    kind, column = model.plant.kind, model.plant.coordinates[0]
    inputs = Inputs.regular(8.0, RATE, 1, count)
    t = inputs.t[:-1, 0]
    frequencies, phases = rng.uniform(0.2, 1.5, (4, count)), rng.uniform(0.0, 6.28, (4, count))
    command = DRIVE[kind] * np.sin(6.28 * t[:, None, None] * frequencies + phases).sum(axis=1)
    driven = Inputs(inputs.t, command[:, None], inputs.first, inputs.last)
    initial = np.stack([np.full((1, count), np.pi if kind == "pendulum" else 0.0), np.zeros((1, count))])
    q = SIMULATOR.replay(ModelBatch(model), driven, initial).coordinates[:-1, 0, 0]
    q = q + NOISE[kind] * rng.standard_normal(q.shape)
    return tuple(Recording(f"r{r}.csv", {"t": t, column: q[:, r], "u": command[:, r]}) for r in range(count))


@pytest.mark.parametrize("kind", sorted(PLANTS))
def test_the_mjcf_accelerates_as_the_equations_of_motion(mujoco: Any, kind: str, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    model = robot(kind, {})
    compiled = mujoco.MjModel.from_xml_string(mjcf(model, 1e-3))
    data, body, joints, now = mujoco.MjData(compiled), RigidBody(model), model.plant.joints, np.zeros(1)
    for _ in range(10):
        q, rates, command = rng.normal(size=compiled.nq), rng.normal(size=compiled.nq), rng.normal(size=compiled.nu)
        data.qpos[:], data.qvel[:], data.ctrl[:] = q, rates, command
        mujoco.mj_forward(compiled, data)
        forces = -body.forces(now, q[None], rates[None], np.zeros((1, len(joints))))[0]
        for site, u in zip(model.plant.actuated, command, strict=True):
            forces[joints.index(site)] += model.parameters["input_gain"] * u
        np.testing.assert_allclose(data.qacc, np.linalg.solve(body.mass_matrix(now, q[None])[0], forces), atol=1e-6)


def test_a_positive_pitch_falls_as_in_the_analytic_simulator(mujoco: Any):
    model = robot("wip", FRICTION)
    step = 2.5e-4  # MuJoCo's integrator is of first order
    inputs = Inputs.regular(0.5, 1.0 / step, 1)
    start = np.array([0.0, 0.1, 0.0, 0.2])
    run = SIMULATOR.replay(ModelBatch(model), inputs, start[:, None, None])
    compiled = mujoco.MjModel.from_xml_string(mjcf(model, step, built_in=BUILT_IN))
    data = mujoco.MjData(compiled)
    data.qpos[:], data.qvel[:] = start[:2], start[2:]
    mujoco.mj_step(compiled, data, len(inputs.t) - 1)
    shown = run.coordinates[-1, :, 0, 0]
    assert shown[1] > 0.3
    np.testing.assert_allclose(data.qpos, shown, rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        ("linear_axis", "translation/viscous.sigma", 1.5),
        ("linear_axis", "translation/coulomb.F_c", 0.8),
        ("pendulum", "pitch/coulomb.F_c", 0.15),
    ],
)
def test_the_toolbox_finds_friction_and_its_size(mujoco: Any, kind: str, name: str, value: float, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    effect, _, symbol = name.rpartition(".")
    true, nominal = robot(kind, {effect: {symbol: value}}), robot(kind, {})
    case = Problem(record(true, rng), nominal, {}, SIMULATOR)
    answer = BASELINE.answer(case, rng)
    assert answer.mismatch
    found = {f.name: f for f in answer.found}
    assert max(found, key=lambda n: found[n].weight) == effect
    assert found[effect].parameters[symbol] == pytest.approx(value, rel=0.1)  # small companions may take a share
    errors, _ = Judge(SIMULATOR, case.noise, 0.5).compare(nominal, answer.model, record(true, rng), held_out=True)
    column = nominal.plant.coordinates[0]
    assert errors.completed[column] < 0.3 * errors.nominal[column]


def test_the_toolbox_finds_nothing_where_nothing_is_missing(mujoco: Any, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    model = robot("linear_axis", {})
    answer = BASELINE.answer(Problem(record(model, rng), model, {}, SIMULATOR), rng)
    assert not answer.mismatch
    assert not answer.found


@pytest.mark.slow
def test_an_uncertain_mass_is_corrected_and_not_named(mujoco: Any, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    true = robot("linear_axis", {"translation/viscous": {"sigma": 1.5}})
    heavier = replace(true, parameters={**true.parameters, "body_mass": 2.2})
    given = Problem(record(heavier, rng), robot("linear_axis", {}), {"body_mass": 0.1}, SIMULATOR)
    answer = BASELINE.answer(given, rng)
    assert [f.name for f in answer.found] == ["translation/viscous"]
    assert answer.model.parameters["body_mass"] == pytest.approx(2.2, rel=0.03)


def test_late_commands_keep_their_impulse():
    edges = np.array([-0.02, -0.01, 0.0, 0.013, 0.02, 0.031])  # uneven rows
    commands = np.array([[1.0], [-2.0], [3.0], [0.5], [-1.0]])
    impulse = np.concatenate([np.zeros((1, 1)), np.cumsum(commands * np.diff(edges)[:, None], axis=0)])
    piece = Piece(edges, impulse, np.zeros_like(commands), np.array([0.0, 0.03]), np.zeros((2, 1)), 1.0)
    at_once = 2.5e-3 * piece.commands(0.0)[:12].sum()
    assert at_once == pytest.approx(3.0 * 0.013 + 0.5 * 0.007 - 1.0 * 0.01)
    late = 2.5e-3 * piece.commands(0.01)[:12].sum()
    assert late == pytest.approx(-2.0 * 0.01 + 3.0 * 0.013 + 0.5 * 0.007)


def test_without_mujoco_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    model = robot("linear_axis", {})
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match=r"needs MuJoCo's toolbox .*; pip install") as caught:
        BASELINE.answer(Problem(record(model, rng), model, {}, SIMULATOR), rng)
    assert "\n" not in str(caught.value)
