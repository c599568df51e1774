"""Which models are trusted."""

from dataclasses import replace

from diagnosis.recorded import SIMULATOR, bench

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
