"""Dry friction as events: a joint sticks while the force that holds it stays below the static level.

While it slips, friction has the level of the speed against a direction that is fixed until the speed crosses
zero; bristles (presliding) and hysteresis are memories with equations of their own.
"""

import math

from wipx.proof.blind_robots.compiled import equation

FIRST_ELEMENT, ELEMENTS = 10, 3  # of the hysteresis in the state: place, and number for each joint
USUAL = 0.8  # mean size of a force that varies like a normal variable, over its root mean square
LEAST_GRIP = 0.2  # friction that wanders never vanishes


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
def grip(joint, y, inputs, direction, r):
    """Factor by which friction differs from its law: it wanders with time, place and load, and is uneven."""
    if not r.uneven_friction:
        return 1.0
    load = abs(inputs[joint] if r.driven[joint] else inputs[0])
    place = math.sin(r.wander_number[joint] * y[joint] + r.wander_phase[joint])
    excess = r.wander[joint] * inputs[4 + joint] + r.wander_place[joint] * place + r.uneven[joint] * direction
    return max(LEAST_GRIP, 1.0 + excess + r.wander_load[joint] * (load / r.usual_load[joint] - USUAL))


@equation
def kinetic_level(joint, y, inputs, direction, r):
    """Size of the friction on a slipping joint [N or N m]: Stribeck's curve (Armstrong-Helouvry 1991), of any power."""
    speed = abs(y[3 + joint])
    level = r.kinetic[joint] + direction * r.one_sided[joint]
    bump = r.static[joint] - r.kinetic[joint]
    if bump > 0.0:
        ratio = speed / r.bump_speed[joint]
        shape = ratio * ratio if r.bump_power[joint] == 2.0 else ratio ** r.bump_power[joint]
        level += bump * math.exp(-shape)
    if joint == 0:
        level += place_level(y[0], r)
    return level * grip(joint, y, inputs, direction, r)


@equation
def static_level(joint, y, inputs, direction, r):
    """Largest force at which the joint still sticks [N or N m], against a motion in `direction`."""
    level = r.static[joint] + direction * r.one_sided[joint]
    if joint == 0:
        level += place_level(y[0], r)
    return level * grip(joint, y, inputs, direction, r)


@equation
def slipping_force(joint, y, inputs, mode, r):
    """Dry friction on a joint: zero unless it slips, mode +1 or -1 [N or N m]."""
    if mode == 0 or not r.dry[joint]:
        return 0.0
    return -mode * kinetic_level(joint, y, inputs, mode, r)


@equation
def bristle(joint, y, inputs, r):
    """Force of the bristles and the rate of their bending z (Dahl 1968; damping as of Canudas de Wit 1995)."""
    level = r.bristle_level[joint]
    if level == 0.0:
        return 0.0, 0.0
    v, z = y[3 + joint], y[8 + joint]
    level *= grip(joint, y, inputs, math.copysign(1.0, v), r)
    rate = v - abs(v) * z * r.bristle_stiffness[joint] / level
    return -(r.bristle_stiffness[joint] * z + r.bristle_damping[joint] * rate), rate


@equation
def hysteresis(joint, y, r, rates):
    """Force of springs in parallel, each of which slips at its own way (Maxwell slip, Iwan 1966); fills in `rates`.

    An element is bent by 1 when it slips. The ways go from `hysteresis_first` of the longest one to it, so that the
    force comes back over a reversal as it built up, twice as wide (Masing), which no single bristle does.
    """
    force = 0.0
    if r.hysteresis[joint] == 0.0:
        return force
    v, first = y[3 + joint], r.hysteresis_first[joint]
    for i in range(ELEMENTS):
        place = FIRST_ELEMENT + ELEMENTS * joint + i
        way = r.hysteresis_length[joint] * (first + (1.0 - first) * i / (ELEMENTS - 1))
        slips = abs(y[place]) >= 1.0 and v * y[place] > 0.0
        rates[place] = 0.0 if slips else v / way
        force -= r.hysteresis[joint] / ELEMENTS * min(max(y[place], -1.0), 1.0)
    return force
