"""Motion of a tree between two instants: fourth-order Runge-Kutta steps, cut where a joint stops or lets go."""

import math
from typing import NamedTuple

import numpy as np

from wipx.proof.blind_robots.compiled import equation
from wipx.proof.blind_robots.trees.dynamics import Space, dynamics, room, solve
from wipx.proof.blind_robots.trees.forces import level, motor, passed_on, servo_force, smooth_force
from wipx.proof.blind_robots.trees.records import DRIVE, DRIVE_RATE, ELEMENT, ELEMENTS, LAGGED, ROWS, Q, V

SMALLEST_SHARE = 1e-3  # of a step, between two events
MOST_EVENTS = 20  # in one step; joints that chatter more are advanced regardless


class Work(NamedTuple):
    """Room for the motion of N links.

    Attributes:
        space: Of the rigid body.
        helper: Two matrices.
        slopes: Rates of the state, four times, shape (4, ROWS, N).
        middle: A state, shape (ROWS, N).
        new: A state.
        forces: On the joints, shape (N,).
        drives: Forces of the drives on the joints, shape (N,).
        motors: Forces of the motors, shape (N,).
        loads: Forces of gravity, velocities and springs, shape (N,).
        holds: Forces that hold sticking joints, shape (N,).
        accelerations: Shape (N,).
        lower: Triangle of the factorised mass matrix, shape (N, N).
        stuck: Whether each joint sticks, shape (N,).
        mean: Mean forces of the motors over a step, shape (N,).
        inputs: Of the drives, shape (N,).
        due: When the loop of each drive is next run, shape (N,) [s].
    """

    space: Space
    helper: np.ndarray
    slopes: np.ndarray
    middle: np.ndarray
    new: np.ndarray
    forces: np.ndarray
    drives: np.ndarray
    motors: np.ndarray
    loads: np.ndarray
    holds: np.ndarray
    accelerations: np.ndarray
    lower: np.ndarray
    stuck: np.ndarray
    mean: np.ndarray
    inputs: np.ndarray
    due: np.ndarray


def workplace(n: int) -> Work:
    """Room for n links."""
    line, state = np.zeros((9, n)), np.zeros((2, ROWS, n))
    return Work(
        space=room(n),
        helper=np.zeros((2, 3, 3)),
        slopes=np.zeros((4, ROWS, n)),
        middle=state[0],
        new=state[1],
        forces=line[0],
        drives=line[1],
        motors=line[2],
        loads=line[3],
        holds=line[4],
        accelerations=line[5],
        lower=np.zeros((n, n)),
        stuck=np.zeros(n, np.int64),
        mean=line[6],
        inputs=line[7],
        due=line[8],
    )


@equation
def derivative(y, mode, body, joints, cable, w, out):
    """Fill in the rates of a state, the forces that hold sticking joints, and those of motors and drives."""
    n = len(joints)
    dynamics(y[Q], y[V], body, w.space, w.helper)
    out[:] = 0.0
    for j in range(n):
        r = joints[j]
        w.space.matrix[j, j] += r.armature
        w.motors[j], w.drives[j] = 0.0, 0.0
        if r.driven:
            w.motors[j], out[LAGGED, j] = motor(j, y, w.inputs[j], r)
            w.drives[j], out[DRIVE_RATE, j] = passed_on(j, y, w.motors[j], r)
            out[DRIVE, j] = y[DRIVE_RATE, j]
        w.loads[j] = -r.spring * (y[Q, j] - r.spring_rest) - w.space.bias[j]
        w.forces[j] = w.drives[j] - w.space.bias[j] + smooth_force(j, y, out, r)
    pull(y, cable, w.forces)
    for j in range(n):
        r = joints[j]
        w.stuck[j] = 0
        if r.dry:
            w.stuck[j] = 1 if mode[j] == 0 else 0
            if mode[j] != 0:
                w.forces[j] -= mode[j] * level(j, y, abs(y[V, j]), mode[j], w.drives[j], w.loads[j], r)
    solve(w.space.matrix, w.forces, w.stuck, w.lower, w.accelerations)
    for j in range(n):
        out[Q, j], out[V, j] = y[V, j], w.accelerations[j]
        w.holds[j] = 0.0
        if w.stuck[j]:
            total = -w.forces[j]
            for k in range(n):
                total += w.space.matrix[j, k] * w.accelerations[k]
            w.holds[j] = total


@equation
def pull(y, cable, forces):
    """Add the pull of a cable between two joints, which only pulls while it is taut."""
    if cable.stiffness == 0.0:
        return
    i, j = cable.first, cable.second
    stretch = cable.first_arm * y[Q, i] + cable.second_arm * y[Q, j] - cable.slack
    if stretch <= 0.0:
        return
    rate = cable.first_arm * y[V, i] + cable.second_arm * y[V, j]
    tension = max(0.0, cable.stiffness * stretch + cable.damping * rate)
    forces[i] -= cable.first_arm * tension
    forces[j] -= cable.second_arm * tension


@equation
def let_go(y, mode, body, joints, cable, w):
    """Let the sticking joints go whose holding force exceeds the static level, the most overloaded one first."""
    for _ in range(len(joints)):
        derivative(y, mode, body, joints, cable, w, w.slopes[0])
        worst, most = -1, 0.0
        for j in range(len(joints)):
            if w.stuck[j]:
                direction = -1 if w.holds[j] > 0.0 else 1
                allowed = level(j, y, 0.0, direction, w.drives[j], w.loads[j], joints[j])
                excess = (abs(w.holds[j]) - allowed) / max(allowed, 1e-12)
                if excess > most:
                    worst, most = j, excess
        if worst < 0:
            return
        mode[worst] = -1 if w.holds[worst] > 0.0 else 1


@equation
def runge_kutta(y, step, mode, body, joints, cable, w):
    """Advance a state by one step in a fixed mode into `w.new`; mean forces of the motors in `w.mean`."""
    w.mean[:] = 0.0
    w.new[:] = y
    w.middle[:] = y
    for stage in range(4):  # one call, which keeps the compilation short
        slope = w.slopes[stage]
        derivative(w.middle, mode, body, joints, cable, w, slope)
        weight = (1.0 if stage in (0, 3) else 2.0) / 6.0
        w.mean[:] += weight * w.motors
        w.new[:] += weight * step * slope
        w.middle[:] = y + (step if stage == 2 else 0.5 * step) * slope
    for j in range(len(joints)):
        if joints[j].hysteresis > 0.0:
            for e in range(ELEMENTS):
                way = joints[j].hysteresis_way * (e + 1.0) / ELEMENTS
                w.new[ELEMENT + e, j] = min(max(w.new[ELEMENT + e, j], -way), way)


@equation
def first_stop(y, new, mode, joints):
    """Part of the step after which the first slipping joint comes to rest, and that joint; (1, -1) if none does."""
    share, stopped = 1.0, -1
    for j in range(len(joints)):
        if joints[j].dry and mode[j] != 0 and new[V, j] * mode[j] < 0.0:
            before = max(y[V, j] * mode[j], 0.0)
            found = max(before / (before - new[V, j] * mode[j]), SMALLEST_SHARE)
            if found < share:
                share, stopped = found, j
    return share, stopped


@equation
def advance(y, step, mode, body, joints, cable, w, impulse):
    """Advance a state over a step, event by event; `impulse` gathers the motors' forces times time."""
    done = 0.0
    for event in range(MOST_EVENTS):
        for j in range(len(joints)):
            if joints[j].dry and mode[j] == 0:
                let_go(y, mode, body, joints, cable, w)
                break
        left, stopped = step - done, -1
        for attempt in range(2):  # the second one ends where the first joint stops
            runge_kutta(y, left, mode, body, joints, cable, w)
            if attempt == 1 or event == MOST_EVENTS - 1:
                break
            share, stopped = first_stop(y, w.new, mode, joints)
            if stopped < 0:
                break
            left *= share
        y[:] = w.new
        impulse += w.mean * left
        done += left
        if stopped < 0:
            return
        y[V, stopped] = 0.0
        mode[stopped] = 0


@equation
def interval(y, k, instants, commands, active, mode, body, joints, cable, visible, step, w, impulse):
    """Advance a state from instant k to the next under the delayed commands.

    Args:
        y: State, shape (ROWS, N); overwritten.
        k: Number of the instant.
        instants: Shape (n + 1,) [s].
        commands: Up to that instant, shape (n, joints).
        active: Command that acts on each joint, shape (joints,); -1 before the first, which acts then; overwritten.
        mode: Shape (N,); overwritten.
        body: Links.
        joints: Records, shape (N,).
        cable: Record.
        visible: Numbers of the joints that the owner knows, shape (joints,).
        step: Longest step [s].
        w: Room.
        impulse: Shape (N,); what the motors' forces amount to is added.
    """
    t, end = instants[k], instants[k + 1]
    while t < end - 1e-12:
        stop = min(end, t + step)
        for c in range(len(visible)):
            j = visible[c]
            r = joints[j]
            if not r.driven:
                continue
            while active[c] < k and instants[active[c] + 1] + r.delay <= t + 1e-12:
                active[c] += 1
            if active[c] < k:
                stop = min(stop, instants[active[c] + 1] + r.delay)
            command = r.input_gain * commands[max(active[c], 0), c]
            if not (r.servo and r.servo_period > 0.0):
                w.inputs[j] = command
                continue
            if t >= w.due[j] - 1e-9:
                w.inputs[j] = servo_force(command, y[Q, j], y[V, j], r)
                w.due[j] = r.servo_period * (math.floor((t + 1e-9) / r.servo_period) + 1.0)
            stop = min(stop, w.due[j])
        advance(y, stop - t, mode, body, joints, cable, w, impulse)
        t = stop
