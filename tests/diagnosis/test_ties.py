"""What recordings cannot tell apart is said to be a tie, and nothing else is."""

import pytest
from diagnosis.recorded import bench

from wipx.identify.evaluation import Judge


@pytest.mark.parametrize(
    "hidden", [{"geometry/com_offset": {"theta_eq": 0.01}}, {"sensor_theta/bias": {"b": 0.01}}], ids=["body", "sensor"]
)
def test_a_biased_sensor_is_a_shifted_centre_of_mass(hidden: dict, fresh_seed: int):
    answer = bench("wip", hidden, fresh_seed).diagnosed()
    (effect,) = answer.effects
    assert {effect.name, *effect.equivalent} == {"geometry/com_offset", "sensor_theta/bias"}
    assert f"{effect.name} cannot be told from {effect.equivalent[0]}" in answer.weak
    assert answer.next_experiment is None  # no excitation can
    assert effect.present_probability == pytest.approx(0.5, abs=0.05)
    rival = effect.rivals[0]
    assert rival.separation < 1.0
    assert abs(effect.parameters[0].value) == pytest.approx(0.01, rel=0.1)
    assert abs(next(iter(rival.parameters.values()))) == pytest.approx(0.01, rel=0.1)


@pytest.mark.slow
def test_it_is_one_beside_other_effects_too(fresh_seed: int):
    """A rival whose other numbers stop elsewhere would look far worse."""
    friction = {"pitch/stribeck": {"F_c": 0.03, "F_s": 0.06, "v_s": 0.3}}
    hidden = {"sensor_theta/bias": {"b": 0.02}, "actuator/gain": {"k": 1.2}, **friction}
    answer = bench("wip", hidden, fresh_seed, count=3).diagnosed()
    ties = [{effect.name, *effect.equivalent} for effect in answer.effects]
    assert {"geometry/com_offset", "sensor_theta/bias"} in ties


@pytest.mark.parametrize(
    "hidden",
    [
        pytest.param({"translation/coulomb": {"F_c": 0.5}}, marks=pytest.mark.slow),
        {"actuator/delay": {"tau": 0.008}},
        pytest.param({"environment/rail_tilt": {"angle": 0.01}}, marks=pytest.mark.slow),
    ],
    ids=["friction", "delay", "tilt"],
)
def test_what_differs_is_no_tie(hidden: dict, fresh_seed: int):
    (effect,) = bench("wip", hidden, fresh_seed).diagnosed().effects
    assert effect.name in hidden
    assert effect.equivalent == ()
    assert effect.present_probability > 0.99


def test_tied_effects_predict_the_same():
    case = bench("wip", {"geometry/com_offset": {"theta_eq": 0.01}}, seed=7)
    models = [case.fit(name).hypothesis.model for name in ("geometry/com_offset", "sensor_theta/bias")]
    judge = Judge(case.fitter.simulator, case.quiet.sensor, 0.5)
    for one, other in zip(*(judge.predict(model, case.recordings) for model in models), strict=True):
        assert abs(one - other)[~(one != one)].max() < 1e-5
