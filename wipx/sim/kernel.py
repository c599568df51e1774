"""The compiled simulator: one step of physics for a block of rollouts ("lanes") at a time.

`_step` is the signal path in causal order: command, delay, offset, dead zone, gain, saturation,
speed limit, back-EMF, lag, ripple, backlash, then environment and rigid body, joint friction,
motion. Each part is a loop over the lanes of a block that the compiler turns into vector
instructions; a part that is absent costs one untaken branch per block.

Integrator: position Verlet. Coordinates drift half a step, rates take a whole one with forces
of mid-step, coordinates drift the other half; second order. Viscous terms are implicit in the
mean rate. Dry friction is set-valued: the friction impulses p of the two joints solve

    v' = b + W p,   p_i in [-h F+_i, h F-_i],   v'_i = 0 inside, p_i at an end otherwise

exactly, so that a joint sticks and is not smoothed (Moreau's time stepping; Acary and
Brogliato 2008, Numerical Methods for Nonsmooth Dynamical Systems, ch. 10).
"""

import numpy as np

from wipx.core.law import clip, inlined, law, maximum, minimum, relaxing, sign, sin_cos
from wipx.effects import (
    backlash,
    dead_zone,
    lagged_stribeck,
    load_friction,
    quadratic_drag,
    speed_limit,
    sticky_spot,
    stribeck,
)
from wipx.effects.presliding import bristle, bristle_rate
from wipx.sim import rows as R
from wipx.sim.cache import cached

W = 64  # lanes of a block: four vector registers of four numbers hide the latency of a division


@law
def _delayed_command(S, t_rows, u_rows, lanes, pointers, actuated):
    """The mean command over the step, after the transport delay (scalar: every lane has its own past)."""
    last = t_rows.shape[0] - 2
    for w in range(W):
        h = S[R.STEP * W + w]
        if h <= 0.0:
            S[R.DRIVE * W + w], S[R.DRIVE1 * W + w] = S[R.COMMAND * W + w], S[R.COMMAND1 * W + w]
            continue
        window, column = lanes[0, w], lanes[1, w]
        begin = S[R.TIME * W + w] - S[R.DELAY * W + w]
        end = begin + h
        k = pointers[w]
        while k < last and t_rows[k + 1, window] <= begin:
            k += 1
        pointers[w] = k
        for j in range(2):
            if not actuated[j]:
                continue
            total = 0.0
            done = begin
            i = k
            while i < last and t_rows[i + 1, window] < end:
                total += (t_rows[i + 1, window] - done) * u_rows[i, j, column]
                done = t_rows[i + 1, window]
                i += 1
            total += (end - done) * u_rows[i, j, column]
            S[(R.DRIVE + j) * W + w] = total / h * S[R.INPUT_GAIN * W + w]


@inlined
def _actuator(S, on, j):
    """From the command of joint j to the force on it."""
    u = (R.DRIVE + j) * W
    v = (R.RATE + j) * W
    if on[R.ON_OFFSET]:
        for w in range(W):
            S[u + w] += S[R.OFFSET * W + w]
    if on[R.ON_DEAD_ZONE]:
        for w in range(W):
            S[u + w] = dead_zone.force(S[u + w], S[R.DEAD_BAND * W + w])
    for w in range(W):
        S[u + w] *= S[R.GAIN * W + w]
    if on[R.ON_SATURATION]:
        for w in range(W):
            S[u + w] = clip(S[u + w], -S[R.FORCE_MAX * W + w], S[R.FORCE_MAX * W + w])
    if on[R.ON_SPEED_LIMIT]:
        for w in range(W):
            S[u + w] = speed_limit.limited(S[u + w], S[v + w], S[R.STALL * W + w], S[R.FREE_SPEED * W + w])
    if on[R.ON_BACK_EMF]:
        for w in range(W):
            S[u + w] -= S[R.BACK_EMF * W + w] * S[v + w]
    if on[R.ON_LAG]:
        a = (R.LAGGED + j) * W
        for w in range(W):
            rest = S[R.STARTED * W + w] * (S[a + w] - S[u + w])
            S[a + w] = S[u + w] + rest * S[R.LAG_KEPT * W + w] if S[R.STEP * W + w] > 0.0 else S[a + w]
            S[u + w] += rest * S[R.LAG_MEAN * W + w]
    if on[R.ON_RIPPLE]:
        for w in range(W):
            angle = S[R.RIPPLE_PERIODS * W + w] * S[(R.MID + j) * W + w] + S[R.RIPPLE_PHASE * W + w]
            _, cosine = sin_cos(angle)
            S[u + w] += S[R.RIPPLE * W + w] * cosine
    if on[R.ON_BACKLASH]:
        _backlash(S, j)


@inlined
def _backlash(S, j):
    for w in range(W):
        h = S[R.STEP * W + w]
        force = S[(R.DRIVE + j) * W + w]
        gap = S[R.GAP * W + w]
        begun = S[R.STARTED * W + w] > 0.0
        before = S[(R.PLACE + j) * W + w] if begun else 0.5 * gap * sign(force)
        moved, rate, share = backlash.cross(
            before,
            S[(R.DRIVE_SPEED + j) * W + w],
            force,
            S[(R.ACCELERATION + j) * W + w],
            gap,
            S[R.DRIVE_INERTIA * W + w],
            h,
        )
        S[(R.PLACE + j) * W + w] = moved
        S[(R.DRIVE_SPEED + j) * W + w] = rate
        pushes = share if moved * force > 0.0 else 0.0
        S[(R.DRIVE + j) * W + w] = force * (pushes if gap > 0.0 else 1.0)


@law
def _wip_body(S, on):
    """Mass matrix and forces of the rigid body; contract section 2."""
    for w in range(W):
        s, c = sin_cos(S[R.MID1 * W + w] - S[R.BALANCE * W + w])
        rate = S[R.RATE1 * W + w]
        coupling = S[R.COUPLING_NOW * W + w]
        S[R.M12 * W + w] = -coupling * c
        S[R.FORCE * W + w] -= coupling * s * rate * rate
        S[R.FORCE1 * W + w] += S[R.GRAVITY_NOW * W + w] * s
    if on[R.ON_TILT]:
        # The coupling sees the angle to the rail, gravity the angle to the vertical.
        for w in range(W):
            upright = S[R.MID1 * W + w] - S[R.BALANCE * W + w]
            s0, _ = sin_cos(upright)
            s, c = sin_cos(upright - S[R.TILT * W + w])
            rate = S[R.RATE1 * W + w]
            coupling = S[R.COUPLING_NOW * W + w]
            S[R.M12 * W + w] = -coupling * c
            S[R.FORCE * W + w] += coupling * (s0 - s) * rate * rate - S[R.TILT_FORCE * W + w]


@law
def _load_body(S):
    """The body as it is before any payload event."""
    for w in range(W):
        S[R.M11 * W + w] = S[R.MASS * W + w]
        S[R.M22 * W + w] = S[R.INERTIA * W + w]
        S[R.COUPLING_NOW * W + w] = S[R.COUPLING * W + w]
        S[R.GRAVITY_NOW * W + w] = S[R.GRAVITY * W + w]


@law
def _payload_event(S):
    """Masses after t0 in place of those before, weighed by the share of the step after t0."""
    _load_body(S)
    for w in range(W):
        h = maximum(S[R.STEP * W + w], 1e-12)
        after = clip((S[R.TIME * W + w] + h - S[R.EVENT_TIME * W + w]) / h, 0.0, 1.0)
        S[R.M11 * W + w] += after * S[R.EVENT_MASS * W + w]
        S[R.M22 * W + w] += after * S[R.EVENT_INERTIA * W + w]
        S[R.COUPLING_NOW * W + w] += after * S[R.EVENT_COUPLING * W + w]
        S[R.GRAVITY_NOW * W + w] += after * S[R.EVENT_GRAVITY * W + w]
        S[R.FORCE * W + w] -= after * S[R.EVENT_WEIGHT * W + w]


@law
def _double_body(S):
    """Mass matrix and forces of the double pendulum, theta1 = 0 hanging."""
    for w in range(W):
        s2, c2 = sin_cos(S[R.MID1 * W + w])
        s1, _ = sin_cos(S[R.MID * W + w])
        s12, _ = sin_cos(S[R.MID * W + w] + S[R.MID1 * W + w])
        v1, v2 = S[R.RATE * W + w], S[R.RATE1 * W + w]
        h = S[R.DP_COUPLING * W + w]
        elbow = S[R.DP_ELBOW * W + w]
        S[R.M11 * W + w] = S[R.DP_BASE * W + w] + 2.0 * h * c2 + S[R.ROTOR * W + w]
        S[R.M12 * W + w] = elbow + h * c2
        S[R.M22 * W + w] = elbow + S[R.ROTOR1 * W + w]
        lower = S[R.DP_GRAVITY * W + w] * s12
        S[R.FORCE * W + w] += h * s2 * (2.0 * v1 + v2) * v2 - S[R.DP_GRAVITY1 * W + w] * s1 - lower
        S[R.FORCE1 * W + w] -= h * s2 * v1 * v1 + lower


@inlined
def _levels(S, on, j):
    """Dry friction of joint j: the impulse may lie anywhere up to these levels."""
    v = (R.RATE + j) * W
    if on[R.ON_STRIBECK + j]:
        for w in range(W):
            static, coulomb = S[(R.STATIC + j) * W + w], S[(R.COULOMB + j) * W + w]
            more = stribeck.bump(S[v + w], static, coulomb, S[(R.STRIBECK_SPEED + j) * W + w])
            S[(R.PLUS + j) * W + w] += more
            S[(R.MINUS + j) * W + w] += more
    if on[R.ON_LOAD + j]:
        for w in range(W):
            motor = S[(R.DRIVE + j) * W + w]
            load = S[(R.FORCE + j) * W + w] - motor
            more = load_friction.level(motor, load, S[(R.LOAD_MOTOR + j) * W + w], S[(R.LOAD_EXTERNAL + j) * W + w])
            S[(R.PLUS + j) * W + w] += more
            S[(R.MINUS + j) * W + w] += more
    if on[R.ON_SPOT] and j == 0:
        for w in range(W):
            now = S[R.Q * W + w]
            there = now + S[R.STEP * W + w] * S[v + w]
            more = S[R.SPOT * W + w] * sticky_spot.share(now, there, S[R.SPOT_LOW * W + w], S[R.SPOT_HIGH * W + w])
            S[R.PLUS * W + w] += more
            S[R.MINUS * W + w] += more


@inlined
def _smooth_friction(S, on, j):
    """Friction of joint j that is a force: drag, bristle, the paper's lagged law."""
    v = (R.RATE + j) * W
    if on[R.ON_DRAG + j]:
        for w in range(W):
            S[(R.FORCE + j) * W + w] += quadratic_drag.force(S[v + w], S[(R.DRAG + j) * W + w])
    if on[R.ON_BRISTLE + j]:
        for w in range(W):
            sliding, speed = S[(R.SLIDING + j) * W + w], abs(S[v + w])
            level = sliding + stribeck.bump(speed, S[(R.PEAK + j) * W + w], sliding, S[(R.PEAK_SPEED + j) * W + w])
            stiffness, damping = S[(R.BRISTLE + j) * W + w], S[(R.BRISTLE_DAMPING + j) * W + w]
            rate = bristle_rate(speed, stiffness, level)
            h = S[R.STEP * W + w]
            z = S[(R.Z + j) * W + w]
            kept, gain, mean_gain = bristle(rate * h)
            # The force is linear in the mean rate of the step, which is solved for below.
            S[(R.FORCE + j) * W + w] -= (stiffness - damping * rate) * gain * z
            S[(R.DAMPING + j) * W + w] += stiffness * mean_gain * h + damping * gain
            S[(R.BRISTLE_KEPT + j) * W + w] = kept
            S[(R.BRISTLE_GAIN + j) * W + w] = gain * h
    if on[R.ON_PAPER + j]:
        for w in range(W):
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


@law
def _move(S, on):
    """Solve for the rates at the end of the step, with sticking, and drift the second half."""
    for w in range(W):
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
        for w in range(W):
            h = S[R.STEP * W + w]
            w11, w12, w22 = S[R.W11 * W + w], S[R.W12 * W + w], S[R.W22 * W + w]
            b0, b1 = S[R.NEXT * W + w], S[R.NEXT1 * W + w]
            low0, high0 = -h * S[R.PLUS * W + w], h * S[R.MINUS * W + w]
            low1, high1 = -h * S[R.PLUS1 * W + w], h * S[R.MINUS1 * W + w]
            # A joint that yields while it "sticks" (smoothing) is a compliance in series.
            c11 = w11 + 2.0 * S[R.SMOOTHING * W + w] / maximum(high0 - low0, 1e-15)
            c22 = w22 + 2.0 * S[R.SMOOTHING1 * W + w] / maximum(high1 - low1, 1e-15)
            both_stick = (w12 * b0 - c11 * b1) / (c11 * c22 - w12 * w12)
            p0 = clip(-(b0 + w12 * clip(both_stick, low1, high1)) / c11, low0, high0)
            p1 = clip(-(b1 + w12 * p0) / c22, low1, high1)
            S[R.NEXT * W + w] = b0 + w11 * p0 + w12 * p1
            S[R.NEXT1 * W + w] = b1 + w12 * p0 + w22 * p1
    for j in range(2):
        for w in range(W):
            before, after = S[(R.V + j) * W + w], S[(R.NEXT + j) * W + w]
            S[(R.Q + j) * W + w] = S[(R.MID + j) * W + w] + 0.5 * S[R.STEP * W + w] * after
            S[(R.V + j) * W + w] = after
            acceleration = (after - before) * S[R.PER_STEP * W + w]
            last = S[(R.ACCELERATION + j) * W + w]
            S[(R.ACCELERATION + j) * W + w] = acceleration if S[R.STEP * W + w] > 0.0 else last
            S[(R.RATE + j) * W + w] = 0.5 * (before + after)
        if on[R.ON_BRISTLE + j]:
            for w in range(W):
                z, mean = S[(R.Z + j) * W + w], S[(R.RATE + j) * W + w]
                S[(R.Z + j) * W + w] = S[(R.BRISTLE_KEPT + j) * W + w] * z + S[(R.BRISTLE_GAIN + j) * W + w] * mean


@law
def _step(S, on, t_rows, u_rows, lanes, pointers, actuated):
    """Advance every lane of the block by its step; a lane whose step is zero keeps its state to the bit."""
    for j in range(2):
        for w in range(W):
            half = 0.5 * S[R.STEP * W + w]
            S[(R.MID + j) * W + w] = S[(R.Q + j) * W + w] + half * S[(R.V + j) * W + w]
            S[(R.RATE + j) * W + w] = S[(R.V + j) * W + w] + half * S[(R.ACCELERATION + j) * W + w]
    if on[R.ON_DELAY]:
        _delayed_command(S, t_rows, u_rows, lanes, pointers, actuated)
    else:
        for w in range(W):
            S[R.DRIVE * W + w] = S[R.COMMAND * W + w]
            S[R.DRIVE1 * W + w] = S[R.COMMAND1 * W + w]
    if actuated[0]:
        _actuator(S, on, 0)
    if actuated[1]:
        _actuator(S, on, 1)
    for w in range(W):
        S[R.FORCE * W + w] = S[R.DRIVE * W + w]
        S[R.FORCE1 * W + w] = S[R.DRIVE1 * W + w]
    if on[R.ON_DAMPING]:
        for w in range(W):
            S[R.DAMPING * W + w] = S[R.VISCOUS * W + w]
            S[R.DAMPING1 * W + w] = S[R.VISCOUS1 * W + w]
    if on[R.ON_FRICTION]:
        for w in range(W):
            S[R.PLUS * W + w] = S[R.LEVEL_PLUS * W + w]
            S[R.PLUS1 * W + w] = S[R.LEVEL_PLUS1 * W + w]
            S[R.MINUS * W + w] = S[R.LEVEL_MINUS * W + w]
            S[R.MINUS1 * W + w] = S[R.LEVEL_MINUS1 * W + w]
    if on[R.ON_EVENT]:
        _payload_event(S)
    if on[R.ON_SPRING]:
        for w in range(W):
            S[R.FORCE * W + w] -= S[R.SPRING * W + w] * (S[R.MID * W + w] - S[R.SPRING_REST * W + w])
    if on[R.ON_DOUBLE]:
        _double_body(S)
    else:
        _wip_body(S, on)
    _levels(S, on, 0)
    _levels(S, on, 1)
    _smooth_friction(S, on, 0)
    _smooth_friction(S, on, 1)
    _move(S, on)
    for w in range(W):
        h = S[R.STEP * W + w]
        S[R.TIME * W + w] += h
        S[R.STARTED * W + w] = maximum(S[R.STARTED * W + w], 1.0 if h > 0.0 else 0.0)


@law
def _interpolate(past, t_rows, window, k, j, lane, moment):
    """Coordinate j at a `moment` up to row k: cubic Hermite between rows; held before the first."""
    i = k - 1
    while i > 0 and t_rows[i, window] > moment:
        i -= 1
    if i < 0:
        return past[0, j, lane]
    h = t_rows[i + 1, window] - t_rows[i, window]
    if h <= 0.0:
        return past[i + 1, j, lane]
    x = minimum(maximum((moment - t_rows[i, window]) / h, 0.0), 1.0)
    a, b = past[i, j, lane], past[i + 1, j, lane]
    da, db = h * past[i, 2 + j, lane], h * past[i + 1, 2 + j, lane]
    c = b - a
    return a + x * (da + x * ((3.0 * c - 2.0 * da - db) + x * (da + db - 2.0 * c)))


@law
def _record(S, on, past, t_rows, lanes, k, out, lane0, count):
    """Write what the sensors show at row k: coordinates as recorded, rates as they are."""
    for j in range(2):
        for w in range(W):
            true = S[(R.Q + j) * W + w]
            S[(R.SHOWN + j) * W + w] = (1.0 + S[(R.SCALE + j) * W + w]) * true + S[(R.BIAS + j) * W + w]
    if on[R.ON_SENSOR_DELAY]:
        for j in range(2):
            for w in range(count):
                past[k, j, lane0 + w] = S[(R.Q + j) * W + w]
                past[k, 2 + j, lane0 + w] = S[(R.V + j) * W + w]
                moment = t_rows[k, lanes[0, w]] - S[(R.SENSOR_DELAY + j) * W + w]
                late = _interpolate(past, t_rows, lanes[0, w], k, j, lane0 + w, moment)
                S[(R.SHOWN + j) * W + w] = (1.0 + S[(R.SCALE + j) * W + w]) * late + S[(R.BIAS + j) * W + w]
    for j in range(2):
        out[k, j, lane0 : lane0 + count] = S[(R.SHOWN + j) * W : (R.SHOWN + j) * W + count]
        out[k, 2 + j, lane0 : lane0 + count] = S[(R.V + j) * W : (R.V + j) * W + count]


@law
def _feedback(S, t_rows, u_rows, lanes, k, lane0, count, gains, references, noise, settings):
    """State feedback u = -K (y - y_ref) on what the sensors show, at the rows of the log."""
    smoothing, limit = settings[0], settings[1]
    for i in range(4):
        S[(R.NOISE + i) * W : (R.NOISE + i) * W + count] = noise[k, i, lane0 : lane0 + count]
        reference = references[k, i]
        for w in range(W):
            S[(R.REFERENCE + i) * W + w] = reference[lanes[0, w]]
    if smoothing >= 0.0:  # rates from differences of the coordinates, through a low-pass
        for w in range(W):
            window = lanes[0, w]
            S[R.TIME * W + w] = t_rows[k, window] - t_rows[max(k, 1) - 1, window]
    for j in range(2):
        if smoothing < 0.0:
            for w in range(W):
                S[(R.MEASURED_RATE + j) * W + w] = S[(R.V + j) * W + w] + S[(R.NOISE_RATE + j) * W + w]
        else:
            for w in range(W):
                dt = S[R.TIME * W + w]
                moved = S[(R.SHOWN + j) * W + w] + S[(R.NOISE + j) * W + w] - S[(R.MEASURED + j) * W + w]
                rate = S[(R.MEASURED_RATE + j) * W + w]
                filtered = rate + (moved - rate * dt) / (dt + smoothing)
                S[(R.MEASURED_RATE + j) * W + w] = filtered if k > 0 else 0.0
        for w in range(W):
            S[(R.MEASURED + j) * W + w] = S[(R.SHOWN + j) * W + w] + S[(R.NOISE + j) * W + w]
    for c in range(2):
        k0, k1, k2, k3 = gains[c, 0], gains[c, 1], gains[c, 2], gains[c, 3]
        for w in range(W):
            u = -k0 * (S[R.MEASURED * W + w] - S[R.REFERENCE * W + w])
            u -= k1 * (S[R.MEASURED1 * W + w] - S[R.REFERENCE1 * W + w])
            u -= k2 * (S[R.MEASURED_RATE * W + w] - S[R.REFERENCE_RATE * W + w])
            u -= k3 * (S[R.MEASURED_RATE1 * W + w] - S[R.REFERENCE_RATE1 * W + w])
            S[(R.COMMAND + c) * W + w] = clip(u, -limit, limit)
        u_rows[k, c, lane0 : lane0 + count] = S[(R.COMMAND + c) * W : (R.COMMAND + c) * W + count]


@law
def _begin_row(S, on, t_rows, row_steps, substeps, lanes, counts, k):
    """Load the step of row k; the smallest and the largest number of steps."""
    least, most = substeps[k, lanes[0, 0]], 0
    steps, numbers = row_steps[k], substeps[k]
    for w in range(W):
        window = lanes[0, w]
        S[R.ROW_STEP * W + w] = steps[window]
        n = numbers[window]
        counts[w] = n
        least, most = min(least, n), max(most, n)
    if on[R.ON_DELAY] or on[R.ON_EVENT]:
        times = t_rows[k]
        for w in range(W):
            S[R.TIME * W + w] = times[lanes[0, w]]
    for w in range(W):
        S[R.COMMAND * W + w] *= S[R.INPUT_GAIN * W + w]
        S[R.COMMAND1 * W + w] *= S[R.INPUT_GAIN * W + w]
    return least, most


@law
def _replay(S, u_rows, lanes, actuated, k):
    """Load the recorded commands of row k."""
    for j in range(2):
        if actuated[j]:
            commands = u_rows[k, j]
            for w in range(W):
                S[(R.COMMAND + j) * W + w] = commands[lanes[1, w]]


@law
def _set_step(S, on, counts, s):
    """The step of every lane, zero for one that is through with this row, and what lags do in it."""
    for w in range(W):
        h = S[R.ROW_STEP * W + w]
        S[R.STEP * W + w] = h if s < counts[w] else 0.0
        S[R.PER_STEP * W + w] = 1.0 / h if s < counts[w] else 0.0
    if on[R.ON_LAG]:
        for w in range(W):
            kept, mean = relaxing(S[R.STEP * W + w] * S[R.LAG_RATE * W + w])
            S[R.LAG_KEPT * W + w] = kept
            S[R.LAG_MEAN * W + w] = mean
    for j in range(2):
        if on[R.ON_PAPER + j]:
            for w in range(W):
                kept, mean = relaxing(S[R.STEP * W + w] * S[(R.PAPER_RATE + j) * W + w])
                S[(R.PAPER_KEPT + j) * W + w] = kept
                S[(R.PAPER_MEAN + j) * W + w] = mean


@cached
def rollout(
    coefficients,
    on,
    actuated,
    states,
    t_rows,
    u_rows,
    row_steps,
    substeps,
    per_lane,
    closed,
    gains,
    references,
    noise,
    settings,
    past,
    out,
    first_row,
    last_row,
    begin,
    end,
):
    """Simulate lanes [begin, end): lane = model * windows + window.

    Args:
        coefficients: Shape (N_COEFFICIENTS, P).
        on: Parts that are present, shape (N_FLAGS,).
        actuated: Whether each joint has a command, shape (2,).
        states: Start of each lane, shape (STATES, lanes); overwritten with the end.
        t_rows: Time of each row, shape (K + 1, R) [s].
        u_rows: Command of each joint, shape (K, 2, lanes) if `per_lane` (written in closed loop), else (K, 2, R).
        row_steps: Length of the steps from each row to the next, shape (K, R) [s].
        substeps: Their number, shape (K, R); 0 holds the state.
        per_lane: Whether every lane has commands of its own.
        closed: Whether `gains` close the loop; then `per_lane`.
        gains: State feedback, shape (2, 4).
        references: Shape (K, 4, R).
        noise: Measurement noise of the loop, shape (K, 4, lanes); closed loop only.
        settings: Time constant of the rate filter [s] (negative: rates are measured), limit of the command.
        past: True coordinates and rates for sensor delays, shape (K + 1, 4, lanes); else (1, 4, 1).
        out: Coordinates as recorded, then true rates, shape (K + 1, 4, lanes).
        first_row: Row at which the states stand.
        last_row: Row to which they are brought.
        begin: First lane.
        end: Lane after the last.
    """
    windows = substeps.shape[1]
    S = np.zeros(R.N_ROWS * W)
    pointers = np.zeros(W, dtype=np.int64)
    counts = np.zeros(W, dtype=np.int64)
    lanes = np.zeros((2, W), dtype=np.int64)
    for lane0 in range(begin, end, W):
        count = min(W, end - lane0)
        for w in range(W):
            lane = lane0 + min(w, count - 1)  # a short block repeats its last lane
            lanes[0, w] = lane % windows
            lanes[1, w] = lane if per_lane else lane % windows
            pointers[w] = 0
            for i in range(R.N_COEFFICIENTS):
                S[i * W + w] = coefficients[i, lane // windows]
            for i in range(R.STATES):
                S[(R.N_COEFFICIENTS + i) * W + w] = states[i, lane]
        _load_body(S)
        for k in range(first_row, last_row):
            _record(S, on, past, t_rows, lanes, k, out, lane0, count)
            if closed:
                _feedback(S, t_rows, u_rows, lanes, k, lane0, count, gains, references, noise, settings)
            else:
                _replay(S, u_rows, lanes, actuated, k)
            least, most = _begin_row(S, on, t_rows, row_steps, substeps, lanes, counts, k)
            for s in range(most):
                if s == 0 or s >= least:
                    _set_step(S, on, counts, s)
                _step(S, on, t_rows, u_rows, lanes, pointers, actuated)
        _record(S, on, past, t_rows, lanes, last_row, out, lane0, count)
        for w in range(count):
            for i in range(R.STATES):
                states[i, lane0 + w] = S[(R.N_COEFFICIENTS + i) * W + w]
