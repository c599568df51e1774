"""The curve that is drawn for a law is what the simulator does in steady motion."""

import numpy as np
import pytest
from diagnosis.recorded import bench
from sim.robots import Effects, move, robot, row_forces

from wipx.core.curve import Curve
from wipx.diagnosis.answer.law_curves import added_force, law_curve
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.residuals.residual_tests import shapes_of
from wipx.effects.catalogue import kinds

HEAVY = {"body_mass": 0.0, "wheel_mass": 1e6, "wheel_radius": 0.05}  # keeps its speed whatever acts on it
VALUES = {
    "coulomb": {"F_c": 0.4},
    "viscous": {"sigma": 0.7},
    "stribeck": {"F_c": 0.3, "F_s": 0.9, "v_s": 0.2},
    "presliding": {"F_c": 0.5, "stiffness": 3000.0, "damping": 2.0},
    "lugre": {"F_c": 0.3, "F_s": 0.8, "v_s": 0.3, "stiffness": 4000.0, "damping": 1.0},
    "hysteresis": {"F_c": 0.5, "stiffness": 300.0, "damping": 0.0, "n": 2.0, "gamma": 0.1},
    "asymmetric_coulomb": {"F_plus": 0.3, "F_minus": 0.6},
    "quadratic_drag": {"c": 0.9},
    "lagged_stribeck": {"F_s": 0.8, "F_c": 0.3, "v_s": 0.3, "sigma": 0.2, "epsilon": 0.01, "alpha": 0.6},
    "back_emf": {"k_e": 0.8},
    "offset": {"F_0": 0.25},
    "dead_zone": {"band": 0.2},
    "gain": {"k": 1.4},
    "saturation": {"F_max": 0.9},
    "spring": {"k": 2.0, "x0": 0.1},
    "ripple": {"A": 0.3, "n": 4.0, "phase": 0.5},
    "rail_tilt": {"angle": 1e-7},
}


def site_of(kind: str) -> str:
    sites = kinds()[kind].sites
    return "translation" if "translation" in sites else sites[0]


def force(effects: Effects, over: str, at: float, input_gain: float) -> float:
    """Force on a carriage [N] that goes at a rate [m/s], stands at a place [m] or obeys a command."""
    t = np.linspace(0.0, 0.2, 201)
    start = {"rate": (0.0, at), "coordinate": (at, 0.0), "command": (0.0, 0.0)}[over]
    commands = np.full(200, at if over == "command" else 0.0)
    model = robot("linear_axis", effects, {**HEAVY, "input_gain": input_gain})
    return float(HEAVY["wheel_mass"] * row_forces(move(model, start, t, commands))[-1])


@pytest.mark.parametrize("kind", sorted(kind for kind, effect in kinds().items() if effect.steady))
def test_a_curve_is_the_force_that_the_effect_adds_in_steady_motion(kind: str, fresh_seed: int):
    steady = kinds()[kind].steady
    assert steady is not None
    rng = np.random.default_rng(fresh_seed)
    name, gain = f"{site_of(kind)}/{kind}", float(rng.choice([-1.0, 1.0]) * rng.uniform(0.02, 5.0))
    limit = 1.5 / abs(gain) if steady.over == "command" else 1.0
    at = rng.uniform(0.1, 1.0, 8) * rng.choice([-1.0, 1.0], 8) * limit
    effects = {name: VALUES[kind]}
    drawn = added_force(robot("linear_axis", effects, {**HEAVY, "input_gain": gain}), name, at)
    acting = [force(effects, steady.over, a, gain) - force({}, steady.over, a, gain) for a in at]
    np.testing.assert_allclose(drawn, acting, atol=2e-3)


def test_laws_of_the_drive_are_drawn_as_they_act_on_each_other(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    effects = {f"actuator/{kind}": VALUES[kind] for kind in ("saturation", "gain", "dead_zone", "offset")}
    at = rng.uniform(-40.0, 40.0, 12)
    model = robot("linear_axis", effects, {**HEAVY, "input_gain": 0.04})
    for name in effects:
        others = {other: values for other, values in effects.items() if other != name}
        acting = [force(effects, "command", a, 0.04) - force(others, "command", a, 0.04) for a in at]
        np.testing.assert_allclose(added_force(model, name, at), acting, atol=2e-3)


def curve_of(effect: str, hidden: Effects, seed: int) -> Curve:
    """What is drawn of the only effect that an answer has."""
    case = bench("linear_axis", hidden, seed, count=4)
    begin = {f"{name}.{symbol}": value for name, own in hidden.items() for symbol, value in own.items()}
    fit = case.fitter.converged(case.fitter.fit(Hypothesis.of(case.setting, (effect,), begin), case.quiet))
    curve = law_curve(case.fitter, fit, effect, shapes_of(case.fitter, fit))
    assert curve is not None
    return curve


@pytest.mark.parametrize(
    ("effect", "numbers"),
    [("actuator/saturation", {"F_max": 0.6}), ("translation/viscous", {"sigma": 2.0})],
)
def test_data_lie_on_a_law_that_is_right(effect: str, numbers: dict[str, float], fresh_seed: int):
    curve = curve_of(effect, {effect: numbers}, fresh_seed)
    law = np.interp(curve.bins, curve.at, curve.law)
    size = np.abs(curve.law).max()
    np.testing.assert_array_less(np.abs(curve.force - law), 5.0 * curve.spread + 1e-3 * size)
    assert np.median(curve.spread) < 0.2 * size


def test_data_leave_a_law_of_another_shape(fresh_seed: int):
    hidden = {"translation/coulomb": {"F_c": 0.4}, "translation/viscous": {"sigma": 1.0}}
    curve = curve_of("translation/viscous", hidden, fresh_seed)
    slow = np.abs(curve.bins) < 0.5 * np.abs(curve.bins).max()
    resisting = -curve.force * np.sign(curve.bins)
    drawn = np.interp(np.abs(curve.bins), curve.at, -curve.law)
    assert np.mean((resisting > drawn)[slow & (curve.bins != 0.0)]) > 0.7
