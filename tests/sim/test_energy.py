"""Energy: conserved by the rigid body, never produced by friction."""

import numpy as np
import pytest
from sim.robots import LIVELY, PARAMETERS, energy, move, robot

from wipx.core.effect import JOINT_SITES, Effect
from wipx.core.plant import PLANTS
from wipx.effects.catalogue import kinds, vocabulary
from wipx.sim.analytic import AnalyticSimulator

FRICTION = {
    "viscous": {"sigma": 0.3},
    "coulomb": {"F_c": 0.2},
    "asymmetric_coulomb": {"F_plus": 0.1, "F_minus": 0.3},
    "stribeck": {"F_c": 0.2, "F_s": 0.4, "v_s": 0.1},
    "presliding": {"F_c": 0.2, "stiffness": 2000.0},
    "lugre": {"F_c": 0.2, "F_s": 0.3, "v_s": 0.1, "stiffness": 2000.0, "damping": 0.5},
    "hysteresis": {"F_c": 0.2, "stiffness": 2000.0, "damping": 0.0, "n": 2.0, "gamma": 0.3},
    "quadratic_drag": {"c": 0.2},
    "sticky_spot": {"F_c": 0.5, "lo": 0.0, "hi": 0.2},
    "load_friction": {"K_motor": 0.2, "K_external": 0.1},
    "lagged_stribeck": {"F_s": 0.4, "F_c": 0.2, "v_s": 0.1, "sigma": 0.1, "epsilon": 1e-3, "alpha": 1.0},
}
STORING = ("rotor_inertia", "resonance", "remainder")  # act at a joint and are no friction
AT_JOINTS = [
    (kind, name)
    for kind in PLANTS
    for name in vocabulary(PLANTS[kind])
    if name.partition("/")[0] in PLANTS[kind].joints
]
FRICTION_AT_JOINTS = [(kind, name) for kind, name in AT_JOINTS if name.partition("/")[2] not in STORING]
# A bristle gives back what it has stored: at most F_s^2 / (2 stiffness).
SPRING_BACK = {"presliding": 0.2**2 / 4000.0, "hysteresis": 0.2**2 / 4000.0, "lugre": 0.3**2 / 4000.0}
TWO_SECONDS = np.linspace(0.0, 2.0, 501)  # rows of 4 ms: whole numbers of steps of 1 and 2 ms


@pytest.mark.parametrize("kind", PARAMETERS)
def test_energy_is_conserved_without_friction_and_command(kind: str):
    model = robot(kind)
    drifts = []
    for step in (2e-3, 1e-3):
        e = energy(model, move(model, LIVELY[kind], TWO_SECONDS, simulator=AnalyticSimulator(step)))
        drifts.append(np.max(np.abs(e - e[0])))
    assert drifts[1] < 1e-4 * 10.0  # of some 10 J that swing to and fro; second order at 1 ms
    if drifts[1] > 1e-12:  # a linear axis is exact
        assert drifts[0] / drifts[1] == pytest.approx(4.0, rel=0.25)  # shrinks with the step squared


def test_every_effect_at_a_joint_is_held_to_dissipate():
    at_joints = {name.partition("/")[2] for _, name in AT_JOINTS}
    assert at_joints == {*FRICTION, *STORING}


@pytest.mark.parametrize("kind", PLANTS)
def test_friction_dissipates(kind: str):
    bare = robot(kind)
    # The integrator itself lets the energy breathe, as far as it does without friction.
    breathing = 1.5 * np.ptp(energy(bare, move(bare, LIVELY[kind], TWO_SECONDS)))
    for name in (name for plant, name in FRICTION_AT_JOINTS if plant == kind):
        friction = name.partition("/")[2]
        e = energy(bare, move(robot(kind, {name: FRICTION[friction]}), LIVELY[kind], TWO_SECONDS))
        rise = np.max(e - np.minimum.accumulate(e))
        assert rise <= breathing + SPRING_BACK.get(friction, 0.0) + 1e-12, name
        if not (kind == "linear_axis" and friction == "load_friction"):  # a level axis carries no load
            assert e[-1] < e[0] - 1e-3, name


@pytest.mark.parametrize("friction", FRICTION)
def test_friction_alone_never_raises_the_speed_of_a_carriage(friction: str):
    # Without gravity nothing breathes: only round-off and a bristle's spring are left.
    model = robot("linear_axis", {f"translation/{friction}": FRICTION[friction]})
    e = energy(model, move(model, LIVELY["linear_axis"], TWO_SECONDS))
    assert np.all(e - np.minimum.accumulate(e) <= SPRING_BACK.get(friction, 0.0) + 1e-15)


def test_every_effect_with_a_law_of_friction_acts_at_every_joint():
    everywhere = set(JOINT_SITES)
    one_place = {"sticky_spot"}  # a place on the rail
    joint_effects: list[Effect] = [kinds()[kind] for kind in FRICTION if kind not in one_place]
    assert all(set(effect.sites) == everywhere for effect in joint_effects)
