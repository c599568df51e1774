"""A force without a name, as a Gaussian process over a signal."""

import numpy as np
import pytest
from diagnosis.recorded import bench

from wipx.diagnosis.residuals.discrepancy import process_mean, with_curve
from wipx.diagnosis.residuals.residual_tests import residual_tests, shapes_of
from wipx.effects.remainder import KNOTS as COUNT

KNOTS = np.linspace(-1.0, 1.0, 12)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e12])
def test_a_smooth_force_comes_back_whatever_its_unit(scale: float, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    slopes, force = 5.0 * rng.normal(size=(400, 12)), np.sin(3.0 * KNOTS)
    white = -slopes @ force + rng.normal(size=400)
    mean, spread = process_mean(slopes * scale, white, KNOTS)
    assert np.all(np.abs(mean * scale - force) < 6.0 * spread * scale)
    assert np.all(spread * scale < 0.1)


def test_knots_that_were_never_visited_follow_their_neighbours(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    slopes = 5.0 * rng.normal(size=(400, 12))
    slopes[:, 6] = 0.0
    mean, spread = process_mean(slopes, -slopes @ KNOTS + rng.normal(size=400), KNOTS)
    assert mean[6] == pytest.approx(KNOTS[6], abs=0.1)
    assert spread[6] > spread[5]


def test_a_curve_over_the_rate_leaves_viscous_friction_to_viscous_friction(fresh_seed: int):
    """Both can be any straight line over the rate; the curve is none."""
    place = np.linspace(-1.0, 1.0, COUNT)
    force = {f"f{i}": float(f) for i, f in enumerate(2.0 * (place**3 - 0.6 * place))}
    hidden = {"translation/remainder": {"signal": 2.0, "factor": 0.0, "low": -0.4, "high": 0.4, **force}}
    case = bench("linear_axis", {"translation/viscous": {"sigma": 8.0}, **hidden}, fresh_seed, count=4, duration=4.0)
    fit = case.fit("translation/viscous")
    over_rate = [s for s in shapes_of(case.fitter, fit) if (s.signal, s.kind) == ("x_dot", "force")]
    found, _ = with_curve(case.fitter, case.setting, fit, residual_tests(case.fitter, fit, over_rate)[0])
    curve = found.hypothesis.model.effects["translation/remainder"]
    slope = np.polyfit(over_rate[0].knots, [curve[f"f{i}"] for i in range(COUNT)], 1)[0]
    assert found.log_likelihood > fit.log_likelihood + 100.0
    assert abs(slope) < 0.05 * found.hypothesis.values["translation/viscous.sigma"]
