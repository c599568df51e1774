"""Which models are trusted."""

from dataclasses import replace

import numpy as np
from diagnosis.recorded import SIMULATOR, bench, coloured

from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.rules import USUAL


def test_a_model_that_predicts_far_worse_than_the_nominal_one_is_not_trusted(fresh_seed: int):
    case = bench("linear_axis", {}, fresh_seed)
    setting = replace(case.setting, uncertainty={"input_gain": 1.0})
    context = Context.of(case.recordings, setting, SIMULATOR, USUAL)
    right, wrong = (
        context.fitter.fit(Hypothesis.of(setting, (), {"input_gain": gain}), case.quiet, steps=0) for gain in (1.0, 0.3)
    )
    assert context.is_trusted(right)
    assert not context.is_worse(right)
    assert context.is_worse(wrong)
    assert not context.is_trusted(wrong)


def test_a_model_whose_misfit_looks_like_noise_that_lasts_is_not_trusted(fresh_seed: int):
    case = bench("linear_axis", {"translation/coulomb": {"F_c": 0.3}}, fresh_seed)
    context = Context.of(case.recordings, case.setting, SIMULATOR, USUAL)
    friction, levels = {"translation/coulomb.F_c": 0.3}, replace(case.quiet, force=2.0 * case.quiet.force)
    without, right = (
        context.fitter.fit(Hypothesis.of(case.setting, effects, friction), levels, steps=0)
        for effects in ((), ("translation/coulomb",))
    )
    assert context.is_quiet(without)  # the noise of the sensor takes it all
    assert context.unruly_joints(without) == ("translation",)
    assert not context.holds_somewhere(without)
    assert not context.is_trusted(without)
    assert context.unruly_joints(right) == ()
    assert context.holds_somewhere(right)
    assert context.is_trusted(right)


def test_a_right_model_is_trusted_though_the_noise_of_a_sensor_lasts(fresh_seed: int):
    case = bench("linear_axis", {}, fresh_seed)
    recordings = coloured(case.recordings, np.random.default_rng(fresh_seed))
    context = Context.of(recordings, case.setting, SIMULATOR, USUAL)
    fit = context.fitter.converged(context.fitter.fit(Hypothesis.of(case.setting, (), {}), context.first_levels))
    assert context.by_row.foretold(fit)[0] > USUAL.trust.foretold
    assert context.errors(fit).times_the_floor > USUAL.trust.near_floor
    assert context.unruly_joints(fit) == ()
    assert context.is_trusted(fit)
