"""Friction of one joint, and its motion before and after the forces of a step; compiled.

Dry friction is a level here; `wipx.sim.sticking` finds what it does to the rates of all joints.
"""

from wipx.core.law import clip, law, maximum
from wipx.effects import lagged_stribeck, load_friction, quadratic_drag, sticky_spot, stribeck
from wipx.effects.hysteresis import yielding
from wipx.effects.presliding import bristle, bristle_rate
from wipx.effects.remainder import KNOTS
from wipx.sim import rows as R
from wipx.sim.actuator import sprung
from wipx.sim.rows import W


@law
def levels(J, n, has, j):
    """Dry friction of a joint: the impulse may lie anywhere up to these levels."""
    if has[j, R.ON_STRIBECK]:
        for w in range(n):
            static, coulomb = J[R.STATIC * W + w], J[R.COULOMB * W + w]
            more = stribeck.bump(J[R.RATE * W + w], static, coulomb, J[R.STRIBECK_SPEED * W + w])
            J[R.PLUS * W + w] += more
            J[R.MINUS * W + w] += more
    if has[j, R.ON_LOAD]:
        for w in range(n):
            motor = J[R.DRIVE * W + w]
            load = J[R.FORCE * W + w] - motor
            more = load_friction.level(motor, load, J[R.LOAD_MOTOR * W + w], J[R.LOAD_EXTERNAL * W + w])
            J[R.PLUS * W + w] += more
            J[R.MINUS * W + w] += more
    if has[j, R.ON_SPOT]:
        for w in range(n):
            now = J[R.Q * W + w]
            there = now + J[R.H * W + w] * J[R.RATE * W + w]
            more = J[R.SPOT * W + w] * sticky_spot.share(now, there, J[R.SPOT_LOW * W + w], J[R.SPOT_HIGH * W + w])
            J[R.PLUS * W + w] += more
            J[R.MINUS * W + w] += more


@law
def smooth_friction(S, B, J, n, has, j):
    """Friction of a joint that is a force: drag, bristle, the paper's lagged law."""
    if has[j, R.ON_DRAG]:
        for w in range(n):
            J[R.FORCE * W + w] += quadratic_drag.force(J[R.RATE * W + w], J[R.DRAG * W + w])
    if has[j, R.ON_BRISTLE]:
        bend(J, n, has, j)
    if has[j, R.ON_REMAINDER]:
        remainder(S, B, J, n)
    if has[j, R.ON_SWING]:
        for w in range(n):
            h = J[R.H * W + w]
            stiffness, damping = J[R.SWING_STIFFNESS * W + w], J[R.SWING_DAMPING * W + w]
            place, rate = J[R.SWING_PLACE * W + w], J[R.SWING_RATE * W + w]
            rate -= h * (J[R.ACCELERATION * W + w] + stiffness * place + damping * rate)
            place += h * rate
            J[R.SWING_RATE * W + w], J[R.SWING_PLACE * W + w] = rate, place
            J[R.FORCE * W + w] += J[R.SWING * W + w] * (stiffness * place + damping * rate)
    if has[j, R.ON_PAPER]:
        for w in range(n):
            steady = lagged_stribeck.resistance(
                J[R.RATE * W + w],
                J[R.PAPER_STATIC * W + w],
                J[R.PAPER_COULOMB * W + w],
                J[R.PAPER_SPEED * W + w],
                J[R.PAPER_VISCOUS * W + w],
                J[R.PAPER_EPSILON * W + w],
            )
            before = J[R.PAPER * W + w]
            rest = J[R.STARTED * W + w] * (before - steady)
            after = steady + rest * J[R.PAPER_KEPT * W + w]
            J[R.PAPER * W + w] = after if J[R.H * W + w] > 0.0 else before
            J[R.FORCE * W + w] -= steady + rest * J[R.PAPER_MEAN * W + w]


@law
def bend(J, n, has, j):
    """The force of a bristle on a joint, linear in the rate of the step, and how it will bend."""
    if has[j, R.ON_HYSTERESIS]:
        for w in range(n):
            exponent, gamma = J[R.EXPONENT * W + w], J[R.GAMMA * W + w]
            per_way = J[R.BRISTLE * W + w] / maximum(J[R.SLIDING * W + w], 1e-12)
            share, way = per_way * J[R.Z * W + w], 0.5 * J[R.H * W + w] * J[R.RATE * W + w]
            middle = share + per_way * (way - abs(way) * share * yielding(share, way, exponent, gamma))
            J[R.YIELDING * W + w] = yielding(middle, way, exponent, gamma)
    else:
        for w in range(n):
            J[R.YIELDING * W + w] = 1.0
    for w in range(n):
        sliding, speed = J[R.SLIDING * W + w], abs(J[R.RATE * W + w])
        level = sliding + stribeck.bump(speed, J[R.PEAK * W + w], sliding, J[R.PEAK_SPEED * W + w])
        stiffness, damping = J[R.BRISTLE * W + w], J[R.BRISTLE_DAMPING * W + w]
        rate = J[R.YIELDING * W + w] * bristle_rate(speed, stiffness, level)
        h = J[R.H * W + w]
        z = J[R.Z * W + w]
        kept, gain, mean_gain = bristle(rate * h)
        # The force is linear in the mean rate of the step, which is solved for below.
        J[R.FORCE * W + w] -= (stiffness - damping * rate) * gain * z
        J[R.DAMPING * W + w] += stiffness * mean_gain * h + damping * gain
        J[R.BRISTLE_KEPT * W + w] = kept
        J[R.BRISTLE_GAIN * W + w] = gain * h


@law
def remainder(S, B, J, n):
    """The piecewise linear force of a joint over one signal, or level of its dry friction."""
    for w in range(n):
        code, joints = int(J[R.REMAINDER_SIGNAL * W + w]), len(B)
        if code < 3 * joints:
            row = R.MID if code < joints else R.RATE if code < 2 * joints else R.COMMAND
            signal = B[code % joints, row * W + w]
        else:
            signal = S[R.TIME * W + w]
        place = (signal - J[R.REMAINDER_LOW * W + w]) * J[R.REMAINDER_PER_UNIT * W + w]
        place = clip(place, 0.0, KNOTS - 1.000001)
        knot = int(place)
        low, high = J[(R.REMAINDER + knot) * W + w], J[(R.REMAINDER + knot + 1) * W + w]
        force = low + (place - knot) * (high - low)
        share = J[R.REMAINDER_FACTOR * W + w]
        if share < 0.0:
            J[R.PLUS * W + w] = maximum(J[R.PLUS * W + w] + force, 0.0)
            J[R.MINUS * W + w] = maximum(J[R.MINUS * W + w] + force, 0.0)
        else:
            command = J[R.COMMAND * W + w]
            J[R.FORCE * W + w] += force * ((1.0 - share) + share * command)


@law
def drifted(J, n):
    """Coordinate and rate of a joint in mid-step, as far as they are known before the forces, and its command."""
    for w in range(n):
        J[R.DRIVE * W + w] = J[R.COMMAND * W + w]
        half = 0.5 * J[R.H * W + w]
        J[R.MID * W + w] = J[R.Q * W + w] + half * J[R.V * W + w]
        J[R.RATE * W + w] = J[R.V * W + w] + half * J[R.ACCELERATION * W + w]


@law
def arrived(J, n, has, j):
    """Drift the second half with the rate of the step's end, and carry on what depends on the motion."""
    for w in range(n):
        before = J[R.V * W + w]
        after = J[R.NEXT * W + w] if J[R.H * W + w] > 0.0 else before
        J[R.Q * W + w] = J[R.MID * W + w] + 0.5 * J[R.H * W + w] * after
        J[R.V * W + w] = after
        acceleration = (after - before) * J[R.PER_H * W + w]
        last = J[R.ACCELERATION * W + w]
        J[R.ACCELERATION * W + w] = acceleration if J[R.H * W + w] > 0.0 else last
        J[R.RATE * W + w] = 0.5 * (before + after)
    if has[j, R.ON_MEMORY]:
        remembered(J, n, has, j)
    if has[j, R.ON_BRISTLE]:
        for w in range(n):
            z, mean = J[R.Z * W + w], J[R.RATE * W + w]
            J[R.Z * W + w] = J[R.BRISTLE_KEPT * W + w] * z + J[R.BRISTLE_GAIN * W + w] * mean


@law
def remembered(J, n, has, j):
    """Note that a joint has begun to move, and what its drive needs of this step in the next one."""
    for w in range(n):
        J[R.STARTED * W + w] = maximum(J[R.STARTED * W + w], 1.0 if J[R.H * W + w] > 0.0 else 0.0)
    if has[j, R.ON_BACKLASH]:
        for w in range(n):
            if J[R.H * W + w] > 0.0:
                lightness = J[R.INVERSE * W + w]
                J[R.LIGHTNESS * W + w] = lightness
                J[R.MADE * W + w] = lightness * J[R.DRIVE * W + w]
    if has[j, R.ON_ELASTICITY]:
        sprung(J, n)
