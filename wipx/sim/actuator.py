"""The path from the command to the force on a joint, in causal order; compiled.

Delay, offset, dead zone, gain, saturation, speed limit, back-EMF, lag, ripple, backlash. A drive that reports
its force knows it up to the lag; ripple and backlash are mechanical. Every part is a loop over the lanes of a
block and is skipped where it is absent (see `wipx.sim.kernel`).
"""

from wipx.core.law import clip, inlined, law, sign, sin_cos
from wipx.effects import backlash as backlash_law
from wipx.effects import dead_zone, saturation, speed_limit
from wipx.sim import rows as R
from wipx.sim.rows import W


@law
def delayed_command(S, n, on, t_rows, u_rows, ramps, lanes, pointers, actuated):
    """The mean command over the step, after the transport delay (scalar: every lane has its own past)."""
    last = t_rows.shape[0] - 2
    for w in range(n):
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
                if on[R.ON_RAMP]:
                    total += ramped(t_rows, ramps, window, i, j, done, t_rows[i + 1, window])
                done = t_rows[i + 1, window]
                i += 1
            total += (end - done) * u_rows[i, j, column]
            if on[R.ON_RAMP]:
                total += ramped(t_rows, ramps, window, i, j, done, end)
            S[(R.DRIVE + j) * W + w] = total / h * S[R.INPUT_GAIN * W + w]


@law
def ramped(t_rows, ramps, window, i, j, begin, end):
    """What the change of command j along row i adds to its integral from `begin` to `end`."""
    middle = 0.5 * (begin + end) - t_rows[i, window]
    place = middle / (t_rows[i + 1, window] - t_rows[i, window]) - 0.5
    return (end - begin) * ramps[i, j, window] * clip(place, -0.5, 0.5)


@inlined
def actuator_path(S, n, on, j):
    """From the command of joint j to the force on it."""
    u = (R.DRIVE + j) * W
    v = (R.RATE + j) * W
    if on[R.ON_OFFSET]:
        for w in range(n):
            S[u + w] += S[R.OFFSET * W + w]
    if on[R.ON_DEAD_ZONE]:
        for w in range(n):
            S[u + w] = dead_zone.force(S[u + w], S[R.DEAD_BAND * W + w], S[(R.SPREAD + j) * W + w])
    for w in range(n):
        S[u + w] *= S[R.GAIN * W + w]
    if on[R.ON_SATURATION]:
        for w in range(n):
            S[u + w] = saturation.force(S[u + w], S[R.FORCE_MAX * W + w], S[(R.SPREAD + j) * W + w])
    if on[R.ON_SPEED_LIMIT]:
        for w in range(n):
            S[u + w] = speed_limit.limited(
                S[u + w], S[v + w], S[R.STALL * W + w], S[R.FREE_SPEED * W + w], S[(R.SPREAD + j) * W + w]
            )
    if on[R.ON_BACK_EMF]:
        for w in range(n):
            S[u + w] -= S[R.BACK_EMF * W + w] * S[v + w]
    if on[R.ON_LAG]:
        a = (R.LAGGED + j) * W
        for w in range(n):
            rest = S[R.STARTED * W + w] * (S[a + w] - S[u + w])
            S[a + w] = S[u + w] + rest * S[R.LAG_KEPT * W + w] if S[R.STEP * W + w] > 0.0 else S[a + w]
            S[u + w] += rest * S[R.LAG_MEAN * W + w]
    if on[R.ON_REPORT]:
        for w in range(n):
            S[(R.DELIVERED + j) * W + w] += S[R.STEP * W + w] * S[u + w]
    if on[R.ON_RIPPLE]:
        for w in range(n):
            angle = S[R.RIPPLE_PERIODS * W + w] * S[(R.MID + j) * W + w] + S[R.RIPPLE_PHASE * W + w]
            _, cosine = sin_cos(angle)
            S[u + w] += S[R.RIPPLE * W + w] * cosine
    if on[R.ON_BACKLASH]:
        backlash(S, n, j)


@inlined
def backlash(S, n, j):
    """Pass on the force of joint j where its drive is in contact."""
    for w in range(n):
        force = S[(R.DRIVE + j) * W + w]
        gap = S[R.GAP * W + w]
        begun = S[R.STARTED * W + w] > 0.0
        before = S[(R.PLACE + j) * W + w] if begun else 0.5 * gap * sign(force)
        place, speed, passed = backlash_law.cross(
            before,
            S[(R.DRIVE_SPEED + j) * W + w],
            force,
            S[(R.ACCELERATION + j) * W + w] - S[(R.MADE + j) * W + w],
            S[(R.LIGHTNESS + j) * W + w],
            gap,
            S[R.DRIVE_INERTIA * W + w],
            S[R.DRIVE_DAMPING * W + w],
            S[R.RETURNED * W + w],
            S[R.STEP * W + w],
        )
        passed = passed if gap > 0.0 else force
        rest = S[(R.PASSED + j) * W + w] - passed if begun and gap > 0.0 else 0.0
        S[(R.PLACE + j) * W + w] = place
        S[(R.DRIVE_SPEED + j) * W + w] = speed
        if S[R.STEP * W + w] > 0.0:
            S[(R.PASSED + j) * W + w] = passed + rest * S[R.CONTACT_KEPT * W + w]
        S[(R.DRIVE + j) * W + w] = passed + rest * S[R.CONTACT_MEAN * W + w]
