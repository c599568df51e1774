"""The blind benchmark's own mechanics: energy, sticking, delay."""

import numpy as np
import pytest
from proof.blind_robots.bare_robots import BODIES, open_loop

from wipx.proof.blind_robots.physics import Hidden, UnmodelledPhysics


def wip_energy(q: np.ndarray, v: np.ndarray, kind: str) -> np.ndarray:
    p = BODIES[kind]
    wheel = p.get("wheel_mass", 0.0) + p.get("wheel_inertia", 0.0) / p.get("wheel_radius", 1.0) ** 2
    body, height = p["body_mass"], p["com_height"]
    along = v[:, 0] - height * np.cos(q[:, 1]) * v[:, 1]
    up = -height * np.sin(q[:, 1]) * v[:, 1]
    kinetic = 0.5 * wheel * v[:, 0] ** 2 + 0.5 * body * (along**2 + up**2) + 0.5 * p["body_inertia"] * v[:, 1] ** 2
    return kinetic + body * p["gravity"] * height * np.cos(q[:, 1])


def chain_energy(q: np.ndarray, v: np.ndarray, kind: str) -> np.ndarray:
    p = BODIES[kind]
    both, spin = q.sum(axis=1), v.sum(axis=1)
    l1, c2, m2 = p["link1_length"], p["link2_com"], p["link2_mass"]
    along = l1 * np.cos(q[:, 0]) * v[:, 0] + c2 * np.cos(both) * spin
    up = l1 * np.sin(q[:, 0]) * v[:, 0] + c2 * np.sin(both) * spin
    own = p["link2_inertia"] - m2 * c2**2
    kinetic = 0.5 * (p["link1_inertia"] * v[:, 0] ** 2 + own * spin**2 + m2 * (along**2 + up**2))
    high = p["link1_mass"] * p["link1_com"] * np.cos(q[:, 0]) + m2 * (l1 * np.cos(q[:, 0]) + c2 * np.cos(both))
    return kinetic - p["gravity"] * high


@pytest.mark.parametrize(
    ("kind", "energy"), [("wip", wip_energy), ("pendulum", wip_energy), ("double_pendulum", chain_energy)]
)
def test_energy_is_conserved_without_effects(kind: str, energy):
    q, v, _ = open_loop(kind, start=(0.7 if kind == "double_pendulum" else 0.0, 0.9), rows=1500)
    total = energy(q, v, kind)
    assert np.ptp(q, axis=0).max() > 0.5
    # Runge-Kutta of fourth order at 0.1 ms: far below anything that a sensor could see
    assert np.ptp(total) < 1e-9 * np.abs(total).max()


def test_a_mass_that_hardly_moves_on_the_body_changes_nothing():
    stiff = UnmodelledPhysics(
        "sloshing", {"aux_mass": 0.3, "aux_height": 0.3, "aux_stiffness": 3e4, "aux_damping": 60.0}
    )
    q, _, _ = open_loop("wip", start=(0.0, 0.3), rows=500)
    with_mass, _, _ = open_loop("wip", Hidden(unmodelled=stiff), start=(0.0, 0.3), rows=500)
    # the spring gives by weight / stiffness = 0.1 mm at most, which the falling body enlarges
    np.testing.assert_allclose(with_mass, q, atol=0.01)


@pytest.mark.parametrize("effect", ["coulomb", "stribeck"])
def test_a_joint_sticks_exactly_below_the_static_level(effect: str):
    values = {"F_c": 2.0} if effect == "coulomb" else {"F_c": 1.0, "F_s": 2.0, "v_s": 0.05}
    hidden = Hidden({f"translation/{effect}": values})
    held, v, _ = open_loop("linear_axis", hidden, command=np.full(1000, 1.99))
    assert not held.any()
    assert not v.any()
    moved, _, _ = open_loop("linear_axis", hidden, command=np.full(1000, 2.01))
    assert moved[-1, 0] > 0.0


def test_a_sliding_joint_stops_where_friction_has_taken_its_energy():
    command = np.zeros(1000)
    command[:100] = 5.0  # 0.2 s
    q, v, _ = open_loop("linear_axis", Hidden({"translation/coulomb": {"F_c": 2.0}}), command=command)
    assert v[-1, 0] == 0.0
    # pushed over s with 5 N, braked over the whole way with 2 N: way = 5 s / 2, s = (5 - 2) / 3 kg * 0.2^2 / 2
    assert q[-1, 0] == pytest.approx(2.5 * 0.5 * 1.0 * 0.2**2, rel=1e-6)


def test_a_sticky_spot_holds_only_inside():
    spot = Hidden({"translation/sticky_spot": {"F_c": 9.0, "lo": 0.02, "hi": 0.05}})
    q, v, _ = open_loop("linear_axis", spot, command=np.full(1000, 3.0))
    assert v[-1, 0] == 0.0
    assert 0.02 < q[-1, 0] < 0.05


def test_presliding_returns_after_a_small_push():
    command = np.zeros(3000)
    command[:250] = 0.5
    bristles = {"F_c": 2.0, "stiffness": 500.0}
    hidden = Hidden({"translation/presliding": bristles, "translation/viscous": {"sigma": 20.0}})
    q, _, _ = open_loop("linear_axis", hidden, command=command, rows=3000)
    assert q[:, 0].max() > 0.5e-3
    assert abs(q[-1, 0]) < 0.5 * q[:, 0].max()  # bristles spring back, but remember; dry friction would keep it all


def test_delay_is_a_shift_of_time():
    rng = np.random.default_rng(5)
    command = np.repeat(rng.normal(0.0, 2.0, 100), 10)
    q, _, _ = open_loop("linear_axis", command=command)
    late, _, _ = open_loop("linear_axis", Hidden({"actuator/delay": {"tau": 0.014}}), command=command)
    np.testing.assert_allclose(late[7:], q[:-7], atol=1e-12)  # 7 rows of 2 ms; all steps are exact


def test_delay_between_two_instants_is_exact():
    hidden = Hidden({"actuator/delay": {"tau": 0.0031}})
    q, v, _ = open_loop("linear_axis", hidden, command=np.full(50, 3.0), rows=50)
    t = np.arange(50) / 500.0
    np.testing.assert_allclose(v[:, 0], np.maximum(t - 0.0031, 0.0), atol=1e-12)  # 3 N on 3 kg
    np.testing.assert_allclose(q[:, 0], 0.5 * np.maximum(t - 0.0031, 0.0) ** 2, atol=1e-12)


def test_the_command_passes_the_drive_in_the_order_of_the_contract():
    effects = {"actuator/dead_zone": {"band": 1.0}, "actuator/gain": {"k": 2.0}, "actuator/saturation": {"F_max": 5.0}}
    for command, force in ((0.9, 0.0), (2.0, 2.0), (-2.0, -2.0), (4.0, 5.0)):
        _, _, forces = open_loop("linear_axis", Hidden(effects), command=np.full(10, command), rows=10)
        np.testing.assert_allclose(forces[:, 0], force, atol=1e-12)


def test_backlash_passes_no_force_within_the_gap_and_all_of_it_in_contact():
    _, v, forces = open_loop(
        "linear_axis", Hidden({"actuator/backlash": {"gap": 0.004}}), command=np.full(500, 3.0), rows=500
    )
    assert forces[0, 0] == 0.0
    # once in contact the drive's mass moves along, so that the whole is as heavy as without play
    assert v[-1, 0] - v[-101, 0] == pytest.approx(0.2 * 3.0 / 3.0, rel=0.02)


def test_a_tilted_rail_pulls_down_and_leaves_upright_upright():
    _, v, _ = open_loop("linear_axis", Hidden({"environment/rail_tilt": {"angle": 0.1}}), rows=100)
    assert v[-1, 0] == pytest.approx(-9.81 * np.sin(0.1) * 99 / 500.0, rel=1e-9)
    held, _, _ = open_loop("pendulum", Hidden({"geometry/com_offset": {"theta_eq": 0.03}}), start=(0.0, 0.03), rows=500)
    np.testing.assert_allclose(held[:, 1], 0.03, atol=1e-12)


def test_a_hysteresis_gives_way_by_its_level_and_holds_less():
    values = {"hysteresis": 2.0, "hysteresis_length": 0.05, "hysteresis_first": 0.3}
    hidden = Hidden(unmodelled=UnmodelledPhysics("hysteresis", values))
    held, _, _ = open_loop("linear_axis", hidden, command=np.full(1000, 0.5))
    assert 0.0 < held.max() < 0.05  # swings about the place where the elements hold the command
    q, v, _ = open_loop("linear_axis", hidden, command=np.full(1000, 3.0))
    slid = q[:, 0] > 0.06  # every element has slipped: the force is its level, the mass 3 kg
    gain = np.gradient(v[slid, 0], 1.0 / 500.0)
    np.testing.assert_allclose(gain, (3.0 - 2.0) / 3.0, rtol=1e-3)


def test_a_hysteresis_comes_back_as_it_was_built_up_twice_as_wide():
    values = {"hysteresis": 2.0, "hysteresis_length": 0.02, "hysteresis_first": 0.3}
    hidden = Hidden({"translation/viscous": {"sigma": 20.0}}, unmodelled=UnmodelledPhysics("hysteresis", values))
    slowly = np.concatenate([np.linspace(0.0, 1.8, 4000), np.linspace(1.8, -1.8, 8000), np.linspace(-1.8, 1.8, 8000)])
    q, _, _ = open_loop("linear_axis", hidden, command=slowly, rows=20000, rate=125.0)
    virgin, back = q[:4000:40, 0], q[4000:12000:80, 0]
    # Masing: force and way from the turning point on, halved, are the first loading
    np.testing.assert_allclose((q[3999, 0] - back) / 2.0, virgin, atol=0.05 * virgin.max())
    np.testing.assert_allclose(q[-1, 0], q[3999, 0], atol=0.05 * virgin.max())  # the loop closes
