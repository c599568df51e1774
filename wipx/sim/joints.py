"""Friction of the joints, and the motion that follows; compiled.

Dry friction is set-valued: the friction impulses p of the two joints solve

    v' = b + W p,   p_i in [-h F+_i, h F-_i],   v'_i = 0 inside, p_i at an end otherwise

exactly, so that a joint sticks and is not smoothed (Moreau's time stepping; Acary and
Brogliato 2008, Numerical Methods for Nonsmooth Dynamical Systems, ch. 10).
"""

from wipx.core.law import clip, inlined, law, maximum
from wipx.effects import lagged_stribeck, load_friction, quadratic_drag, sticky_spot, stribeck
from wipx.effects.hysteresis import yielding
from wipx.effects.presliding import bristle, bristle_rate
from wipx.effects.remainder import KNOTS
from wipx.sim import rows as R
from wipx.sim.rows import W


@inlined
def levels(S, n, on, j):
    """Dry friction of joint j: the impulse may lie anywhere up to these levels."""
    v = (R.RATE + j) * W
    if on[R.ON_STRIBECK + j]:
        for w in range(n):
            static, coulomb = S[(R.STATIC + j) * W + w], S[(R.COULOMB + j) * W + w]
            more = stribeck.bump(S[v + w], static, coulomb, S[(R.STRIBECK_SPEED + j) * W + w])
            S[(R.PLUS + j) * W + w] += more
            S[(R.MINUS + j) * W + w] += more
    if on[R.ON_LOAD + j]:
        for w in range(n):
            motor = S[(R.DRIVE + j) * W + w]
            load = S[(R.FORCE + j) * W + w] - motor
            more = load_friction.level(motor, load, S[(R.LOAD_MOTOR + j) * W + w], S[(R.LOAD_EXTERNAL + j) * W + w])
            S[(R.PLUS + j) * W + w] += more
            S[(R.MINUS + j) * W + w] += more
    if on[R.ON_SPOT] and j == 0:
        for w in range(n):
            now = S[R.Q * W + w]
            there = now + S[R.STEP * W + w] * S[v + w]
            more = S[R.SPOT * W + w] * sticky_spot.share(now, there, S[R.SPOT_LOW * W + w], S[R.SPOT_HIGH * W + w])
            S[R.PLUS * W + w] += more
            S[R.MINUS * W + w] += more


@inlined
def smooth_friction(S, n, on, j):
    """Friction of joint j that is a force: drag, bristle, the paper's lagged law."""
    v = (R.RATE + j) * W
    if on[R.ON_DRAG + j]:
        for w in range(n):
            S[(R.FORCE + j) * W + w] += quadratic_drag.force(S[v + w], S[(R.DRAG + j) * W + w])
    if on[R.ON_BRISTLE + j]:
        bend(S, n, on, j)
    if on[R.ON_REMAINDER + j]:
        remainder(S, n, j)
    if on[R.ON_SWING + j]:
        for w in range(n):
            h = S[R.STEP * W + w]
            stiffness, damping = S[(R.SWING_STIFFNESS + j) * W + w], S[(R.SWING_DAMPING + j) * W + w]
            place, rate = S[(R.SWING_PLACE + j) * W + w], S[(R.SWING_RATE + j) * W + w]
            rate -= h * (S[(R.ACCELERATION + j) * W + w] + stiffness * place + damping * rate)
            place += h * rate
            S[(R.SWING_RATE + j) * W + w], S[(R.SWING_PLACE + j) * W + w] = rate, place
            S[(R.FORCE + j) * W + w] += S[(R.SWING + j) * W + w] * (stiffness * place + damping * rate)
    if on[R.ON_PAPER + j]:
        for w in range(n):
            steady = lagged_stribeck.resistance(
                S[v + w],
                S[(R.PAPER_STATIC + j) * W + w],
                S[(R.PAPER_COULOMB + j) * W + w],
                S[(R.PAPER_SPEED + j) * W + w],
                S[(R.PAPER_VISCOUS + j) * W + w],
                S[(R.PAPER_EPSILON + j) * W + w],
            )
            before = S[(R.PAPER + j) * W + w]
            rest = S[R.STARTED * W + w] * (before - steady)
            after = steady + rest * S[(R.PAPER_KEPT + j) * W + w]
            S[(R.PAPER + j) * W + w] = after if S[R.STEP * W + w] > 0.0 else before
            S[(R.FORCE + j) * W + w] -= steady + rest * S[(R.PAPER_MEAN + j) * W + w]


@inlined
def bend(S, n, on, j):
    """The force of a bristle on joint j, linear in the rate of the step, and how it will bend."""
    v = (R.RATE + j) * W
    if on[R.ON_HYSTERESIS + j]:
        for w in range(n):
            exponent, gamma = S[(R.EXPONENT + j) * W + w], S[(R.GAMMA + j) * W + w]
            per_way = S[(R.BRISTLE + j) * W + w] / maximum(S[(R.SLIDING + j) * W + w], 1e-12)
            share, way = per_way * S[(R.Z + j) * W + w], 0.5 * S[R.STEP * W + w] * S[v + w]
            middle = share + per_way * (way - abs(way) * share * yielding(share, way, exponent, gamma))
            S[(R.YIELDING + j) * W + w] = yielding(middle, way, exponent, gamma)
    else:
        for w in range(n):
            S[(R.YIELDING + j) * W + w] = 1.0
    for w in range(n):
        sliding, speed = S[(R.SLIDING + j) * W + w], abs(S[v + w])
        level = sliding + stribeck.bump(speed, S[(R.PEAK + j) * W + w], sliding, S[(R.PEAK_SPEED + j) * W + w])
        stiffness, damping = S[(R.BRISTLE + j) * W + w], S[(R.BRISTLE_DAMPING + j) * W + w]
        rate = S[(R.YIELDING + j) * W + w] * bristle_rate(speed, stiffness, level)
        h = S[R.STEP * W + w]
        z = S[(R.Z + j) * W + w]
        kept, gain, mean_gain = bristle(rate * h)
        # The force is linear in the mean rate of the step, which is solved for below.
        S[(R.FORCE + j) * W + w] -= (stiffness - damping * rate) * gain * z
        S[(R.DAMPING + j) * W + w] += stiffness * mean_gain * h + damping * gain
        S[(R.BRISTLE_KEPT + j) * W + w] = kept
        S[(R.BRISTLE_GAIN + j) * W + w] = gain * h


@inlined
def remainder(S, n, j):
    """The piecewise linear force of joint j over one signal, or level of its dry friction."""
    for w in range(n):
        code = int(S[(R.REMAINDER_SIGNAL + j) * W + w])
        if code < 2:
            signal = S[(R.MID + code) * W + w]
        elif code < 4:
            signal = S[(R.RATE + code - 2) * W + w]
        elif code < 6:
            signal = S[(R.COMMAND + code - 4) * W + w]
        else:
            signal = S[R.TIME * W + w]
        place = (signal - S[(R.REMAINDER_LOW + j) * W + w]) * S[(R.REMAINDER_PER_UNIT + j) * W + w]
        place = clip(place, 0.0, KNOTS - 1.000001)
        knot = int(place)
        low, high = S[(R.REMAINDER + 2 * knot + j) * W + w], S[(R.REMAINDER + 2 * knot + 2 + j) * W + w]
        force = low + (place - knot) * (high - low)
        share = S[(R.REMAINDER_FACTOR + j) * W + w]
        if share < 0.0:
            S[(R.PLUS + j) * W + w] = maximum(S[(R.PLUS + j) * W + w] + force, 0.0)
            S[(R.MINUS + j) * W + w] = maximum(S[(R.MINUS + j) * W + w] + force, 0.0)
        else:
            command = S[(R.COMMAND + j) * W + w]
            S[(R.FORCE + j) * W + w] += force * ((1.0 - share) + share * command)


@law
def stick_or_slide(S, n, on):
    """Take from the rates at the end of the step what dry friction takes: all of it, or its level."""
    for w in range(n):
        S[R.YIELD * W + w] = S[R.W11 * W + w]
        S[R.YIELD1 * W + w] = S[R.W22 * W + w]
    if on[R.ON_SMOOTHING]:  # a joint that yields while it "sticks" is a compliance in series
        for j in range(2):
            for w in range(n):
                reach = S[R.STEP * W + w] * (S[(R.PLUS + j) * W + w] + S[(R.MINUS + j) * W + w])
                S[(R.YIELD + j) * W + w] += 2.0 * S[(R.SMOOTHING + j) * W + w] / maximum(reach, 1e-15)
    for w in range(n):
        h = S[R.STEP * W + w]
        w11, w12, w22 = S[R.W11 * W + w], S[R.W12 * W + w], S[R.W22 * W + w]
        b0, b1 = S[R.NEXT * W + w], S[R.NEXT1 * W + w]
        low0, high0 = -h * S[R.PLUS * W + w], h * S[R.MINUS * W + w]
        low1, high1 = -h * S[R.PLUS1 * W + w], h * S[R.MINUS1 * W + w]
        c11, c22 = S[R.YIELD * W + w], S[R.YIELD1 * W + w]
        both_stick = (w12 * b0 - c11 * b1) / (c11 * c22 - w12 * w12)
        p0 = clip(-(b0 + w12 * clip(both_stick, low1, high1)) / c11, low0, high0)
        p1 = clip(-(b1 + w12 * p0) / c22, low1, high1)
        S[R.NEXT * W + w] = b0 + w11 * p0 + w12 * p1
        S[R.NEXT1 * W + w] = b1 + w12 * p0 + w22 * p1


@law
def move(S, n, on):
    """Solve for the rates at the end of the step, with sticking, and drift the second half."""
    for w in range(n):
        h = S[R.STEP * W + w]
        v0, v1 = S[R.V * W + w], S[R.V1 * W + w]
        d0, d1 = S[R.DAMPING * W + w], S[R.DAMPING1 * W + w]
        a11 = S[R.M11 * W + w] + 0.5 * h * d0
        a22 = S[R.M22 * W + w] + 0.5 * h * d1
        a12 = S[R.M12 * W + w]
        r0 = h * (S[R.FORCE * W + w] - d0 * v0)
        r1 = h * (S[R.FORCE1 * W + w] - d1 * v1)
        inverse = 1.0 / (a11 * a22 - a12 * a12)
        S[R.W11 * W + w] = a22 * inverse
        S[R.W12 * W + w] = -a12 * inverse
        S[R.W22 * W + w] = a11 * inverse
        S[R.NEXT * W + w] = v0 + (a22 * r0 - a12 * r1) * inverse
        S[R.NEXT1 * W + w] = v1 + (a11 * r1 - a12 * r0) * inverse
    if on[R.ON_FRICTION]:
        stick_or_slide(S, n, on)
    for j in range(2):
        for w in range(n):
            before, after = S[(R.V + j) * W + w], S[(R.NEXT + j) * W + w]
            S[(R.Q + j) * W + w] = S[(R.MID + j) * W + w] + 0.5 * S[R.STEP * W + w] * after
            S[(R.V + j) * W + w] = after
            acceleration = (after - before) * S[R.PER_STEP * W + w]
            last = S[(R.ACCELERATION + j) * W + w]
            S[(R.ACCELERATION + j) * W + w] = acceleration if S[R.STEP * W + w] > 0.0 else last
            S[(R.RATE + j) * W + w] = 0.5 * (before + after)
        if on[R.ON_BACKLASH]:
            for w in range(n):
                if S[R.STEP * W + w] > 0.0:
                    lightness = S[(R.W22 if j else R.W11) * W + w]
                    S[(R.LIGHTNESS + j) * W + w] = lightness
                    S[(R.MADE + j) * W + w] = lightness * S[(R.DRIVE + j) * W + w]
        if on[R.ON_BRISTLE + j]:
            for w in range(n):
                z, mean = S[(R.Z + j) * W + w], S[(R.RATE + j) * W + w]
                S[(R.Z + j) * W + w] = S[(R.BRISTLE_KEPT + j) * W + w] * z + S[(R.BRISTLE_GAIN + j) * W + w] * mean
