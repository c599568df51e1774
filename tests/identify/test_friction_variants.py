"""The options of conf/friction."""

import numpy as np
import pytest
import yaml
from emulated_robot import Robot, complete, nominal_model

from wipx.app import configuration_folder
from wipx.config import build
from wipx.core.errors import InputError
from wipx.identify.friction import IdentifiedFriction, JointFriction

OPTIONS = sorted(path.stem for path in (configuration_folder() / "friction").glob("*.yaml"))
WIP = nominal_model("wip")
PENDULUM = nominal_model("pendulum")


def variant(option: str) -> JointFriction | IdentifiedFriction:
    return build(yaml.safe_load((configuration_folder() / "friction" / f"{option}.yaml").read_text()), "friction")


@pytest.mark.parametrize(
    ("option", "kinds"),
    [
        ("none", ()),
        ("coulomb_viscous", ("coulomb", "viscous")),
        ("paper", ("lagged_stribeck",)),
        ("lugre", ("lugre", "viscous")),
    ],
)
def test_friction_acts_on_every_joint(option: str, kinds: tuple[str, ...]):
    switched_on = variant(option).switched_on(WIP, None)
    assert set(switched_on) == {f"{joint}/{kind}" for joint in ("translation", "pitch") for kind in kinds}
    assert variant(option).given(WIP, None) == {}


def test_friction_that_the_owner_knows_is_left_as_it_is():
    known = WIP.with_effects({"pitch/viscous": {"sigma": 0.1}})
    assert "pitch/viscous" not in variant("coulomb_viscous").switched_on(known, None)


def test_identified_friction_comes_from_an_earlier_model_and_nothing_else_does():
    friction = {"translation/coulomb": {"F_c": 1.0}, "pitch/viscous": {"sigma": 0.1}}
    earlier = WIP.with_effects({**friction, "actuator/delay": {"tau": 0.01}})
    assert variant("identified").given(WIP, earlier) == friction
    assert variant("identified").switched_on(WIP, earlier) == ()


def test_identified_friction_needs_an_earlier_model():
    with pytest.raises(InputError, match=r"friction=identified .* give model\.path"):
        variant("identified").given(WIP, None)


@pytest.mark.slow
@pytest.mark.parametrize("option", [name for name in OPTIONS if name not in ("none", "identified")])
def test_every_variant_brings_the_predictions_down_to_the_noise(option: str):
    hidden = {"pitch/coulomb": {"F_c": 0.06}, "pitch/viscous": {"sigma": 0.02}}
    recordings = Robot(PENDULUM.with_effects(hidden)).record(np.random.default_rng(31))
    found = complete(PENDULUM, recordings, variant(option).switched_on(PENDULUM, None))
    assert found.fit.completed["theta"] < 4.0 * found.fit.noise_floor["theta"]
    assert found.fit.completed["theta"] < 0.2 * found.fit.nominal["theta"]
