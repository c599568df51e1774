"""Dry friction as events: a joint sticks while the force that holds it stays below the static level.

While it slips, friction has the level of the speed against a direction that is fixed until the speed crosses
zero; bristles (presliding) and hysteresis are memories with equations of their own.
"""

import math

from wipx.concealed.compiled import equation


@equation
def place_level(x, r):
    """Level that depends on the place along the rail [N]: a sticky spot, or a wave."""
    level = 0.0
    if r.spot_low <= x <= r.spot_high:
        level += r.spot_level
    if r.rail_level > 0.0:
        level += r.rail_level * (1.0 + math.sin(r.rail_wavenumber * x + r.rail_phase))
    return level


@equation
def kinetic_level(joint, x, speed, direction, r):
    """Size of the friction on a slipping joint [N or N m]: Stribeck's curve (Armstrong-Helouvry 1991)."""
    level = r.kinetic[joint] + direction * r.one_sided[joint]
    bump = r.static[joint] - r.kinetic[joint]
    if bump > 0.0:
        ratio = speed / r.bump_speed[joint]
        level += bump * math.exp(-ratio * ratio)
    return level + place_level(x, r) if joint == 0 else level


@equation
def static_level(joint, x, direction, r):
    """Largest force at which the joint still sticks [N or N m], against a motion in `direction`."""
    level = r.static[joint] + direction * r.one_sided[joint]
    return level + place_level(x, r) if joint == 0 else level


@equation
def slipping_force(joint, y, mode, r):
    """Dry friction on a joint: zero unless it slips, mode +1 or -1 [N or N m]."""
    if mode == 0 or not r.dry[joint]:
        return 0.0
    return -mode * kinetic_level(joint, y[0], abs(y[3 + joint]), mode, r)


@equation
def bristle(joint, y, r):
    """Force of the bristles and the rate of their bending z (Dahl 1968; damping as of Canudas de Wit 1995)."""
    level = r.bristle_level[joint]
    if level == 0.0:
        return 0.0, 0.0
    v, z = y[3 + joint], y[8 + joint]
    rate = v - abs(v) * z * r.bristle_stiffness[joint] / level
    return -(r.bristle_stiffness[joint] * z + r.bristle_damping[joint] * rate), rate


@equation
def hysteresis_rate(joint, y, r):
    """Rate of the hysteretic part, which is 1 when it is fully built up (Bouc 1967, Wen 1976; exponent 2).

    With z' = v / length * (1 - (beta sign(v z) + gamma) z^2), beta + gamma = 1 and gamma = `hysteresis_shape`.
    """
    if r.hysteresis[joint] == 0.0:
        return 0.0
    v, z = y[3 + joint], y[10 + joint]
    shape = r.hysteresis_shape[joint]
    side = 1.0 if v * z > 0.0 else -1.0
    return v / r.hysteresis_length[joint] * (1.0 - ((1.0 - shape) * side + shape) * z * z)
