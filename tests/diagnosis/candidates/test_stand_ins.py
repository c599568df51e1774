"""Effects at other sites that may do what one of a fit does."""

from pathlib import Path

import pytest
from diagnosis.recorded import Bench
from diagnosis.recorded_arm import arm, recorded

from wipx.diagnosis.candidates.stand_ins import stand_ins
from wipx.diagnosis.selection.criteria import evidence
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.robot_search import RobotSearch, parts_of

CART = """<mujoco><worldbody><body name="cart"><inertial pos="0 0 0.1" mass="0.5" diaginertia="0.01 0.01 0.01"/>
<joint name="slide" type="slide" axis="1 0 0" damping="0.3"/></body></worldbody></mujoco>"""
PENDULUM = """<mujoco><worldbody><body name="rod"><inertial pos="0 0 -0.2" mass="0.5" diaginertia="0.01 0.01 0.001"/>
<joint name="pivot" axis="0 1 0" damping="0.02"/></body></worldbody></mujoco>"""
SAME_MOTION = {
    "mass": (CART, {"link_cart/payload": {"mass": 0.1, "x": 0.02, "y": 0.0, "z": 0.1}}, "slide/rotor_inertia"),
    "rotor": (CART, {"slide/rotor_inertia": {"J": 0.1}}, "link_cart/payload"),
    "lean": (PENDULUM, {"environment/base_tilt": {"roll": 0.0, "pitch": 0.04}}, "sensor_pivot/bias"),
    "bias": (PENDULUM, {"sensor_pivot/bias": {"b": 0.04}}, "environment/base_tilt"),
}


@pytest.mark.parametrize("case", SAME_MOTION)
def test_what_moves_a_robot_alike_is_proposed_and_fits_as_well(case: str, tmp_path: Path, fresh_seed: int):
    mjcf, hidden, other = SAME_MOTION[case]
    model = arm(tmp_path, mjcf)
    bench = Bench(model, (recorded(model.with_effects(hidden), fresh_seed, (0.3,)),), {})
    effect, nominal = next(iter(hidden)), bench.fit()
    search = RobotSearch.of(FitStore.of(bench.fitter, bench.setting, nominal), nominal)
    fit = bench.fit(effect)
    ((part, own),) = search.split(fit, with_stand_ins=True)
    assert other in part.store.elsewhere[effect]
    rival = next(found for found in part.store.replacements(own, effect) if found.effects == (other,))
    assert abs(evidence(rival, own)) < 3.0
    ((alone, own),) = search.split(fit)
    assert all(found.effects != (other,) for found in alone.store.replacements(own, effect))


def test_what_moves_an_arm_otherwise_is_not_proposed(tmp_path: Path, fresh_seed: int):
    """Friction of one joint and a load that gravity pulls."""
    model = arm(tmp_path)
    hidden = {"elbow/coulomb": {"F_c": 0.04}, "link_lower/payload": {"mass": 0.1, "x": 0.01, "y": 0.02, "z": -0.25}}
    bench = Bench(model, (recorded(model.with_effects(hidden), fresh_seed),), {})
    found = stand_ins(bench.fitter, bench.setting, bench.fit(*hidden), parts_of(model.plant))
    assert found == {"elbow/coulomb": (), "link_lower/payload": ()}
