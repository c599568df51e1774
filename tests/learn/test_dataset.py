"""Training sets: loads, labels and windows obey the physics that they come from."""

from dataclasses import replace

import numpy as np
import pytest

from wipx.control.lqr import Lqr
from wipx.core.errors import InputError
from wipx.core.load import BALANCE, Load
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.learn.balance import balance_of
from wipx.learn.dataset import ObservationNoise, Watch, check_labels, generate
from wipx.learn.loads import LoadRanges, carrying, equilibria, some_of
from wipx.learn.training_set import PARTS, TrainingSet
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

BODY = {"body_mass": 5.0, "wheel_mass": 1.2, "com_height": 0.35, "body_inertia": 0.15}
WHEEL = {"wheel_inertia": 0.0023, "wheel_radius": 0.0625}
WIP = Model(plant_of("wip"), plant_of("wip").complete({**BODY, **WHEEL}, "test"), {})
COULOMB = {"translation/coulomb": {"F_c": 2.0}, "pitch/coulomb": {"F_c": 0.1}}
REGULATOR = (Lqr().feedback(WIP), 650.0)
SIMULATOR = AnalyticSimulator(step=2e-3, threads=1)  # one step per row of the regulator
QUIET = ObservationNoise(amplitude=0.0)
PITCH_RESOLUTION = 2e-7  # rad; of the bisection


def made(model: Model = WIP, watch: Watch | None = None, seed: int = 0) -> TrainingSet:
    watch = watch or Watch(samples=200, noise=QUIET)
    return generate(ModelBatch(model), REGULATOR, SIMULATOR, watch, np.random.default_rng(seed))


def under(load: Load, model: Model = WIP) -> np.ndarray:
    """Window of a robot with one load that starts upright, shape (L, 2) [m, rad]."""
    ranges = LoadRanges(*((value, value) for value in (load.mass, load.height, load.side)))
    return made(model, Watch(ranges, samples=10, lean=0.0, noise=QUIET)).windows[0]


@pytest.fixture(scope="module")
def training() -> TrainingSet:
    return made()


@pytest.mark.parametrize("lean", [0.0, 0.05])
def test_many_loads_change_a_body_as_one_does(lean: float):
    leaning = WIP.with_effects({BALANCE: {"theta_eq": lean}}) if lean else WIP
    loads = LoadRanges().draw(leaning, 40, np.random.default_rng(1))
    heavier = ModelBatch(leaning, ("body_mass", "wheel_mass"), np.array([[5.0, 1.2], [6.0, 1.0]]))
    robots = carrying(heavier, loads)
    for i, (mass, height, side) in enumerate(loads.tolist()):
        body = leaning.with_values({"body_mass": 5.0 + i % 2, "wheel_mass": 1.2 - 0.2 * (i % 2)})
        one = Load(mass, height, side).on(body)
        for name in (*one.parameters, f"{BALANCE}.theta_eq"):
            assert robots.column(name)[i] == pytest.approx(one.value(name), abs=1e-12), name  # round-off only


def test_pitches_are_spread_evenly_over_what_the_loads_reach():
    pitch = equilibria(carrying(ModelBatch(WIP), LoadRanges().draw(WIP, 1500, np.random.default_rng(2))))
    assert pitch.max() > 0.2
    assert pitch.min() < -0.2
    counts, _ = np.histogram(pitch, bins=10, range=(-0.2, 0.2))
    # Evenly: about 125 in each bin, which scatter by 11; uniform loads would crowd the middle three times as densely.
    assert counts.min() > 80
    assert counts.max() < 180


def test_symmetric_ranges_give_symmetric_labels():
    pitch = made(watch=Watch(samples=2000, length=2, noise=QUIET)).pitch
    scatter = pitch.std() / np.sqrt(len(pitch))
    assert abs(pitch.mean()) < 4.0 * scatter
    assert np.quantile(pitch, 0.9) == pytest.approx(-np.quantile(pitch, 0.1), abs=8.0 * scatter)


def test_a_heavier_or_further_load_balances_at_a_larger_angle():
    loads = np.array([[0.5, 0.5, 0.1], [1.0, 0.5, 0.1], [1.0, 0.5, 0.2], [1.0, 0.5, -0.2]])
    light, heavy, far, mirrored = equilibria(carrying(ModelBatch(WIP), loads))
    assert 0.0 < light < heavy < far
    assert mirrored == pytest.approx(-far, abs=1e-15)


def test_a_robot_falls_towards_its_load_and_rolls_after_it():
    towards_plus = under(Load(1.6, 0.45, 0.15))
    assert towards_plus[15, 1] < -0.01  # positive pitch moves the centre of mass to -x
    assert towards_plus[-1, 0] > 0.1
    np.testing.assert_allclose(under(Load(1.6, 0.45, -0.15)), -towards_plus, atol=1e-6)  # float32
    assert np.abs(under(Load(0.0, 0.45, 0.15))).max() < 1e-9  # nothing tips it over


def test_windows_are_what_the_robot_with_that_load_does(training: TrainingSet):
    i, step = 3, round(0.015 * 650)
    feedback, rate = REGULATOR
    loaded = Load(*training.loads[i]).on(WIP)
    inputs = Inputs.regular(0.2, rate, 1)
    initial = np.array([0.0, training.windows[i, 0, 1], 0.0, 0.0])[:, None, None]
    run = SIMULATOR.close_loop(ModelBatch(loaded), inputs, initial, feedback, np.zeros((len(inputs.t) - 1, 4, 1)))
    np.testing.assert_allclose(training.windows[i, 1], run.coordinates[step, :, 0, 0], atol=1e-6)  # float32


def test_without_friction_a_robot_balances_at_its_label_and_nowhere_else(training: TrainingSet):
    robots = carrying(ModelBatch(WIP), training.loads)
    balance = balance_of(some_of(robots, slice(20)), SIMULATOR)
    np.testing.assert_allclose(balance.middle, training.pitch[:20], atol=PITCH_RESOLUTION)
    assert balance.dead_band.max() < PITCH_RESOLUTION
    check = check_labels(ModelBatch(WIP), training, SIMULATOR, 40, np.random.default_rng(0))
    assert check["robots"] == 40
    assert check["largest_difference"] < 1e-4


def test_with_dry_friction_the_label_lies_in_the_dead_band():
    sticky = WIP.with_effects(COULOMB)
    training = made(sticky)
    robots = some_of(carrying(ModelBatch(sticky), training.loads), slice(20))
    balance = balance_of(robots, SIMULATOR)
    assert balance.misses(training.pitch[:20]).max() == 0.0
    # The pitch joint holds what gravity's torque is below its friction: m_b g L sin(theta - theta_eq) = F_c.
    gravity = robots.column("body_mass") * 9.81 * robots.column("com_height")
    np.testing.assert_allclose(balance.dead_band, np.arcsin(0.1 / gravity), rtol=1e-3)


def test_a_wrong_label_is_noticed(training: TrainingSet):
    wrong = replace(training, pitch=training.pitch + 0.01)
    check = check_labels(ModelBatch(WIP), wrong, SIMULATOR, 10, np.random.default_rng(0))
    assert check["largest_miss"] == pytest.approx(0.01, abs=PITCH_RESOLUTION)


def test_a_robot_at_the_end_of_the_rail_stays_there():
    training = made(watch=Watch(samples=200, rail=0.5, noise=QUIET))
    x = training.windows[:, :, 0]
    stopped = np.abs(training.pitch) > 0.15
    assert np.abs(x).max() < 0.5
    assert isinstance(training.card["stopped"], int)
    assert training.card["stopped"] > 20
    assert np.ptp(training.windows[stopped, -2:], axis=1).max() == 0.0


def test_parts_are_eight_to_one_to_one_and_hold_all_pitches():
    training = made(watch=Watch(length=2))
    assert [int(np.sum(training.part == i)) for i in range(len(PARTS))] == [1200, 150, 150]
    for part in PARTS:
        assert np.abs(training.of(part).pitch).max() > 0.2


def test_noise_is_that_of_the_paper():
    noisy, quiet = made(watch=Watch(samples=200)), made(watch=Watch(samples=200, noise=QUIET))
    errors = noisy.windows - quiet.windows
    assert errors.std(axis=(0, 1)) == pytest.approx([0.005, 0.005], rel=0.03)  # 16000 values each: 0.6 %
    assert np.corrcoef(errors[:, :-1].ravel(), errors[:, 1:].ravel())[0, 1] == pytest.approx(0.0, abs=0.03)


def test_noise_in_the_loop_moves_the_robot():
    watch = Watch(samples=50, noise=ObservationNoise(amplitude=0.01, in_loop=True))
    shaken = made(watch=watch)
    still = made(watch=replace(watch, noise=QUIET))
    ends = shaken.windows[:, -1, 0] - still.windows[:, -1, 0]
    assert 0.005 < ends.std() < 0.5  # more than the noise that is seen


def test_every_sample_has_a_simulation_of_its_own():
    viscous = WIP.with_effects({"translation/viscous": {"sigma": 0.0}})
    name, values = "translation/viscous.sigma", np.linspace(0.0, 60.0, 20)[:, None]
    watch = Watch(samples=40, noise=QUIET)
    simulations = ModelBatch(viscous, (name,), values)
    mixed = generate(simulations, REGULATOR, SIMULATOR, watch, np.random.default_rng(0))
    for i in (0, 7, 19, 27):  # the 28th robot is of the eighth simulation again
        alone = made(viscous.with_values({name: values[i % 20, 0]}), watch)
        np.testing.assert_allclose(mixed.windows[i], alone.windows[i], atol=1e-6)  # float32
    assert np.abs(mixed.windows[7] - made(viscous, watch).windows[7]).max() > 1e-3


def test_a_seed_decides_everything(training: TrainingSet):
    again, other = made(), made(seed=1)
    assert again.card == training.card
    assert np.array_equal(again.windows, training.windows)
    assert other.card["digest"] != training.card["digest"]


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: LoadRanges(mass=(2.0, 1.0)), r"mass is \[2, 1\] kg, expected \[from, to\]"),
        (lambda: LoadRanges(mass=(-1.0, 1.0)), "mass begins at -1 kg, expected zero or more"),
        (lambda: LoadRanges(side=(float("nan"), 1.0)), "side is"),
        (lambda: Watch(samples=5), "samples is 5, expected 10 or more"),
        (lambda: Watch(length=1), "length is 1, expected 2"),
        (lambda: Watch(lean=-0.1), "lean is -0.1"),
        (lambda: ObservationNoise(amplitude=-1.0), "noise: amplitude is -1"),
        (lambda: made(watch=Watch(period=1e-3)), r"period is 0.001 s, expected 0.00154 s or more"),
    ],
)
def test_bad_settings_are_refused_in_one_line(build, message: str):
    with pytest.raises(InputError, match=message) as refusal:
        build()
    assert "\n" not in str(refusal.value)
