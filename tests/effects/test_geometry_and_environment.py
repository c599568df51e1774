"""Geometry and environment: the plant itself differs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sim.robots import LIVELY, PARAMETERS, inner_forces, mass_matrix, move, reference, robot, sines

from wipx.effects.payload import loaded
from wipx.sim.analytic import AnalyticSimulator

T = np.linspace(0.0, 0.6, 151)  # rows of 4 ms
COMMANDS = sines(T, 6.0)
LOAD = {"mass": 0.7, "height": 0.6}


@pytest.mark.parametrize("kind", ["wip", "cartpole", "pendulum", "linear_axis"])
def test_a_payload_is_the_plant_with_recomputed_mass_height_and_inertia(kind: str):
    p = PARAMETERS[kind]
    body, com, inertia = p["body_mass"], p.get("com_height", 0.0), p.get("body_inertia", 0.0)
    height = (body * com + 0.7 * 0.6) / (body + 0.7)
    # Both bodies about the axis, then to the new centre of mass.
    about_axis = inertia + body * com**2 + 0.7 * 0.6**2
    changes = {"body_mass": body + 0.7, "com_height": height, "body_inertia": about_axis - (body + 0.7) * height**2}
    changes = {name: value for name, value in changes.items() if name in robot(kind).parameters}
    extra = move(robot(kind, {"geometry/payload": LOAD}), LIVELY[kind], T, COMMANDS)
    heavier = move(robot(kind, changes=changes), LIVELY[kind], T, COMMANDS)
    np.testing.assert_allclose(extra.q, heavier.q, atol=1e-11)


@given(mass=st.floats(0.0, 5.0), height=st.floats(-0.5, 1.5))
def test_a_payload_adds_its_mass_moment_and_inertia_about_the_axis(mass: float, height: float):
    total, com, inertia = loaded(2.6, 0.35, 0.11, mass, height)
    assert total == pytest.approx(2.6 + mass)
    assert total * com == pytest.approx(2.6 * 0.35 + mass * height, abs=1e-12)
    assert inertia + total * com**2 == pytest.approx(0.11 + 2.6 * 0.35**2 + mass * height**2)
    assert inertia >= 0.11 * (1.0 - 1e-12)


def test_a_payload_event_changes_nothing_before_and_is_a_payload_after():
    event = move(robot("wip", {"geometry/payload_event": {**LOAD, "t0": 0.2}}), LIVELY["wip"], T, COMMANDS)
    bare = move(robot("wip"), LIVELY["wip"], T, COMMANDS)
    np.testing.assert_array_equal(event.q[:51], bare.q[:51])
    after = move(robot("wip", {"geometry/payload": LOAD}), [*event.q[50], *event.v[50]], T[50:], COMMANDS[50:])
    # The restart forgets the acceleration that predicts the rate in its first mid-step: h^2/2 * 20 rad/s^2 of 1 ms.
    np.testing.assert_allclose(event.q[50:], after.q, atol=1e-4)
    assert np.max(np.abs(event.q[-1] - bare.q[-1])) > 1e-2


def test_a_payload_event_inside_a_step_counts_for_its_share():
    rows = []
    for t0 in (0.2, 0.2005, 0.201):
        event = robot("wip", {"geometry/payload_event": {**LOAD, "t0": t0}})
        rows.append(move(event, (0.0, 0.1, 0.0, 0.0), T[:76], COMMANDS[:75]).v[-1])
    # Mixed masses give nearly the mixed acceleration, so half a millisecond later lies in between.
    assert np.all(np.abs(rows[1] - 0.5 * (rows[0] + rows[2])) < 0.5 * np.abs(rows[2] - rows[0]))


def test_a_payload_event_on_a_tilted_rail_adds_its_weight_along_the_rail():
    effects = {
        "geometry/payload_event": {"mass": 1.0, "height": 0.0, "t0": 0.2},
        "environment/rail_tilt": {"angle": 0.1},
    }
    v = move(robot("linear_axis", effects), (0.0, 0.0), T).v[:, 0]
    # One kilogram more falls no faster down a slope.
    np.testing.assert_allclose(v, -9.81 * np.sin(0.1) * T, atol=1e-11)


def test_inertia_scales_the_bodys_inertia_about_its_centre_of_mass():
    scaled = move(robot("wip", {"geometry/inertia": {"scale": 1.7}}), LIVELY["wip"], T, COMMANDS)
    changed = move(robot("wip", changes={"body_inertia": 1.7 * 0.11}), LIVELY["wip"], T, COMMANDS)
    np.testing.assert_array_equal(scaled.q, changed.q)


@pytest.mark.parametrize(("site", "parameter"), [("translation", "wheel_mass"), ("pitch", "body_inertia")])
def test_rotor_inertia_of_a_wip_adds_to_the_diagonal(site: str, parameter: str):
    rotor = move(robot("wip", {f"{site}/rotor_inertia": {"J": 0.2}}), LIVELY["wip"], T, COMMANDS)
    heavier = move(robot("wip", changes={parameter: PARAMETERS["wip"][parameter] + 0.2}), LIVELY["wip"], T, COMMANDS)
    np.testing.assert_allclose(rotor.q, heavier.q, atol=1e-11)


@pytest.mark.parametrize("joint", [0, 1])
def test_rotor_inertia_of_a_double_pendulum_adds_to_its_own_diagonal_only(joint: int):
    model = robot("double_pendulum", {f"joint{joint + 1}/rotor_inertia": {"J": 0.04}})

    # The rotor takes J q'' of the torque, so M q'' = ... - J q'' with the true accelerations.
    def forces(row: int, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        rotor = np.zeros((2, 2))
        rotor[joint, joint] = 0.04
        with_rotor = np.linalg.solve(mass_matrix(model, q) + rotor, inner_forces(model, q, v))
        return -rotor @ with_rotor

    t = T[:76]
    exact = reference(model, LIVELY["double_pendulum"], t, forces)
    motion = move(model, LIVELY["double_pendulum"], t, simulator=AnalyticSimulator(2.5e-4))
    np.testing.assert_allclose(motion.q, exact.q, atol=2e-5)  # second order at 0.25 ms


def test_gravity_pulls_down_a_rail_that_rises_towards_plus_x():
    for angle in (0.2, -0.2):
        v = move(robot("linear_axis", {"environment/rail_tilt": {"angle": angle}}), (0.0, 0.0), T).v[:, 0]
        np.testing.assert_allclose(v, -9.81 * np.sin(angle) * T, atol=1e-11)


def test_a_wip_rests_upright_on_a_tilted_rail_under_the_force_of_its_weight():
    model = robot("wip", {"environment/rail_tilt": {"angle": 0.15}})
    weight = (2.6 + 1.2) * 9.81 * np.sin(0.15)
    held = move(model, np.zeros(4), T, np.full(150, weight))
    np.testing.assert_allclose(held.q, 0.0, atol=1e-12)  # theta is measured against gravity, not against the rail


def test_a_tilted_rail_couples_through_the_angle_to_the_rail():
    angle, model = 0.15, robot("wip", {"environment/rail_tilt": {"angle": 0.15}})
    arm = 2.6 * 0.35

    def forces(row: int, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        # What replaces the level coupling: M_t q'' = h_t, written as forces beside the level equations.
        level = mass_matrix(model, q)
        tilted = level.copy()
        tilted[0, 1] = tilted[1, 0] = -arm * np.cos(q[1] - angle)
        pull = np.array(
            [
                COMMANDS[row, 0] - arm * np.sin(q[1] - angle) * v[1] ** 2 - 3.8 * 9.81 * np.sin(angle),
                arm * 9.81 * np.sin(q[1]),
            ]
        )
        inner = np.array([-arm * np.sin(q[1]) * v[1] ** 2, arm * 9.81 * np.sin(q[1])])
        return level @ np.linalg.solve(tilted, pull) - inner

    exact = reference(model, LIVELY["wip"], T, forces)
    motion = move(model, LIVELY["wip"], T, COMMANDS, AnalyticSimulator(2.5e-4))
    np.testing.assert_allclose(motion.q, exact.q, atol=2e-5)  # second order at 0.25 ms


def test_a_spring_pulls_to_where_it_is_relaxed():
    model = robot("linear_axis", {"environment/spring": {"k": 40.0, "x0": 0.3}})
    t = np.linspace(0.0, 3.0, 301)
    x = move(model, (0.1, 0.0), t).q[:, 0]
    omega = np.sqrt(40.0 / 2.5)
    # Phase error omega^3 h^2 t / 24 at 1 ms.
    np.testing.assert_allclose(x, 0.3 - 0.2 * np.cos(omega * t), atol=0.2 * omega**3 * 1e-6 * 3.0 / 24.0 + 1e-9)
