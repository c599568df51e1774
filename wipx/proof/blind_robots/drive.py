"""The path from a command to the force on its joint, in the order of contract section 3.

Its delay is in `engine`, which keeps the commands.
"""

import math

from wipx.proof.blind_robots.compiled import equation


@equation
def static_part(command, t, r):
    """Force asked of the drive: dead zone, gain (which may drift and sag), saturation [N or N m]."""
    if abs(command) <= r.dead_band:
        return 0.0
    force = (command - math.copysign(r.dead_band, command)) * r.gain * (1.0 + r.gain_drift * (t - r.drift_middle))
    force *= 1.0 - r.sag * (abs(force) - r.sag_middle)
    return min(max(force, -r.force_limit), r.force_limit)


@equation
def speed_limited(force, v, r):
    """What the motor gives at joint speed v: less while it drives the motion, up to the stall force against it."""
    if r.stall_force == math.inf:
        return force
    size = r.stall_force
    if force * v > 0.0:
        size *= max(0.0, 1.0 - abs(v) / r.free_speed)
    return min(max(force, -size), size)


@equation
def motor(joint, y, asked, r):
    """Force of the motor of a joint and the rate of its lag state y[6 + joint]."""
    limited = speed_limited(asked, y[3 + joint], r)
    force, rate = limited, 0.0
    if r.lag > 0.0:
        force, rate = y[6 + joint], (limited - y[6 + joint]) / r.lag
    if r.ripple != 0.0:
        force += r.ripple * math.cos(r.ripple_wavenumber * y[joint] + r.ripple_phase)
    return force, rate


@equation
def coupled(y, force, r):
    """Force on the cart through a drive with a mass of its own, and the drive's acceleration.

    The drive, at y[16] with speed y[17], meets the cart through play with stiff flanks, through a belt, or through a
    contact that creeps and gives way at `traction`.
    """
    if r.drive_mass == 0.0:
        return force, 0.0
    slide, creep = y[16] - y[0], y[17] - y[3]
    if r.belt_stiffness > 0.0:
        passed = r.belt_stiffness * slide + r.belt_damping * creep
    elif r.traction > 0.0:
        passed = r.traction * math.tanh(r.creep * creep / r.traction)
    else:
        depth = abs(slide) - 0.5 * r.gap
        passed = 0.0
        if depth > 0.0:
            side = math.copysign(1.0, slide)
            passed = side * max(0.0, r.contact_stiffness * depth + r.contact_damping * creep * side)
    return passed, (force - passed - r.grease * creep) / r.drive_mass
