"""Known weights on the body of a robot."""

import numpy as np
import pytest

from wipx.control.recovery import Releases
from wipx.core.errors import InputError
from wipx.core.load import BALANCE, Load
from wipx.core.model import Model
from wipx.core.plant import plant_of

WIP = Model(
    plant_of("wip"),
    {
        "body_mass": 5.0,
        "wheel_mass": 1.2,
        "com_height": 0.3,
        "body_inertia": 0.2,
        "wheel_inertia": 0.01,
        "wheel_radius": 0.1,
    },
    {},
)


def leaning(angle: float) -> Model:
    """A robot whose centre of mass is beside the body's axis."""
    return WIP.with_effects({BALANCE: {"theta_eq": angle}})


def about_axis(model: Model) -> float:
    """Moment of inertia about the wheel axis [kg m^2]."""
    return model.value("body_inertia") + model.value("body_mass") * model.value("com_height") ** 2


def test_the_order_of_two_loads_does_not_matter():
    one, two = Load(0.8, 0.45, -0.08), Load(1.6, 0.3, 0.2)
    here, there = two.on(one.on(leaning(0.05))), one.on(two.on(leaning(0.05)))
    assert here.parameters == pytest.approx(dict(there.parameters), rel=1e-12)
    assert here.effects[BALANCE] == pytest.approx(there.effects[BALANCE], rel=1e-12)


def test_a_load_adds_its_own_inertia_about_the_wheel_axis():
    load = Load(1.6, 0.45, 0.15)
    for robot in (WIP, leaning(-0.1)):
        more = about_axis(load.on(robot)) - about_axis(robot)
        assert more == pytest.approx(1.6 * (0.45**2 + 0.15**2), rel=1e-12)


def test_gravity_has_no_moment_about_the_axis_at_the_equilibrium():
    lean, load = 0.05, Load(1.6, 0.45, 0.15)
    pitch = load.equilibrium(leaning(lean))
    body, weight = 5.0 * 0.3, 1.6 * np.hypot(0.45, 0.15)
    moments = body * np.sin(pitch - lean), weight * np.sin(pitch - np.arctan2(0.15, 0.45))
    assert sum(moments) == pytest.approx(0.0, abs=1e-12)
    assert lean < pitch < np.arctan2(0.15, 0.45)


@pytest.mark.parametrize("lean", [0.0, -0.05, 0.1])
@pytest.mark.parametrize("pitch", [-0.15, 0.0, 0.2])
def test_a_load_is_placed_for_the_pitch_that_is_asked_for(lean: float, pitch: float):
    robot = leaning(lean)
    assert Releases().load(robot, 0.8, pitch).equilibrium(robot) == pytest.approx(pitch, abs=1e-12)


def test_no_weight_changes_nothing_and_a_pendulum_carries_none():
    assert Load(0.0, 0.5, 0.2).on(WIP) is WIP
    with pytest.raises(InputError, match="a pendulum has no body that could carry one"):
        Load(1.0, 0.5, 0.2).on(Model(plant_of("pendulum"), {}, {}))
