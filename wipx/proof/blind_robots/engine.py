"""A run of a robot: the controller at its instants, and fourth-order Runge-Kutta steps with events in between.

State y: coordinates q0, q1 and the moving mass's (0-2), their rates (3-5), lag (6, 7), bristles (8, 9), elements of
the hysteresis (10-12, 13-15), the free drive's place and speed (16, 17). Mode of a joint: 0 sticks, +1 or -1 the
direction in which it slips. Inputs: forces asked of the drives (0, 1), and waves, which the robot's record scales:
forces from outside (2, 3), wandering of the friction (4, 5).
"""

import math

import numpy as np

from wipx.proof.blind_robots.compiled import equation, kept
from wipx.proof.blind_robots.drive import coupled, motor, static_part
from wipx.proof.blind_robots.friction import bristle, hysteresis, slipping_force, static_level
from wipx.proof.blind_robots.motion import accelerate, cart_and_body, sliding_mass, smooth_forces, two_links

STATES = 18
INPUTS = 6
STEP = 1e-4  # [s]
SMALLEST_SHARE = 1e-3  # of a step, between two events
MOST_EVENTS = 12  # in one step; a joint that chatters more is advanced regardless


@equation
def derivative(y, t, inputs, mode, r, rates):
    """Fill `rates` with dy/dt; returns the holding forces of sticking joints and the drives' forces."""
    if r.chain:
        m00, m01, m11, f0, f1 = two_links(y, r)
    else:
        m00, m01, m11, f0, f1 = cart_and_body(y, t >= r.event_time, r)
    s0, s1 = smooth_forces(y, inputs, r)
    b0, rates[8] = bristle(0, y, inputs, r)
    b1, rates[9] = bristle(1, y, inputs, r)
    h0, h1 = hysteresis(0, y, r, rates), hysteresis(1, y, r, rates)
    drive0, drive1, rates[17] = 0.0, 0.0, 0.0
    if r.driven[0]:
        force, rates[6] = motor(0, y, inputs[0], r)
        drive0, rates[17] = coupled(y, force, r)
    if r.driven[1]:
        drive1, rates[7] = motor(1, y, inputs[1], r)
    f0 += s0 + b0 + h0 + drive0 + slipping_force(0, y, inputs, mode[0], r)
    f1 += s1 + b1 + h1 + drive1 + slipping_force(1, y, inputs, mode[1], r)
    hold0, hold1 = joint_rates(y, m00, m01, m11, f0, f1, mode, r, rates)
    rates[16] = y[17]
    return hold0, hold1, drive0, drive1


@equation
def joint_rates(y, m00, m01, m11, f0, f1, mode, r, rates):
    """Fill in coordinates' and rates' derivatives; the moving mass is eliminated first, for it never sticks."""
    stuck0 = r.locked[0] or (r.dry[0] and mode[0] == 0)
    stuck1 = r.locked[1] or (r.dry[1] and mode[1] == 0)
    m02, m12, m22, f2 = 0.0, 0.0, 1.0, 0.0
    if r.aux_mass > 0.0:
        a00, a01, a11, g0, g1, m02, m12, f2 = sliding_mass(y, r)
        m22 = r.aux_mass
        m00, m01, m11 = m00 + a00 - m02 * m02 / m22, m01 + a01 - m02 * m12 / m22, m11 + a11 - m12 * m12 / m22
        f0, f1 = f0 + g0 - m02 / m22 * f2, f1 + g1 - m12 / m22 * f2
    rates[3], rates[4], hold0, hold1 = accelerate(m00, m01, m11, f0, f1, stuck0, stuck1)
    rates[5] = (f2 - m02 * rates[3] - m12 * rates[4]) / m22
    rates[0], rates[1], rates[2] = y[3], y[4], y[5]
    return hold0, hold1


@equation
def release(y, t, inputs, mode, r, rates):
    """Let go the sticking joints whose holding force exceeds the static level, the more overloaded one first."""
    for _ in range(2):
        hold0, hold1, _d0, _d1 = derivative(y, t, inputs, mode, r, rates)
        excess0 = overload(0, y, inputs, hold0, mode, r)
        excess1 = overload(1, y, inputs, hold1, mode, r)
        if excess0 <= 0.0 and excess1 <= 0.0:
            return
        if excess0 >= excess1:
            mode[0] = -1 if hold0 > 0.0 else 1
        else:
            mode[1] = -1 if hold1 > 0.0 else 1


@equation
def overload(joint, y, inputs, hold, mode, r):
    """By how much the holding force of a sticking joint exceeds its static level; -1 if it does not stick."""
    if mode[joint] != 0 or not r.dry[joint] or r.locked[joint]:
        return -1.0
    direction = -1 if hold > 0.0 else 1
    return abs(hold) - static_level(joint, y, inputs, direction, r)


@equation
def runge_kutta(y, t, step, inputs, mode, r, work):
    """Advance y by one step in a fixed mode into work[5]; returns the drives' mean forces."""
    k1, k2, k3, k4, mid, new = work[0], work[1], work[2], work[3], work[4], work[5]
    _a, _b, p0, p1 = derivative(y, t, inputs, mode, r, k1)
    for i in range(STATES):
        mid[i] = y[i] + 0.5 * step * k1[i]
    _a, _b, q0, q1 = derivative(mid, t + 0.5 * step, inputs, mode, r, k2)
    for i in range(STATES):
        mid[i] = y[i] + 0.5 * step * k2[i]
    _a, _b, s0, s1 = derivative(mid, t + 0.5 * step, inputs, mode, r, k3)
    for i in range(STATES):
        mid[i] = y[i] + step * k3[i]
    _a, _b, e0, e1 = derivative(mid, t + step, inputs, mode, r, k4)
    for i in range(STATES):
        new[i] = y[i] + step / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
    return (p0 + 2.0 * q0 + 2.0 * s0 + e0) / 6.0, (p1 + 2.0 * q1 + 2.0 * s1 + e1) / 6.0


@equation
def share_to_stop(y, new, mode, r):
    """Part of the step after which the first slipping joint comes to rest: (share, joint); (1, -1) if none does."""
    share, joint = 1.0, -1
    for j in range(2):
        if r.dry[j] and mode[j] != 0 and new[3 + j] * mode[j] < 0.0:
            before = max(y[3 + j] * mode[j], 0.0)
            found = max(before / (before - new[3 + j] * mode[j]), SMALLEST_SHARE)
            if found < share:
                share, joint = found, j
    return share, joint


@equation
def advance(y, t, step, inputs, mode, r, work, impulse):
    """Advance y over a step, event by event; `impulse` gathers the drives' forces times time."""
    done = 0.0
    for event in range(MOST_EVENTS):
        if (r.dry[0] and mode[0] == 0) or (r.dry[1] and mode[1] == 0):
            release(y, t + done, inputs, mode, r, work[0])
        left = step - done
        d0, d1 = runge_kutta(y, t + done, left, inputs, mode, r, work)
        share, joint = share_to_stop(y, work[5], mode, r)
        if joint >= 0 and event < MOST_EVENTS - 1:
            left *= share
            d0, d1 = runge_kutta(y, t + done, left, inputs, mode, r, work)
        y[:] = work[5]
        impulse[0] += d0 * left
        impulse[1] += d1 * left
        done += left
        if joint < 0:
            return
        y[3 + joint] = 0.0
        mode[joint] = 0


@equation
def late(instants, places, speeds, k, when):
    """A coordinate at an earlier time, by the cubic through places and speeds at the instants up to k.

    Before the first instant the robot was held where it began.
    """
    if when <= instants[0]:
        return places[0]
    i = k
    while i > 0 and instants[i] > when:
        i -= 1
    if i == k:
        return places[k]
    h = instants[i + 1] - instants[i]
    s = (when - instants[i]) / h
    bend = (1.0 + 2.0 * s) * (1.0 - s) ** 2 * places[i] + s * s * (3.0 - 2.0 * s) * places[i + 1]
    return bend + h * s * (1.0 - s) * ((1.0 - s) * speeds[i] - s * speeds[i + 1])


@equation
def read_sensor(j, k, instants, q, v, noise, resolution, r):
    """What the sensor of joint j shows at instant k: late, eccentric, scaled, biased, noisy, in steps."""
    true = late(instants, q[:, j], v[:, j], k, instants[k] - r.sensor_delay[j])
    if r.wobble[j] != 0.0:
        true += r.wobble[j] * math.sin(r.wobble_number[j] * true + r.wobble_phase[j])
    shown = (1.0 + r.sensor_scale[j]) * true + r.sensor_bias[j] + noise[k, j]
    if resolution[j] > 0.0:
        shown = resolution[j] * math.floor(shown / resolution[j] + 0.5)
    return shown


@equation
def interval(y, k, instants, commands, waves, active, mode, r, work, impulse):
    """Advance y from instant k to the next under the delayed commands; returns the command that is now active."""
    t, end = instants[k], instants[k + 1]
    inputs = work[6]
    for i in range(INPUTS - 2):
        inputs[2 + i] = waves[k, i]
    while t < end - 1e-12:
        while active < k and instants[active + 1] + r.delay <= t + 1e-12:
            active += 1
        stop = min(end, t + STEP)
        if active < k:
            stop = min(stop, instants[active + 1] + r.delay)
        if t < r.event_time < stop:
            stop = r.event_time
        for j in range(2):
            command = commands[active, j] if active >= 0 else 0.0
            inputs[j] = static_part(command, t, r)
        advance(y, t, stop - t, inputs, mode, r, work, impulse)
        t = stop
    return active


@kept
def simulate(r, start, instants, reference, extra, waves, noise, rate_noise, gyro, resolution, gains, cutoff, limit):
    """Drive a robot in closed loop: u = -K (q - q_ref) + extra at every control instant.

    Args:
        r: Record of the robot.
        start: Coordinates at rest, shape (2,) [m, rad].
        instants: Control instants, shape (n + 1,) [s].
        reference: Of coordinates and rates, shape (n, 4).
        extra: Added to the commands, shape (n, 2) [N or N m].
        waves: Of unit variance, held between instants: forces from outside and wandering of friction, shape (n, 4).
        noise: Of the sensors, shape (n, 2).
        rate_noise: Of the rate sensors, shape (n, 2).
        gyro: Whether the controller has a rate sensor, by joint, shape (2,).
        resolution: Of the sensors, shape (2,); 0 for none.
        gains: K, shape (2, 4).
        cutoff: Of the filter of differenced coordinates [Hz].
        limit: Coordinates beyond which the robot has fallen, shape (2,).

    Returns:
        Number of instants before it fell (n if it did not), and arrays of shape (n, 2): coordinates as the sensors
        show them, true coordinates, true rates, commands, and the drives' mean forces until the next instant; and the
        whole states, shape (n, STATES).
    """
    n = len(instants) - 1
    q, v, shown, forces = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, 2))
    commands, states = extra.copy(), np.zeros((n, STATES))
    y, work, impulse = np.zeros(STATES), np.zeros((7, STATES)), np.zeros(2)
    mode, rate = np.zeros(2, np.int64), np.zeros(2)
    y[0], y[1] = start[0], start[1]
    y[16] = y[0]
    active = -1
    for k in range(n):
        if abs(y[0]) > limit[0] or abs(y[1]) > limit[1] or not math.isfinite(y[0] + y[1]):
            return k, shown, q, v, commands, forces, states
        states[k] = y
        q[k], v[k] = y[0:2], y[3:5]
        if r.traction > 0.0 or r.belt_motor_side > 0.0:  # the encoder sits on the wheel that slips, or before the belt
            q[k, 0], v[k, 0] = y[16], y[17]
        feel(k, instants, q, v, shown, rate, noise, rate_noise, gyro, resolution, cutoff, r)
        feed_back(k, shown, rate, reference, gains, r, commands)
        impulse[:] = 0.0
        active = interval(y, k, instants, commands, waves, active, mode, r, work, impulse)
        forces[k] = impulse / (instants[k + 1] - instants[k])
    return n, shown, q, v, commands, forces, states


@equation
def feel(k, instants, q, v, shown, rate, noise, rate_noise, use_gyro, resolution, cutoff, r):
    """Read the sensors at instant k and update the controller's estimate of the rates."""
    for j in range(2):
        if r.locked[j]:
            continue
        shown[k, j] = read_sensor(j, k, instants, q, v, noise, resolution, r)
        if use_gyro[j]:
            rate[j] = v[k, j] + rate_noise[k, j]
        elif k > 0:
            step = instants[k] - instants[k - 1]
            slope = (shown[k, j] - shown[k - 1, j]) / step
            rate[j] += (1.0 - math.exp(-2.0 * math.pi * cutoff * step)) * (slope - rate[j])


@equation
def feed_back(k, shown, rate, reference, gains, r, commands):
    """Add the state feedback of instant k to its commands."""
    for j in range(2):
        if not r.driven[j]:
            commands[k, j] = 0.0
            continue
        for i in range(2):
            commands[k, j] -= gains[j, i] * (shown[k, i] - reference[k, i])
            commands[k, j] -= gains[j, 2 + i] * (rate[i] - reference[k, 2 + i])
