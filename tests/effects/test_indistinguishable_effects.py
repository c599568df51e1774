"""Effects that no recording tells apart show the same motion."""

import numpy as np
import pytest
from sim.robots import LIVELY, move, robot, sines

from wipx.core.plant import plant_of
from wipx.effects.catalogue import alike

TURNED, LATE = 0.04, 0.02  # [rad], [s]
FRICTION = {"linear_axis": {"translation/stribeck": {"F_c": 0.5, "F_s": 0.8, "v_s": 0.1}}}
FRICTION["pendulum"] = {"pitch/stribeck": {"F_c": 0.1, "F_s": 0.2, "v_s": 0.1}}
T = np.linspace(0.0, 1.0, 201)


@pytest.mark.parametrize("kind", ["wip", "cartpole", "pendulum"])
def test_a_turned_centre_of_mass_shows_as_a_turned_zero_of_the_angle(kind: str):
    angle = plant_of(kind).coordinates.index("theta")
    assert alike(plant_of(kind))["geometry/com_offset"] == ("sensor_theta/bias",)
    start = np.array(LIVELY[kind])
    beside = move(robot(kind, {"geometry/com_offset": {"theta_eq": TURNED}}), start, T, sines(T, 2.0))
    start[angle] -= TURNED
    turned = move(robot(kind, {"sensor_theta/bias": {"b": TURNED}}), start, T, sines(T, 2.0))
    np.testing.assert_allclose(turned.q, beside.q, atol=1e-9)


@pytest.mark.parametrize(("kind", "sensor"), [("linear_axis", "sensor_x/delay"), ("pendulum", "sensor_theta/delay")])
def test_a_late_drive_of_one_joint_shows_as_a_late_sensor(kind: str, sensor: str):
    assert alike(plant_of(kind))["actuator/delay"] == (sensor,)
    commands = np.where(T[:-1, None] > LATE, sines(T, 3.0), 0.0)
    late = [
        move(robot(kind, {**FRICTION[kind], name: {"tau": LATE}}), (0.0, 0.0), T, commands)
        for name in ("actuator/delay", sensor)
    ]
    np.testing.assert_allclose(late[0].q, late[1].q, atol=1e-6)


def test_a_second_joint_tells_a_late_drive_from_a_late_sensor():
    assert not any(name.endswith("/delay") for name in alike(plant_of("wip")))
