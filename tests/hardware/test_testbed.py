"""The emulated testbed: recordings as contract section 1 has them, of a robot that nobody knows entirely."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import yaml
from sim.robots import PARAMETERS

from wipx.app import configuration_folder
from wipx.config import build
from wipx.control import motion
from wipx.control.ekf import Ekf
from wipx.control.lqr import Lqr
from wipx.control.regulator import Regulator
from wipx.core.errors import InputError
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.effects.catalogue import check_together, effect_of
from wipx.hardware.excitations import excitation
from wipx.hardware.target import Trial
from wipx.hardware.testbed import EmulatedTestbed
from wipx.sim.cache import AHEAD
from wipx.sim.simulator import StateFeedback

COLUMNS = ("t", "x", "theta", "x_dot", "theta_dot", "u", "u_measured")
RADIUS = 0.0625
PITCHES = (-0.03, -0.06, -0.09, -0.12, -0.16)


def shipped(option: str = "emulated") -> EmulatedTestbed:
    """The testbed of a configuration file, on the engine that is the fastest for one robot."""
    node = yaml.safe_load((configuration_folder() / "target" / f"{option}.yaml").read_text())
    del node["defaults"]
    return build({**node, "engine": engine_node("analytic")}, "target")


def engine_node(option: str) -> dict[str, object]:
    """An option of `sim`, with the step of the testbed."""
    return {**yaml.safe_load((configuration_folder() / "sim" / f"{option}.yaml").read_text()), "step": 1e-4}


BED = shipped()
LQR = Lqr()


def record(bed: EmulatedTestbed, *trials: Trial, seed: int = 1, rate: float = 650.0) -> tuple[Recording, ...]:
    """Trials under the regulator of the unloaded robot."""
    loop = replace(LQR, rate=rate).loop(bed.nominal())
    return tuple(bed.run(trials, loop, np.random.default_rng(seed)))


def still(bed: EmulatedTestbed, rate: float = 650.0) -> Regulator:
    """A loop that commands nothing."""
    model = bed.nominal()
    return Regulator(Ekf(model), StateFeedback(np.zeros((1, 4))), rate)


class Pushes:
    """A loop that pushes with a square wave, whatever it is shown."""

    rate, state = 650.0, np.zeros(4)

    def reset(self, t: float, measured: np.ndarray) -> None:
        """Nothing to forget."""

    def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """10 N to either side, 20 ms each; to +x first."""
        return np.array([10.0 if (t / 0.02) % 2.0 < 1.0 else -10.0])


@pytest.fixture(scope="module")
def heavy() -> Recording:
    return record(BED, Trial("b3_1.csv", 1.25, "b3"))[0]


@pytest.mark.slow
def test_recordings_have_the_columns_of_the_contract(heavy: Recording):
    assert heavy.name == "b3_1.csv"
    assert tuple(heavy.columns) == COLUMNS
    assert heavy.t[0] == 0.0
    steps = np.diff(heavy.t)
    assert np.all(steps > 0.0)
    assert np.std(steps) > 2e-5  # ticks are late by chance
    assert 600.0 < len(steps) / heavy.duration < 700.0
    assert all(np.isfinite(values).all() for values in heavy.columns.values())


def test_a_trial_that_follows_a_reference_records_it():
    bed = replace(BED, release_error=0.0)
    reference = excitation("tracking", plant_of("wip"), np.random.default_rng(0))
    (run,) = record(bed, Trial("r.csv", 0.5, reference=reference))
    assert set(run.columns) == {*COLUMNS, "x_ref", "theta_ref", "x_dot_ref"}
    np.testing.assert_allclose(np.gradient(run["x_ref"], run.t)[1:-1], run["x_dot_ref"][1:-1], atol=2e-3)


def test_the_controllers_filter_is_compiled_ahead_for_its_arrays():
    record(BED, Trial("r.csv", 0.05))
    for kernel, types in AHEAD:
        if kernel in (motion.propagate, motion.correct):
            assert kernel.signatures == [types]


@pytest.mark.parametrize(
    ("column", "end", "bits"),
    [("x", 12.5 * RADIUS, 16), ("x_dot", 76.0 * RADIUS, 12), ("u_measured", 12.0 / RADIUS, 12)],
)
def test_what_the_motor_reports_comes_in_steps_of_its_frames(heavy: Recording, column: str, end: float, bits: int):
    counts = (heavy[column] + end) * (2**bits - 1) / (2.0 * end)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    assert len(np.unique(np.round(counts))) > 10


def test_the_position_does_not_wrap_at_the_end_of_the_motors_range():
    (run,) = record(BED, Trial("far", 1.25, "b5"))
    assert np.max(np.abs(run["x"])) > 12.5 * RADIUS
    assert np.max(np.abs(np.diff(run["x"]))) < 0.01


def test_commands_act_when_they_arrive_at_the_drive():
    bed = replace(BED, release_error=0.0)
    (run,) = bed.run([Trial("pushed", 0.5)], Pushes(), np.random.default_rng(2))
    latency = bed.hidden().latency
    # The impulse that the drive reports is that of the commands, late by the latency: 0.5 ms of jitter over 25 turns.
    times = np.append(run.t, run.t[-1] + 1.0 / 650.0)
    asked, given = (np.append(0.0, np.cumsum(run[name] * np.diff(times))) for name in ("u", "u_measured"))
    fine = np.linspace(0.01, 0.5, 5000)
    lags = np.arange(0.0, 6e-3, 1e-4)
    errors = [np.std(np.interp(fine - lag, times, asked) - np.interp(fine, times, given)) for lag in lags]
    assert lags[int(np.argmin(errors))] == pytest.approx(latency, abs=4e-4)
    # The wheel follows the force, not the command.
    gained = np.diff(run["x_dot"])
    of_force, of_command = (np.corrcoef(gained, run[name][:-1])[0, 1] for name in ("u_measured", "u"))
    assert of_force > of_command + 0.03


@pytest.mark.parametrize("name", sorted(BED.weights))
def test_a_load_moves_the_equilibrium_to_where_the_paper_has_it(name: str):
    pitch = BED.loads[name].equilibrium(BED.nominal())
    assert min(abs(pitch - known) for known in PITCHES) < 5e-4
    # A controller that knows the loaded robot and its equilibrium holds it there, however rough the robot is.
    loaded = BED.loads[name].on(BED.nominal())
    loop = LQR.loop(loaded)
    reference = np.array([0.0, pitch, 0.0, 0.0])
    trial = Trial("held", 1.5, name, pitch, lambda t: reference)
    (run,) = BED.run([trial], loop, np.random.default_rng(5))
    # Within the IMU's bias, the friction of the pitch joint (0.1 N m over 20 N m/rad) and the hand's 2 mrad.
    assert np.mean(run["theta"]) == pytest.approx(pitch, abs=0.01)
    assert run.duration > 1.49


def test_eight_classes_of_two_weights_cover_the_five_pitches():
    loads = BED.loads
    assert len(loads) == 8
    assert {load.mass for load in loads.values()} == {0.8, 1.6}
    assert len({(load.height, load.side) for load in loads.values()}) == 8
    assert {round(load.equilibrium(BED.nominal()), 3) for load in loads.values()} == set(PITCHES)


@pytest.mark.slow
def test_forty_trials_of_80_samples_are_whole():
    # The paper's window is 1.2 s; under its LQR no load reaches the end of the rail before.
    runs = record(BED, *(Trial(name, 1.25, name) for name in BED.loads))
    for run, after in pairwise(runs):
        assert run.duration > 1.24
        assert np.max(np.abs(run["theta"] - after["theta"])) > 1e-3


def test_a_heavy_load_drifts_to_the_end_of_the_rail_and_is_stopped():
    (run,) = record(BED, Trial("drifts", 10.0, "b5"))
    assert run.duration < 3.0
    assert -BED.rail - 0.01 < run["x"][-1] < -BED.rail + 0.05
    assert len(run["u_measured"]) == len(run)


def test_a_robot_that_falls_is_stopped_too():
    (run,) = BED.run([Trial("falls", 10.0, pitch=0.2)], still(BED), np.random.default_rng(0))
    assert run.duration < 2.0
    assert 0.9 < run["theta"][-1] < 1.01


def test_the_rail_may_be_shorter():
    short, long = (record(replace(BED, rail=rail), Trial("r", 1.25, "b4"))[0] for rail in (0.5, 1.8))
    assert short.duration < long.duration
    np.testing.assert_array_equal(short["theta"], long["theta"][: len(short)])


def test_the_same_seed_gives_the_same_bytes_and_another_seed_other_trials(heavy: Recording, fresh_seed: int):
    (again,), (other,) = (record(BED, Trial("b3_1.csv", 1.25, "b3"), seed=s) for s in (1, fresh_seed + 2))
    for column in COLUMNS:
        assert heavy[column].tobytes() == again[column].tobytes()
    assert other["theta"][0] != heavy["theta"][0]
    assert 1e-4 < np.max(np.abs(np.interp(heavy.t, other.t, other["x"]) - heavy["x"])) < 0.1


def test_hidden_physics_is_the_seeds_and_the_owner_knows_nothing_of_it(fresh_seed: int):
    first, again, other = BED.hidden(), BED.hidden(), replace(BED, seed=fresh_seed + 1).hidden()
    assert first == again
    assert other.model != first.model
    assert other.latency != first.latency
    nominal = BED.nominal()
    assert not nominal.effects
    for hidden in (first, other):
        assert hidden.model.parameters == nominal.parameters
        names = tuple(hidden.model.effects)
        check_together(names, nominal.plant)
        for name, values in hidden.model.effects.items():
            assert set(values) == set(effect_of(name, nominal.plant).neutral)
        weight = 6.2 * 9.81
        assert 0.02 * weight < hidden.model.value("translation/lugre.F_c") < 0.05 * weight
        assert 0.01 < hidden.model.value("pitch/lugre.F_s") < 0.2
        assert 1e-3 < hidden.latency < 4e-3
        assert yaml.safe_load(yaml.safe_dump(hidden.beside_the_model())) == hidden.beside_the_model()


def test_the_papers_physics_is_its_joint_model_and_white_noise():
    bed = shipped("emulated_paper")
    hidden = bed.hidden()
    assert set(hidden.model.effects) == {"translation/lagged_stribeck", "pitch/lagged_stribeck"}
    assert (hidden.latency, hidden.angle_bias, hidden.angle_wander, hidden.in_steps) == (0.0, 0.0, 0.0, False)
    (run,) = record(bed, Trial("r", 0.5, "a3"))
    np.testing.assert_allclose(run["u_measured"], run["u"], atol=1e-9)
    level = run["theta"][:40] - np.polynomial.Polynomial.fit(run.t[:40], run["theta"][:40], 3)(run.t[:40])
    assert np.std(level) == pytest.approx(hidden.angle_noise, rel=0.5)
    assert abs(np.corrcoef(level[1:], level[:-1])[0, 1]) < 0.5


def test_the_imu_errs_by_a_bias_and_wanders():
    # A robot without load stands where its pitch friction holds it; the IMU shows another angle.
    bed = replace(BED, release_error=0.0)
    (run,) = record(bed, Trial("stands", 2.0))
    error = run["theta"]
    assert np.mean(error) == pytest.approx(bed.hidden().angle_bias, abs=1.5e-3)
    centred = error - np.mean(error)
    assert np.mean(centred[1:] * centred[:-1]) > 0.5 * np.var(centred)


@pytest.mark.parametrize("kind", ["cartpole", "linear_axis", "pendulum"])
def test_other_plants_stand_on_the_testbed_too(kind: str):
    wheel = {} if kind == "pendulum" else {"wheel_radius": RADIUS}
    bed = EmulatedTestbed(kind, {**PARAMETERS[kind], **wheel}, engine=BED.engine)
    (run,) = record(
        bed, Trial("r.csv", 0.3, reference=excitation("multisine", plant_of(kind), np.random.default_rng(0)))
    )
    plant = plant_of(kind)
    assert {"t", "u", *plant.coordinates, *plant.rates} <= set(run.columns)
    assert run.duration > 0.29


@pytest.mark.parametrize("engine", [pytest.param("mujoco", marks=pytest.mark.slow), "pybullet"])
def test_other_engines_move_the_same_robot(engine: str, heavy: Recording):
    pytest.importorskip(engine)
    (run,) = record(replace(BED, engine=build(engine_node(engine), "sim")), Trial("b3_1.csv", 1.25, "b3"))
    for column, close in (("x", 2e-4), ("theta", 2e-4)):  # errors of the integrators, grown by the falling body
        np.testing.assert_allclose(run[column], heavy[column], rtol=0.0, atol=close)


def test_the_testbed_that_ships_is_another_engine_than_the_fitted_model():
    folder = configuration_folder()
    for option in ("emulated", "emulated_paper"):
        node = yaml.safe_load((folder / "target" / f"{option}.yaml").read_text())
        assert node["defaults"][0] == {"/sim@engine": "mujoco"}
        assert node["engine"]["step"] <= 1e-4


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"parameters": {**BED.parameters, "mass": 1.0}}, r"target\.parameters: unknown parameter"),
        ({"kind": "wipp"}, r"target\.kind: unknown plant 'wipp'; did you mean wip\?"),
        ({"weights": {"a": {"mass": 1.0, "hight": 0.1, "side": 0.0}}}, r"target\.weights\.a: unknown key 'hight'"),
        ({"rail": 0.0}, r"rail is 0, expected a positive number"),
        ({"release_error": -1.0}, r"target\.release_error is -1"),
        ({"seed": -1}, r"target\.seed is -1"),
    ],
)
def test_bad_settings_are_refused_in_one_line(changes: dict, message: str):
    with pytest.raises(InputError, match=message) as caught:
        record(replace(BED, **changes), Trial("r.csv", 0.1))
    assert "\n" not in str(caught.value)


def test_an_unknown_load_is_refused_before_anything_moves():
    with pytest.raises(InputError, match=r"target=emulated: r\.csv: unknown load 'c1'"):
        record(BED, Trial("q.csv", 1.0), Trial("r.csv", 1.0, "c1"))


def test_a_robot_that_is_released_lying_is_refused():
    with pytest.raises(InputError, match="fallen when it is released"):
        record(BED, Trial("r.csv", 1.0, pitch=1.2))
