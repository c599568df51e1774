"""A run of a robot: sensors, controller and motion, instant by instant."""

import math
from typing import NamedTuple

import numpy as np

from wipx.proof.blind_robots.compiled import equation, kept
from wipx.proof.blind_robots.trees.dynamics import Body, dynamics
from wipx.proof.blind_robots.trees.engine import interval
from wipx.proof.blind_robots.trees.records import DRIVE, ROWS, Q, V


class Control(NamedTuple):
    """The controller of a robot: weight and inertia of the owner's model, proportional and derivative feedback.

    A position drive gets the reference as its target; it has a loop of its own.

    Attributes:
        body: Links as the owner has them.
        stiffness: Shape (joints,) [N m/rad or N/m].
        damping: Shape (joints,).
        inertia: That is moved along the reference, shape (joints,).
        limit: Of the commanded forces, shape (joints,).
        cutoff: Of the filter of differenced coordinates [Hz].
        bounds: Lowest and highest position, shape (joints, 2); beyond them the run is void.
    """

    body: Body
    stiffness: np.ndarray
    damping: np.ndarray
    inertia: np.ndarray
    limit: np.ndarray
    cutoff: float
    bounds: np.ndarray


class Plan(NamedTuple):
    """What a run is made of beside the robot.

    Attributes:
        instants: Of the controller, shape (n + 1,) [s].
        reference: Positions, rates and accelerations, shape (n, 3, joints).
        extra: Added to the commanded forces, shape (n, joints).
        noise: Of the sensors, shape (n, joints).
        resolution: Of the sensors, shape (joints,); 0 for none.
    """

    instants: np.ndarray
    reference: np.ndarray
    extra: np.ndarray
    noise: np.ndarray
    resolution: np.ndarray


@equation
def late(instants, places, rates, k, when):
    """A coordinate at an earlier time, by the cubic through places and rates at the instants up to k."""
    i = k
    while i > 0 and instants[i] > when:
        i -= 1
    if i == k or when <= instants[0]:
        return places[i]
    h = instants[i + 1] - instants[i]
    s = (when - instants[i]) / h
    ends = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * places[i] + s * s * (3.0 - 2.0 * s) * places[i + 1]
    return ends + h * s * (1.0 - s) * ((1.0 - s) * rates[i] - s * rates[i + 1])


@equation
def sense(k, c, plan, places, rates, r):
    """What the sensor of joint c shows at instant k: late, scaled, biased, noisy, in steps."""
    true = late(plan.instants, places[:, c], rates[:, c], k, plan.instants[k] - r.sensor_delay)
    shown = (1.0 + r.sensor_scale) * true + r.sensor_bias + plan.noise[k, c]
    step = plan.resolution[c]
    return step * math.floor(shown / step + 0.5) if step > 0.0 else shown


@kept
def simulate(body, joints, cable, visible, control, plan, start, step, w, own):
    """Let a robot follow a plan.

    Args:
        body: Links as they are, `dynamics.Body`.
        joints: Records, shape (N,) of `records.JOINT`.
        cable: Record of `records.CABLE`.
        visible: Numbers of the joints that the owner knows, shape (joints,).
        control: The controller.
        plan: What is to be done.
        start: Coordinates at rest, shape (N,).
        step: Longest step of the integration [s].
        w: Room for the robot, `engine.workplace`.
        own: Room for the owner's model.

    Returns:
        Instants before a joint left its bounds (n if none did); and, of shape (n, joints): positions as shown, true
        positions, true rates, commands, and mean forces of the motors until the next instant.
    """
    n, count, total = len(plan.instants) - 1, len(visible), len(joints)
    shown, places, rates = np.zeros((n, count)), np.zeros((n, count)), np.zeros((n, count))
    commands, forces = np.zeros((n, count)), np.zeros((n, count))
    y, mode, impulse = np.zeros((ROWS, total)), np.zeros(total, np.int64), np.zeros(total)
    y[Q], y[DRIVE] = start, start
    w.due[:] = -1.0
    active, rate, still = np.full(count, -1), np.zeros(count), np.zeros(count)
    for k in range(n):
        for c in range(count):
            j = visible[c]
            places[k, c], rates[k, c] = y[Q, j], y[V, j]
            if not control.bounds[c, 0] <= y[Q, j] <= control.bounds[c, 1]:
                return k, shown, places, rates, commands, forces
            shown[k, c] = sense(k, c, plan, places, rates, joints[j])
            if k > 0:
                h = plan.instants[k] - plan.instants[k - 1]
                slope = (shown[k, c] - shown[k - 1, c]) / h
                rate[c] += (1.0 - math.exp(-2.0 * math.pi * control.cutoff * h)) * (slope - rate[c])
        dynamics(shown[k], still, control.body, own.space, own.helper)
        for c in range(count):
            r = joints[visible[c]]
            place, speed, push = plan.reference[k, 0, c], plan.reference[k, 1, c], plan.reference[k, 2, c]
            if r.servo:
                commands[k, c] = place
            elif r.driven:
                force = own.space.bias[c] + control.inertia[c] * push + plan.extra[k, c]
                force += control.stiffness[c] * (place - shown[k, c]) + control.damping[c] * (speed - rate[c])
                commands[k, c] = min(max(force, -control.limit[c]), control.limit[c]) / r.input_gain
        impulse[:] = 0.0
        interval(y, k, plan.instants, commands, active, mode, body, joints, cable, visible, step, w, impulse)
        for c in range(count):
            forces[k, c] = impulse[visible[c]] / (plan.instants[k + 1] - plan.instants[k])
    return n, shown, places, rates, commands, forces
