"""Known physics comes back from noisy recordings, and nothing is found where nothing is missing."""

from collections import Counter

import numpy as np
import pytest
from emulated_robot import ANGLE_NOISE, Effects, Robot, complete, nominal_model

from wipx.core.results import Estimate

CASES: dict[str, tuple[str, Effects]] = {
    "pendulum friction": ("pendulum", {"pitch/coulomb": {"F_c": 0.06}, "pitch/viscous": {"sigma": 0.02}}),
    "pendulum dead zone": ("pendulum", {"actuator/dead_zone": {"band": 0.08}}),
    "pendulum delay": ("pendulum", {"actuator/delay": {"tau": 0.012}}),
    "pendulum gears": ("pendulum", {"pitch/load_friction": {"K_motor": 0.08, "K_external": 0.05}}),
    "axis friction": ("linear_axis", {"translation/coulomb": {"F_c": 1.0}, "translation/viscous": {"sigma": 1.5}}),
    "axis gain": ("linear_axis", {"actuator/gain": {"k": 0.9}}),
    "cartpole friction": ("cartpole", {"translation/coulomb": {"F_c": 0.5}, "translation/viscous": {"sigma": 1.0}}),
    "cartpole lag": ("cartpole", {"actuator/lag": {"tau": 0.008}}),
    "wip pivot": ("wip", {"pitch/coulomb": {"F_c": 0.1}}),
    "wip actuator": ("wip", {"actuator/dead_zone": {"band": 1.0}, "actuator/delay": {"tau": 0.006}}),
    "double pendulum friction": (
        "double_pendulum",
        {"joint1/coulomb": {"F_c": 0.08}, "joint2/coulomb": {"F_c": 0.05}, "joint2/viscous": {"sigma": 0.01}},
    ),
}
# Two laws of friction at one joint, as on the pendulum.
LONG = {"axis friction", "cartpole friction", "double pendulum friction"}
# Noise alone moves the numbers by 1 to 4 %; a joint that sticks in one window of a fresh draw can
# hold a search 5 % off, seldom more.
TOLERANCE = 0.15


def assert_found(estimates: tuple[Estimate, ...], effects: Effects) -> None:
    """Each number lies within three half widths of its interval or within `TOLERANCE`."""
    for e in estimates:
        effect, _, symbol = e.name.rpartition(".")
        true = effects[effect][symbol]
        reach = max(3.0 * (e.high - e.low) / 2.0, TOLERANCE * true)
        assert abs(e.value - true) <= reach, f"{e.name} = {e.value:.4g} [{e.low:.4g}, {e.high:.4g}], truth {true:g}"
        assert e.low <= e.value <= e.high
        assert e.high - e.low < true, f"{e.name}: the interval [{e.low:.4g}, {e.high:.4g}] says nothing"


@pytest.mark.parametrize("name", [n if n not in LONG else pytest.param(n, marks=pytest.mark.slow) for n in CASES])
def test_known_effects_come_back(name: str, fresh_seed: int):
    kind, effects = CASES[name]
    nominal = nominal_model(kind)
    rng = np.random.default_rng(fresh_seed)
    found = complete(nominal, Robot(nominal.with_effects(effects)).record(rng), tuple(effects))
    assert_found(found.estimates, effects)
    assert set(found.model.effects) == set(effects)
    for column, error in found.fit.completed.items():
        assert error < 0.3 * found.fit.nominal[column]


@pytest.mark.parametrize("kind", ["pendulum", "linear_axis"])
def test_nothing_is_found_when_nothing_is_missing(kind: str):
    nominal = nominal_model(kind)
    joint = nominal.plant.joints[0]
    switched_on = (f"{joint}/coulomb", f"{joint}/viscous", "actuator/dead_zone", "actuator/delay")
    found = complete(nominal, Robot(nominal).record(np.random.default_rng(12)), switched_on)
    for e in found.estimates:
        assert e.low <= e.nominal <= e.high or abs(e.value - e.nominal) < 0.1 * _size(e), e
    for column, error in found.fit.completed.items():
        assert error < 1.5 * found.fit.nominal[column]  # four numbers fitted to the noise of 9 s


def _size(estimate: Estimate) -> float:
    """What would be a small effect on these robots: a tenth of those of `CASES`."""
    return {"F_c": 0.06, "sigma": 0.02, "band": 0.08, "tau": 0.006}[estimate.name.rpartition(".")[2]]


def test_a_rigid_body_number_comes_back():
    truth = nominal_model("pendulum")
    wrong = truth.with_values({"body_inertia": 0.8 * truth.parameters["body_inertia"]})
    recordings = Robot(truth.with_effects({"pitch/coulomb": {"F_c": 0.05}})).record(np.random.default_rng(13))
    found = complete(wrong, recordings, ("pitch/coulomb",), free={"body_inertia": 0.3})
    values = {e.name: e.value for e in found.estimates}
    # The inertia about the joint is five times that of the body alone.
    assert values["body_inertia"] == pytest.approx(truth.parameters["body_inertia"], rel=0.05)
    assert values["pitch/coulomb.F_c"] == pytest.approx(0.05, rel=TOLERANCE)


def test_an_exact_prior_holds_its_number():
    nominal = nominal_model("pendulum")
    recordings = Robot(nominal.with_effects({"pitch/coulomb": {"F_c": 0.05}})).record(np.random.default_rng(14))
    found = complete(nominal, recordings, ("pitch/coulomb",), free={"body_mass": 1e-6})
    assert found.model.parameters["body_mass"] == pytest.approx(nominal.parameters["body_mass"], rel=1e-5)


def test_a_number_outside_its_bounds_is_reported():
    nominal = nominal_model("pendulum")
    recordings = Robot(nominal.with_effects({"pitch/coulomb": {"F_c": 0.06}})).record(np.random.default_rng(15))
    found = complete(nominal, recordings, ("pitch/coulomb",), bounds={"pitch/coulomb.F_c": (0.0, 0.03)})
    (estimate,) = found.estimates
    assert estimate.at_bound
    assert any("pitch/coulomb.F_c stopped at the end of its search interval" in note for note in found.notes)


def test_recordings_are_held_out_of_the_fit_but_judged():
    nominal = nominal_model("pendulum")
    recordings = Robot(nominal.with_effects({"pitch/coulomb": {"F_c": 0.06}})).record(np.random.default_rng(16))
    found = complete(nominal, recordings[:2], ("pitch/coulomb",), held_out=recordings[2:])
    assert found.held_out is not None
    assert found.held_out.completed["theta"] < 3.0 * ANGLE_NOISE
    assert [trace.held_out for trace in found.traces] == [True, False, False]
    alone = complete(nominal, recordings[:2], ("pitch/coulomb",))
    assert alone.estimates == found.estimates


@pytest.mark.slow
def test_intervals_cover_the_truth_as_often_as_they_say(fresh_seed: int):
    draws = 80
    effects = {"pitch/coulomb": {"F_c": 0.06}, "pitch/viscous": {"sigma": 0.02}, "actuator/delay": {"tau": 0.008}}
    nominal = nominal_model("pendulum")
    robot = Robot(nominal.with_effects(effects))
    hits: Counter[str] = Counter()
    for seed in np.random.SeedSequence(fresh_seed).spawn(draws):
        found = complete(nominal, robot.record(np.random.default_rng(seed)), tuple(effects))
        for e in found.estimates:
            hits[e.name] += int(e.low <= robot.model.value(e.name) <= e.high)
    shares = {name: count / draws for name, count in hits.items()}
    print(", ".join(f"{name}: {share:.1%}" for name, share in shares.items()))
    # 240 intervals of 95 % hold the truth in 92 to 98 of 100 cases; the three of a draw are correlated.
    assert 0.88 <= np.mean(list(shares.values())) <= 1.0
