"""Dry friction: true sticking, sliding against events located exactly, and no reversal."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from sim.robots import Motion, inner_forces, mass_matrix, move, robot, sines

from wipx.core.model import Model
from wipx.sim.analytic import AnalyticSimulator

SECOND = np.linspace(0.0, 1.0, 201)
LEVELS: dict[str, dict[str, float]] = {
    "coulomb": {"F_c": 1.0},
    "stribeck": {"F_c": 0.6, "F_s": 1.0, "v_s": 0.05},
    "asymmetric_coulomb": {"F_plus": 1.0, "F_minus": 1.0},
}


@pytest.mark.parametrize("friction", LEVELS)
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_joint_sticks_below_the_level_and_slides_above_it(friction: str, sense: float):
    model = robot("linear_axis", {f"translation/{friction}": LEVELS[friction]})
    held = move(model, (0.1, 0.0), SECOND, np.full(200, sense * 0.999))
    assert np.max(np.abs(held.v)) < 1e-12  # round-off of the impulses
    np.testing.assert_allclose(held.q, 0.1, rtol=0.0, atol=1e-12)
    slides = move(model, (0.1, 0.0), SECOND, np.full(200, sense * 1.001))
    assert np.all(sense * slides.v[1:] > 0.0)


def test_a_joint_sticks_by_its_level_in_each_direction():
    model = robot("linear_axis", {"translation/asymmetric_coulomb": {"F_plus": 1.0, "F_minus": 3.0}})
    assert move(model, (0.0, 0.0), SECOND, np.full(200, 1.1)).v[-1, 0] > 0.0
    assert abs(move(model, (0.0, 0.0), SECOND, np.full(200, -2.9)).v[-1, 0]) < 1e-12


def test_both_joints_of_a_wip_stick_at_once():
    model = robot("wip", {"translation/coulomb": {"F_c": 3.0}, "pitch/stribeck": {"F_c": 0.3, "F_s": 0.5, "v_s": 0.1}})
    # Gravity pulls with m_b g L sin(0.04) = 0.36 N m, the command with 2.5 N.
    held = move(model, (0.2, 0.04, 0.0, 0.0), SECOND, np.full(200, 2.5))
    assert np.max(np.abs(held.v)) < 1e-12
    np.testing.assert_allclose(held.q, [[0.2, 0.04]] * 201, rtol=0.0, atol=1e-12)


def test_both_joints_of_a_double_pendulum_stick_at_once():
    model = robot("double_pendulum", {"joint1/coulomb": {"F_c": 4.0}, "joint2/coulomb": {"F_c": 2.0}})
    held = move(model, (0.8, 0.5, 0.0, 0.0), SECOND, np.tile([0.3, -0.2], (200, 1)))
    assert np.max(np.abs(held.v)) < 1e-12


@pytest.mark.parametrize("stuck", [0, 1])
def test_one_joint_of_a_double_pendulum_slides_while_the_other_sticks(stuck: int):
    model = robot("double_pendulum", {f"joint{stuck + 1}/coulomb": {"F_c": 50.0}})
    motion = move(model, (0.5, 0.5, 0.0, 0.0), SECOND)
    assert np.max(np.abs(motion.v[:, stuck])) < 1e-12
    assert np.max(np.abs(motion.v[:, 1 - stuck])) > 0.5


@settings(max_examples=30)
@given(
    level=st.floats(0.01, 5.0),
    speed=st.floats(-2.0, 2.0),
    static=st.floats(1.0, 2.0),
    step=st.sampled_from([1e-3, 4e-3]),
)
def test_friction_stops_a_motion_and_never_reverses_it(level: float, speed: float, static: float, step: float):
    stribeck = {"F_c": level, "F_s": static * level, "v_s": 0.1}
    t = np.linspace(0.0, 3.0, 301)
    v = move(
        robot("linear_axis", {"translation/stribeck": stribeck}), (0.0, speed), t, simulator=AnalyticSimulator(step)
    ).v[:, 0]
    assert np.all(v * speed >= -1e-15)
    rests = t > 2.5 * abs(speed) / level + step  # mass 2.5 kg; the bump only stops it sooner
    assert np.max(np.abs(v[rests]), initial=0.0) < 1e-12


def test_a_stopped_carriage_has_gone_the_way_of_constant_deceleration():
    motion = move(robot("linear_axis", {"translation/coulomb": {"F_c": 2.0}}), (0.0, 1.0), SECOND * 2.0)
    # M v^2 / 2 F_c; the stop falls inside a step: v = F_c h / M is left open for up to h.
    assert motion.q[-1, 0] == pytest.approx(2.5 / 4.0, abs=2.0 / 2.5 * 1e-3**2)


def test_no_smoothing_has_no_creep_and_smoothing_creeps_at_its_speed():
    model = robot("linear_axis", {"translation/coulomb": {"F_c": 1.0}})
    t, half = np.linspace(0.0, 20.0, 401), np.full(400, 0.5)
    assert abs(move(model, (0.0, 0.0), t, half).q[-1, 0]) < 1e-12
    creeping = move(model, (0.0, 0.0), t, half, AnalyticSimulator(smoothing=(1e-3,)))
    assert creeping.v[-1, 0] == pytest.approx(0.5e-3, rel=1e-6)  # half the level, half the speed


@dataclass(frozen=True)
class CoulombJoint:
    """A robot whose first joint has Coulomb friction: slides up (mode 1), sticks (0), slides down (-1)."""

    model: Model
    level: float

    def accelerations(self, y: np.ndarray, u: float, mode: float) -> np.ndarray:
        n = len(self.model.plant.joints)
        matrix, pull = mass_matrix(self.model, y[:n]), self._pull(y, u, -mode * self.level)
        if mode:
            return np.linalg.solve(matrix, pull)
        free = np.zeros(n)  # the first joint held, the others free
        free[1:] = np.linalg.solve(matrix[1:, 1:], pull[1:])
        return free

    def needed(self, y: np.ndarray, u: float) -> float:
        """Friction force that would hold the first joint [N]."""
        n = len(self.model.plant.joints)
        inertial = mass_matrix(self.model, y[:n]) @ self.accelerations(y, u, 0.0)
        return float(inertial[0] - self._pull(y, u, 0.0)[0])

    def mode(self, y: np.ndarray, u: float) -> float:
        speed = y[len(self.model.plant.joints)]
        if speed == 0.0 and abs(self.needed(y, u)) > self.level:
            return float(-np.sign(self.needed(y, u)))
        return float(np.sign(speed))

    def _pull(self, y: np.ndarray, u: float, friction: float) -> np.ndarray:
        n = len(self.model.plant.joints)
        forces = inner_forces(self.model, y[:n], y[n:])
        forces[0] += u + friction
        return forces


def until_event(joint: CoulombJoint, y: np.ndarray, u: float, begin: float, end: float) -> tuple[float, np.ndarray]:
    """Time and state at `end`, or where the first joint stops or breaks loose before."""
    n, mode = len(y) // 2, joint.mode(y, u)

    def slope(_: float, s: np.ndarray) -> np.ndarray:
        return np.concatenate([s[n:], joint.accelerations(s, u, mode)])

    def event(_: float, s: np.ndarray) -> float:
        return s[n] * mode if mode else joint.level - abs(joint.needed(s, u))

    event.terminal, event.direction = True, -1.0
    solution = solve_ivp(slope, (begin, end), y, method="DOP853", rtol=1e-10, atol=1e-12, events=event)
    y = solution.y[:, -1].copy()
    if solution.status == 1:  # at a stop; or it breaks loose, in the sense of the force
        y[n] = 0.0 if mode else -1e-12 * np.sign(joint.needed(y, u))
    return float(solution.t[-1]), y


def coulomb_reference(model: Model, initial, t: np.ndarray, commands: np.ndarray, level: float) -> Motion:
    """Coulomb friction on the first joint, every stop and start of it located (`solve_ivp` events)."""
    n, joint = len(model.plant.joints), CoulombJoint(model, level)
    states = [np.array(initial, dtype=float)]
    for u, (now, end) in zip(commands[:, 0], pairwise(t), strict=True):
        y = states[-1]
        while now < end:
            now, y = until_event(joint, y, u, now, end)
        states.append(y)
    path = np.array(states)
    return Motion(t, path[:, :n], path[:, n:])


def test_sliding_through_reversals_follows_located_events_at_first_order():
    t = np.linspace(0.0, 2.0, 401)
    commands = 4.0 * np.sin(10.0 * t[:-1, None])
    start = (0.0, -4.0 / 2.5 / 10.0)  # the force is at its crest when the motion turns: no sticking
    exact = coulomb_reference(robot("linear_axis"), start, t, commands, 1.0)
    assert np.all(exact.v != 0.0)
    reversals = np.count_nonzero(np.diff(np.sign(exact.v[:, 0])))
    assert reversals > 5
    errors = []
    for step in (1e-3, 1e-4):
        motion = move(
            robot("linear_axis", {"translation/coulomb": {"F_c": 1.0}}), start, t, commands, AnalyticSimulator(step)
        )
        errors.append(np.max(np.abs(motion.v - exact.v)))
        # The step that holds a reversal has the friction of one side: at most 2 F_c h / M each time.
        assert errors[-1] <= 2.0 * 1.0 * step / 2.5 * reversals
    assert errors[1] < 0.5 * errors[0]  # a tenth of the step; where in the step the motion turns is chance


def test_sticking_and_breaking_loose_follow_located_events_exactly():
    t = np.linspace(0.0, 2.0, 401)
    commands = sines(t, 4.0)
    exact = coulomb_reference(robot("linear_axis"), (0.0, 0.0), t, commands, 4.0)
    assert 50 < np.count_nonzero(exact.v[:, 0]) < 350
    motion = move(robot("linear_axis", {"translation/coulomb": {"F_c": 4.0}}), (0.0, 0.0), t, commands)
    # Stops end in rest wherever they fall in a step, and it breaks loose with a command: round-off is left.
    np.testing.assert_allclose(motion.v, exact.v, atol=1e-12)


def test_a_falling_wip_with_wheels_that_stick_and_slide_follows_located_events():
    t = np.linspace(0.0, 0.6, 121)
    commands = sines(t, 5.0)
    exact = coulomb_reference(robot("wip"), (0.0, 0.02, 0.0, 0.0), t, commands, 3.0)
    assert np.any(exact.v[1:, 0] == 0.0)
    assert np.any(exact.v[1:, 0] != 0.0)
    motion = move(
        robot("wip", {"translation/coulomb": {"F_c": 3.0}}),
        (0.0, 0.02, 0.0, 0.0),
        t,
        commands,
        AnalyticSimulator(2.5e-4),
    )
    # 2 F_c h / M = 4e-4 m/s per reversal (M11 = 4.4 kg), grown by exp(6/s * 0.6 s) as the body falls.
    np.testing.assert_allclose(motion.v, exact.v, atol=1e-2)
    np.testing.assert_allclose(motion.q, exact.q, atol=1e-3)


def test_a_sticky_spot_brakes_inside_its_stretch_only():
    model = robot("linear_axis", {"translation/sticky_spot": {"F_c": 1.0, "lo": 0.1, "hi": 0.2}})
    motion = move(model, (0.0, 1.0), np.linspace(0.0, 0.5, 501))
    x, v = motion.q[:, 0], motion.v[:, 0]
    np.testing.assert_allclose(v[x < 0.1], 1.0, atol=1e-12)
    # Work F_c * 0.1 m of the energy; the share of a step at either end is exact to the deceleration within it.
    np.testing.assert_allclose(v[x > 0.2], np.sqrt(1.0 - 2.0 * 0.1 / 2.5), atol=1e-5)
    inside = move(model, (0.15, 0.0), SECOND, np.full(200, 0.9))
    outside = move(model, (0.25, 0.0), SECOND, np.full(200, 0.9))
    assert np.max(np.abs(inside.v)) < 1e-12
    assert outside.v[-1, 0] == pytest.approx(0.9 / 2.5, rel=1e-9)


def test_load_friction_grows_with_the_force_of_the_motor():
    model = robot("linear_axis", {"translation/load_friction": {"K_motor": 0.2, "K_external": 0.0}})
    motion = move(model, (0.0, 0.0), SECOND, np.full(200, 3.0))
    assert motion.v[-1, 0] == pytest.approx(0.8 * 3.0 / 2.5, rel=1e-9)


def test_load_friction_holds_a_load_within_its_cone():
    # At rest the motor's u and gravity G: friction abs(K_e G - K_m u) must cover abs(G + u).
    weight = 0.8 * 9.81 * 0.45 * np.sin(0.3)
    for k, holds in ((1.05, True), (0.95, False)):
        model = robot("pendulum", {"pitch/load_friction": {"K_motor": 0.0, "K_external": k}})
        assert (np.max(np.abs(move(model, (0.3, 0.0), SECOND).v)) < 1e-12) == holds
        both = robot("pendulum", {"pitch/load_friction": {"K_motor": 0.1 * k, "K_external": 0.1 * k}})
        u = -weight * (1.0 - 0.195)  # sliding down is resisted by 0.1 k (1 + 0.805)
        moved = move(both, (0.3, 0.0), SECOND, np.full(200, u)).v
        assert (np.max(np.abs(moved)) < 1e-12) == (0.1 * k * 1.805 > 0.195)
