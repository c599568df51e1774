"""Numbers of an answer: those of effects, and those of the robot that its owner is not sure of."""

from pathlib import Path

from diagnosis.recorded import Bench, forecasts
from diagnosis.recorded_arm import arm, recorded

from wipx.diagnosis.decision.estimates import estimates
from wipx.diagnosis.likelihood.hypothesis import Hypothesis

FRICTION = "elbow/coulomb"


def test_the_mass_of_a_link_in_doubt_has_an_interval_beside_friction(tmp_path: Path, fresh_seed: int):
    model = arm(tmp_path)
    truth = model.with_effects({FRICTION: {"F_c": 0.05}})
    case = Bench(model, (recorded(truth, fresh_seed),), {"lower.mass": 0.1})
    ahead, nothing = forecasts(case), Hypothesis.of(case.setting, (), {})
    for fitter, nominal in ((case.fitter, case.fit()), (ahead, ahead.first_fit(nothing))):
        fit = fitter.converged(fitter.fit(Hypothesis.of(case.setting, (FRICTION,), {}), nominal.levels))
        numbers = {number.name: number for number in estimates(fitter, fit, nominal)}
        assert set(numbers) == {"lower.mass", f"{FRICTION}.F_c"}
        level, mass = numbers[f"{FRICTION}.F_c"], numbers["lower.mass"]
        assert level.low < 0.05 < level.high
        assert mass.low < model.value("lower.mass") < mass.high
