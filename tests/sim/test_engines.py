"""The contract of simulators, over every engine: same model, same inputs, same motion."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from sim.robots import LIVELY, move, reference, robot, sines

from wipx.control.lqr import Lqr
from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.parameters import Scales
from wipx.core.plant import PLANTS
from wipx.effects.catalogue import vocabulary
from wipx.effects.remainder import KNOTS
from wipx.sim import mujoco_batch
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.bullet import BulletSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.mujoco import MujocoSimulator
from wipx.sim.simulator import Simulator
from wipx.sim.stepped import SteppedSimulator

ANALYTIC = AnalyticSimulator(threads=1)
ENGINES = (BulletSimulator(), MujocoSimulator())
EVERY = pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)
AGREED = 1e-3  # [m, rad] within 1.2 s, which is asked of engines
LIMIT = 0.2  # of the largest command, so that it is met
ROUND_OFF = 1e-9  # all engines have the same integrator; least masses and the order of sums are left
PAPER = {"F_s": 0.15, "F_c": 0.12, "v_s": 0.2, "sigma": 0.02, "epsilon": 0.01, "alpha": 0.7}  # the paper's figure
PAPERS = {"translation/lagged_stribeck": PAPER, "pitch/lagged_stribeck": PAPER}
SIZES = Scales(duration=0.2, length=0.4)  # of the effects below; every other scale is one
BATCHED = {"wip": ("body_mass", "environment/rail_tilt.angle"), "double_pendulum": ("link1_com", "link2_mass")}


def uneven(rng: np.random.Generator, rows: int) -> np.ndarray:
    """Times of rows 3 to 12 ms apart, so that steps of several lengths occur."""
    return np.cumsum(np.concatenate([[0.0], rng.uniform(0.003, 0.012, rows)]))


def forceful(kind: str, name: str) -> Model:
    """A robot with an effect of noticeable size."""
    effect = vocabulary(PLANTS[kind])[name]
    usual = {p.name: p.grid[0] if p.grid else p.start for p in effect.parameters}
    usual |= {p.name: LIMIT for p in effect.parameters if p.dimension == "limit"}
    values = {p.name: usual[p.name] * SIZES.of(p.dimension) for p in effect.parameters}
    values = {p.name: values[p.name] or 0.3 * p.high * SIZES.of(p.dimension) for p in effect.parameters}
    special = {
        "remainder": {"signal": 3.0 if kind == "pendulum" else 2.0, "low": -1.0, "high": 1.0}
        | {"factor": 0.0}
        | {f"f{i}": 0.1 * (i - 3.0) for i in range(KNOTS)},
        "resonance": {"m": 0.3, "f": 4.0, "zeta": 0.05},
        "sticky_spot": {"F_c": 1.0, "lo": -0.05, "hi": 0.2},
        "saturation": {"F_max": 0.2},
        "sag": {"d": 0.05, "l": 0.2, "t_0": 0.1, "u_0": 0.3, "u_1": 2.0},
        "ripple": {"A": 0.3, "n": 8.0, "phase": 0.4},
        "payload": {"mass": 0.5, "height": 0.6},
        "payload_event": {"mass": 0.5, "height": 0.6, "t0": 0.0713},
    }
    return robot(kind, {name: special.get(name.partition("/")[2], values)})


@EVERY
@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=[pytest.mark.slow] if kind in ("cartpole", "double_pendulum") else [])
        for kind in sorted(PLANTS)
    ],
)
def test_engines_agree_over_the_papers_window(engine: SteppedSimulator, kind: str):
    t = np.linspace(0.0, 1.2, 121)
    plant = PLANTS[kind]
    commands = sines(t, 0.3 if kind == "double_pendulum" else 2.0, len(plant.commands))
    effects = {f"{site}/stribeck": {"F_c": 0.1, "F_s": 0.15, "v_s": 0.1} for site in plant.joints}
    for model in (robot(kind), robot(kind, effects)):
        ours, theirs = (move(model, LIVELY[kind], t, commands, sim) for sim in (ANALYTIC, engine))
        np.testing.assert_allclose(theirs.q, ours.q, rtol=0.0, atol=AGREED)
        np.testing.assert_allclose(theirs.q[-1], ours.q[-1], rtol=0.0, atol=1e-4)  # a tenth is used, at most


@EVERY
@pytest.mark.parametrize("kind", PLANTS)
def test_every_effect_works_in_every_engine(engine: SteppedSimulator, kind: str, fresh_seed: int):
    plant, t = PLANTS[kind], uneven(np.random.default_rng(fresh_seed), 20)
    commands = sines(t, 0.8, len(plant.commands))
    bare = move(robot(kind), LIVELY[kind], t, commands, ANALYTIC)
    for name in vocabulary(plant):
        ours, theirs = (move(forceful(kind, name), LIVELY[kind], t, commands, sim) for sim in (ANALYTIC, engine))
        np.testing.assert_allclose(theirs.q, ours.q, rtol=0.0, atol=ROUND_OFF, err_msg=name)
        np.testing.assert_allclose(theirs.v, ours.v, rtol=0.0, atol=100.0 * ROUND_OFF, err_msg=name)
        assert np.max(np.abs(ours.q - bare.q)) > 1e3 * ROUND_OFF, name


@EVERY
@pytest.mark.parametrize("law", ["dead_zone", "saturation", "speed_limit", "sag"])
def test_drives_answer_to_commands_that_scatter_in_every_engine(engine: SteppedSimulator, law: str, fresh_seed: int):
    t = uneven(np.random.default_rng(fresh_seed), 20)
    means = Inputs.of([t], [np.vstack([sines(t, 0.8), [[0.0]]])], [0], (3,))
    scattered = replace(means, spread=np.array([0.5]))
    start = np.array(LIVELY["wip"])[:, None, None]
    model = ModelBatch(forceful("wip", f"actuator/{law}"))
    ours, theirs = (sim.replay(model, scattered, start).coordinates for sim in (ANALYTIC, engine))
    np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=ROUND_OFF)
    assert np.max(np.abs(ours - ANALYTIC.replay(model, means, start).coordinates)) > 1e3 * ROUND_OFF


@EVERY
@pytest.mark.parametrize("kind", ["wip", "double_pendulum"])
def test_halving_the_step_quarters_the_error(engine: SteppedSimulator, kind: str):
    t = np.linspace(0.0, 0.6, 13)
    # A known damping keeps MuJoCo from its own batches, whose order is the fourth.
    sigma = {site: 0.05 for site in PLANTS[kind].joints}
    model = robot(kind, {f"{site}/viscous": {"sigma": s} for site, s in sigma.items()})
    exact = reference(model, LIVELY[kind], t, lambda row, time, q, v: -0.05 * v)
    errors = [
        np.max(np.abs(move(model, LIVELY[kind], t, simulator=replace(engine, step=h)).q - exact.q))
        for h in (4e-3, 2e-3, 1e-3)
    ]
    assert errors[-1] < 0.1 * AGREED
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.25)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.25)


@EVERY
def test_the_closed_loop_with_the_papers_friction_agrees(engine: SteppedSimulator, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    inputs = Inputs.regular(1.2, 650.0, 1, windows=2)
    batch = ModelBatch(robot("wip", PAPERS), ("body_mass",), rng.uniform(2.4, 2.8, (2, 1)))
    initial = np.zeros((4, 2, 2))
    initial[1] = rng.uniform(-0.08, 0.08, (2, 2))
    references = np.zeros((len(inputs.t) - 1, 4, 2))
    noise = 1e-4 * rng.normal(size=(len(inputs.t) - 1, 4, 2, 2))
    feedback = replace(Lqr().feedback(robot("wip")), rate_filter=0.005)
    ours, theirs = (sim.close_loop(batch, inputs, initial, feedback, references, noise) for sim in (ANALYTIC, engine))
    np.testing.assert_allclose(theirs.coordinates, ours.coordinates, rtol=0.0, atol=AGREED)
    np.testing.assert_allclose(theirs.commands, ours.commands, rtol=0.0, atol=0.1)


@EVERY
def test_a_python_controller_drives_every_engine(engine: SteppedSimulator, fresh_seed: int):
    t = uneven(np.random.default_rng(fresh_seed), 60)
    inputs = Inputs.of([t], [np.zeros((len(t), 1))], [0])
    late = {"actuator/delay": {"tau": 0.006}, "sensor_theta/delay": {"tau": 0.004}, "actuator/lag": {"tau": 0.003}}
    gains = Lqr().feedback(robot("wip")).gains
    ours, theirs = (
        sim.drive(robot("wip", late), inputs, np.array(LIVELY["wip"]), lambda _, measured: -gains @ measured)
        for sim in (ANALYTIC, engine)
    )
    np.testing.assert_allclose(theirs.coordinates, ours.coordinates, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(theirs.commands, ours.commands, rtol=0.0, atol=1e-6)


@EVERY
@pytest.mark.parametrize("kind", sorted(BATCHED))
def test_windows_and_models_of_a_batch_stand_where_they_do_in_the_analytic_one(
    engine: SteppedSimulator, kind: str, fresh_seed: int
):
    rng = np.random.default_rng(fresh_seed)
    model = robot(kind, {"environment/rail_tilt": {"angle": 0.0}} if kind == "wip" else {})
    nominal = np.array([model.value(name) for name in BATCHED[kind]])
    values = nominal * rng.uniform(0.9, 1.0, (2, 2)) + np.array([0.0, 0.02])
    times = [uneven(rng, int(rng.integers(3, 6))) for _ in range(66)]  # more than fit side by side
    commands = [rng.normal(size=(len(t), len(model.plant.commands))) for t in times]
    inputs = Inputs.of(times, commands, rng.integers(0, 3, 66).tolist(), (2,) * 66)
    initial = np.array(LIVELY[kind])[:, None, None] + 0.1 * rng.normal(size=(4, 2, 66))
    batch = ModelBatch(model, BATCHED[kind], values)
    ours, theirs = (sim.replay(batch, inputs, initial) for sim in (ANALYTIC, engine))
    np.testing.assert_allclose(theirs.coordinates, ours.coordinates, rtol=0.0, atol=ROUND_OFF)
    assert theirs.commands.shape == ours.commands.shape


@pytest.mark.parametrize("kind", sorted(PLANTS))
def test_mujocos_own_batches_give_what_its_loop_gives(kind: str, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    sensor = f"sensor_{PLANTS[kind].coordinates[-1]}/bias" if kind != "linear_axis" else "sensor_x/scale"
    model = robot(kind, {sensor: {"e" if kind == "linear_axis" else "b": 0.01}, "actuator/gain": {"k": 0.9}})
    push = 0.1 if kind == "double_pendulum" else 1.0  # its links are light
    inputs = Inputs.regular(0.4, 100.0, len(model.plant.commands), windows=3)
    driven = replace(inputs, commands=push * rng.normal(size=inputs.commands.shape), first=np.array([0, 2, 0]))
    initial = np.array(LIVELY[kind])[:, None, None] + 0.1 * rng.normal(size=(len(LIVELY[kind]), 2, 3))
    batch = ModelBatch(model, ("gravity",), np.array([[9.81], [9.7]]))
    assert mujoco_batch.serves(batch, driven, initial, 1e-3)
    batched, loop = MujocoSimulator().replay(batch, driven, initial), ANALYTIC.replay(batch, driven, initial)
    # Four times what sixty seeds gave. The loop's integrator in the analytic simulator is the same.
    np.testing.assert_allclose(batched.coordinates, loop.coordinates, rtol=0.0, atol=2e-4)
    fine = replace(ANALYTIC, step=1.25e-4).replay(batch, driven, initial)
    np.testing.assert_allclose(batched.coordinates, fine.coordinates, rtol=0.0, atol=5e-6)


def test_mujocos_own_batches_serve_rigid_bodies_on_even_rows_only():
    inputs = Inputs.regular(0.1, 100.0, 1)
    start = np.array(LIVELY["wip"])[:, None, None]
    jitter = replace(inputs, t=inputs.t + 1e-4 * np.sin(np.arange(len(inputs.t)))[:, None])
    damped = robot("wip", {"pitch/viscous": {"sigma": 0.1}})
    assert mujoco_batch.serves(ModelBatch(robot("wip")), inputs, start, 1e-3)
    assert not mujoco_batch.serves(ModelBatch(damped), inputs, start, 1e-3)
    assert not mujoco_batch.serves(ModelBatch(robot("wip")), jitter, start, 1e-3)
    assert not mujoco_batch.serves(ModelBatch(robot("wip")), inputs, start * np.nan, 1e-3)


@EVERY
def test_a_rollout_that_is_lost_does_not_harm_the_others(engine: SteppedSimulator):
    inputs = Inputs.regular(0.05, 100.0, 1, windows=2)
    initial = np.array(LIVELY["wip"])[:, None, None] * np.ones((1, 1, 2))
    initial[3, 0, 0] = np.nan
    model = ModelBatch(robot("wip", {"pitch/viscous": {"sigma": 0.1}}))
    run, alone = engine.replay(model, inputs, initial), ANALYTIC.replay(model, inputs, initial)
    assert np.isnan(run.coordinates[-1, :, 0, 0]).all()
    np.testing.assert_allclose(run.coordinates[:, :, 0, 1], alone.coordinates[:, :, 0, 1], rtol=0.0, atol=ROUND_OFF)


@EVERY
def test_friction_that_builds_up_does_so_in_every_engine(engine: SteppedSimulator):
    model = robot("wip", {"translation/coulomb": {"F_c": 2.0}})
    t = np.linspace(0.0, 0.2, 21)
    smoothed: list[Simulator] = [sim.smoothed((0.05, 0.5)) for sim in (ANALYTIC, engine)]
    ours, theirs = (move(model, LIVELY["wip"], t, simulator=sim) for sim in smoothed)
    np.testing.assert_allclose(theirs.q, ours.q, rtol=0.0, atol=ROUND_OFF)


@EVERY
def test_what_is_no_rigid_body_is_refused_with_a_remedy(engine: SteppedSimulator):
    light = robot("double_pendulum", changes={"link2_inertia": 0.01})
    with pytest.raises(InputError, match=rf"sim={engine.name} cannot .*link2_inertia.*sim=analytic"):
        move(light, LIVELY["double_pendulum"], np.linspace(0.0, 0.1, 11), simulator=engine)
    less = robot("wip", {"geometry/payload": {"mass": -0.2, "height": 0.3}})
    with pytest.raises(InputError, match=rf"sim={engine.name} cannot do geometry/payload"):
        move(less, LIVELY["wip"], np.linspace(0.0, 0.1, 11), simulator=engine)


@EVERY
def test_a_missing_package_is_named_with_its_remedy(engine: SteppedSimulator, monkeypatch: pytest.MonkeyPatch):
    def missing(name: str):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)

    monkeypatch.setattr(importlib, "import_module", missing)
    with pytest.raises(InputError, match=rf"sim={engine.name} needs .*pip install"):
        engine.open()


@EVERY
def test_steps_must_be_positive(engine: SteppedSimulator):
    with pytest.raises(InputError, match="step is 0, expected a positive number"):
        replace(engine, step=0.0)
