"""Forces on one joint: its drive, its friction, and what springs do; contract sections 3 and 6.

Dry friction is a level here: `engine` decides whether the joint sticks, mode 0, or slips, mode +1 or -1.
"""

import math

from wipx.proof.blind_robots.compiled import equation
from wipx.proof.blind_robots.trees.records import BENT, DRIVE, DRIVE_RATE, ELEMENT, ELEMENTS, LAGGED, Q, V


@equation
def servo_force(target, q, v, r):
    """Force of a position drive [N or N m]."""
    force = r.kp * (target - q) - r.kd * v
    return min(max(force, -r.servo_limit), r.servo_limit)


@equation
def asked(j, y, command, r):
    """Force asked of a drive; `command` is a force, the target of a continuous loop, or what a sampled loop holds."""
    if r.servo and r.servo_period == 0.0:
        return servo_force(command, y[Q, j], y[V, j], r)
    return command


@equation
def motor(j, y, command, r):
    """Force of the motor of a joint, and the rate of its lag."""
    force = asked(j, y, command, r) + r.offset
    if r.dead_band > 0.0:
        force = math.copysign(max(abs(force) - r.dead_band, 0.0), force)
    force *= r.gain
    force = min(max(force, -r.force_limit), r.force_limit)
    if r.stall < math.inf:
        speed = y[V, j]
        most = r.stall
        if force * speed > 0.0:
            most *= max(0.0, 1.0 - abs(speed) / r.free_speed)
        force = min(max(force, -most), most)
    if r.lag > 0.0:
        return y[LAGGED, j], (force - y[LAGGED, j]) / r.lag
    return force, 0.0


@equation
def passed_on(j, y, force, r):
    """Force on the joint, and the acceleration of a drive that moves on its own behind play or a spring."""
    force += r.ripple * math.cos(r.ripple_number * y[Q, j] + r.ripple_phase)
    if r.drive_inertia == 0.0:
        return force, 0.0
    ahead, faster = y[DRIVE, j] - y[Q, j], y[DRIVE_RATE, j] - y[V, j]
    if r.elastic:
        passed = r.contact_stiffness * ahead + r.contact_damping * faster
    else:
        depth = abs(ahead) - 0.5 * r.gap
        passed = 0.0
        if depth > 0.0:
            side = math.copysign(1.0, ahead)
            passed = side * max(0.0, r.contact_stiffness * depth + r.contact_damping * faster * side)
    return passed, (force - passed - r.grease * faster) / r.drive_inertia


@equation
def smooth_force(j, y, rates, r):
    """Viscous friction, drag, springs, bristles and hysteresis; fills in how their memories change."""
    q, v = y[Q, j], y[V, j]
    force = -r.viscous * v - r.drag * v * abs(v) - r.spring * (q - r.spring_rest)
    if r.bristle_level > 0.0:
        bent = y[BENT, j]
        rate = v - r.bristle_stiffness / r.bristle_level * abs(v) * bent
        rates[BENT, j] = rate
        force -= r.bristle_stiffness * bent + r.bristle_damping * rate
    if r.hysteresis > 0.0:
        for e in range(ELEMENTS):
            way = r.hysteresis_way * (e + 1.0) / ELEMENTS
            place = y[ELEMENT + e, j]
            yields = abs(place) >= way and place * v > 0.0
            rates[ELEMENT + e, j] = 0.0 if yields else v
            force -= r.hysteresis / ELEMENTS * min(max(place / way, -1.0), 1.0)
    return force


@equation
def level(j, y, speed, direction, drive, load, r):
    """Size of dry friction against a motion in `direction` [N or N m]; the static one at speed 0.

    Args:
        j: Number of the joint.
        y: State.
        speed: Size of the rate.
        direction: +1 or -1.
        drive: Force of the drive.
        load: Force of gravity, velocities and springs.
        r: Record of the joint.
    """
    size = r.kinetic + direction * r.one_sided
    if r.static > r.kinetic:
        ratio = speed / r.bump_speed
        size += (r.static - r.kinetic) * math.exp(-ratio * ratio)
    if r.spot_level > 0.0 and r.spot_low <= y[Q, j] <= r.spot_high:
        size += r.spot_level
    if r.per_motor > 0.0 or r.per_load > 0.0:
        size += abs(r.per_load * load - r.per_motor * drive)
    return size
