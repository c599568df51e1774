"""Equations of motion: masses at places, their Jacobians, and joints that are held.

A body is a point mass with an inertia, at (p, n) along and normal to the rail, seen from the joint; turning
by d(theta) moves it by (-n, p) d(theta). Positive theta moves it to -x. Forces come from `friction` and `drive`.
"""

import math

from wipx.proof.blind_robots.compiled import equation
from wipx.proof.blind_robots.friction import grip


@equation
def body_terms(mass, inertia, p, n, rate, pull_x, pull_n):
    """Mass matrix (m00, m01, m11) and generalised forces (f0, f1) of a body at (p, n).

    Args:
        mass: [kg].
        inertia: About its centre of mass [kg m^2].
        p: Place along the rail from the joint [m].
        n: Place normal to the rail [m].
        rate: Pitch rate [rad/s].
        pull_x: Gravity along the rail [m/s^2].
        pull_n: Gravity normal to the rail [m/s^2].
    """
    square = rate * rate
    force_x, force_n = mass * (pull_x + p * square), mass * (pull_n + n * square)
    return mass, -mass * n, mass * (n * n + p * p) + inertia, force_x, p * force_n - n * force_x


@equation
def cart_and_body(y, heavy, r):
    """Mass matrix and forces of the wip family without friction and drive: (m00, m01, m11, f0, f1)."""
    mass, height, inertia = r.body_mass, r.body_height, r.body_inertia
    if heavy:
        mass, height, inertia = r.body_mass_after, r.body_height_after, r.body_inertia_after
    to_rail = y[1] - r.lean - r.tilt
    pull_x, pull_n = -r.gravity * math.sin(r.tilt), -r.gravity * math.cos(r.tilt)
    p, n = -height * math.sin(to_rail), height * math.cos(to_rail)
    m00, m01, m11, f0, f1 = body_terms(mass, inertia, p, n, y[4], pull_x, pull_n)
    return m00 + r.cart_mass, m01, m11, f0 + r.cart_weight * pull_x, f1


@equation
def two_links(y, r):
    """Mass matrix and forces of the double pendulum: (m00, m01, m11, f0, f1)."""
    bend = r.coupling * math.cos(y[1])
    swing = r.coupling * math.sin(y[1])
    lower = -r.gravity * r.moment2 * math.sin(y[0] + y[1])
    upper = -r.gravity * r.moment1 * math.sin(y[0])
    f0 = upper + lower + swing * y[4] * (2.0 * y[3] + y[4])
    f1 = lower - swing * y[3] * y[3]
    return r.inertia1 + r.inertia2 + 2.0 * bend, r.inertia2 + bend, r.inertia2, f0, f1


@equation
def sliding_mass(y, r):
    """What the moving mass on the body adds: (m00, m01, m11, f0, f1, m02, m12, f2).

    Its own coordinate y[2] is the way sideways on the body, in the direction in which positive theta moves it.
    """
    to_rail = y[1] - r.lean - r.tilt
    sine, cosine = math.sin(to_rail), math.cos(to_rail)
    pull_x, pull_n = -r.gravity * math.sin(r.tilt), -r.gravity * math.cos(r.tilt)
    p, n = -r.aux_height * sine - y[2] * cosine, r.aux_height * cosine - y[2] * sine
    m00, m01, m11, f0, f1 = body_terms(r.aux_mass, 0.0, p, n, y[4], pull_x, pull_n)
    coriolis = 2.0 * r.aux_mass * y[5] * y[4]
    push_x, push_n = -coriolis * sine, coriolis * cosine
    force_x = f0 + push_x
    force_n = r.aux_mass * (pull_n + n * y[4] * y[4]) + push_n
    sideways = -cosine * force_x - sine * force_n - r.aux_stiffness * y[2] - r.aux_damping * y[5]
    turning = f1 - n * push_x + p * push_n
    return m00, m01, m11, force_x, turning, -r.aux_mass * cosine, r.aux_mass * r.aux_height, sideways


@equation
def smooth_forces(y, inputs, r):
    """Forces that need no memory and do not jump: viscous, drag, spring and what the vocabulary lacks, (f0, f1)."""
    x, theta, v, w = y[0], y[1], y[3], y[4]
    viscous0 = r.viscous[0] * grip(0, y, inputs, math.copysign(1.0, v), r)
    viscous1 = r.viscous[1] * grip(1, y, inputs, math.copysign(1.0, w), r)
    f0 = -v * (viscous0 + r.drag[0] * abs(v) - r.regeneration[0] + r.regeneration_cubic[0] * v * v)
    f1 = -w * (viscous1 + r.drag[1] * abs(w) - r.regeneration[1] + r.regeneration_cubic[1] * w * w)
    f0 += r.push[0] * inputs[2]
    f1 += r.push[1] * inputs[3]
    f0 -= r.spring * (x - r.spring_rest) + v * (r.viscous_forward[0] if v > 0.0 else r.viscous_backward[0])
    f1 -= w * (r.viscous_forward[1] if w > 0.0 else r.viscous_backward[1])
    if r.cog_torque != 0.0:
        f1 += r.cog_torque * math.sin(r.cog_number * theta + r.cog_phase)
    return f0, f1


@equation
def accelerate(m00, m01, m11, f0, f1, held0, held1):
    """Accelerations of two joints of which some are held, and the forces that hold them: (a0, a1, h0, h1)."""
    if held0 and held1:
        return 0.0, 0.0, -f0, -f1
    if held0:
        a1 = f1 / m11
        return 0.0, a1, m01 * a1 - f0, 0.0
    if held1:
        a0 = f0 / m00
        return a0, 0.0, 0.0, m01 * a0 - f1
    determinant = m00 * m11 - m01 * m01
    return (m11 * f0 - m01 * f1) / determinant, (m00 * f1 - m01 * f0) / determinant, 0.0, 0.0
