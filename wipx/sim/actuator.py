"""The path from the command to the force on a joint, in causal order; compiled.

Delay, the loop of a position drive, offset, dead zone, sag, gain, saturation, speed limit, back-EMF, lag, ripple,
backlash or elasticity. A drive that reports its force knows it up to the lag; what follows is mechanical. Every part
is a loop over the lanes of a block and is skipped where it is absent (see `wipx.sim.kernel`).
"""

from wipx.core.law import clip, law, sign, sin_cos
from wipx.effects import backlash as backlash_law
from wipx.effects import dead_zone, sag, saturation, speed_limit
from wipx.effects.trees import elasticity
from wipx.sim import rows as R
from wipx.sim.rows import W

EARLY = 1e-9  # [s] before its time that the loop of a drive looks; steps end there but for rounding


@law
def delayed_command(S, J, n, on, t_rows, u_rows, ramps, lanes, pointers, j):
    """The mean command of joint j over the step, after the transport delay (scalar: every lane has its own past)."""
    last = t_rows.shape[0] - 2
    for w in range(n):
        h = S[R.STEP * W + w]
        if h <= 0.0:
            J[R.DRIVE * W + w] = J[R.COMMAND * W + w]
            continue
        window, column = lanes[0, w], lanes[1, w]
        begin = S[R.TIME * W + w] - J[R.DELAY * W + w]
        end = begin + h
        k = pointers[j, w]
        while k < last and t_rows[k + 1, window] <= begin:
            k += 1
        pointers[j, w] = k
        total = 0.0
        done = begin
        while k < last and t_rows[k + 1, window] < end:
            total += (t_rows[k + 1, window] - done) * u_rows[k, j, column]
            if on[R.ON_RAMP]:
                total += ramped(t_rows, ramps, window, k, j, done, t_rows[k + 1, window])
            done = t_rows[k + 1, window]
            k += 1
        total += (end - done) * u_rows[k, j, column]
        if on[R.ON_RAMP]:
            total += ramped(t_rows, ramps, window, k, j, done, end)
        J[R.DRIVE * W + w] = total / h * J[R.INPUT_GAIN * W + w]


@law
def ramped(t_rows, ramps, window, i, j, begin, end):
    """What the change of command j along row i adds to its integral from `begin` to `end`."""
    middle = 0.5 * (begin + end) - t_rows[i, window]
    place = middle / (t_rows[i + 1, window] - t_rows[i, window]) - 0.5
    return (end - begin) * ramps[i, j, window] * clip(place, -0.5, 0.5)


@law
def servo(S, J, n):
    """The force of a position drive for the target that has arrived; between the turns of its loop it is held."""
    for w in range(n):
        period, now = J[R.SERVO_PERIOD * W + w], S[R.TIME * W + w]
        sampled = period > 0.0
        q = J[R.Q * W + w] if sampled else J[R.MID * W + w]
        v = J[R.V * W + w] if sampled else J[R.RATE * W + w]
        limit = J[R.SERVO_LIMIT * W + w]
        force = clip(J[R.SERVO_KP * W + w] * (J[R.DRIVE * W + w] - q) - J[R.SERVO_KD * W + w] * v, -limit, limit)
        due = not sampled or now >= J[R.SERVO_NEXT * W + w] - EARLY or J[R.STARTED * W + w] == 0.0
        if due and J[R.H * W + w] > 0.0:
            following = J[R.SERVO_NEXT * W + w] + period
            J[R.SERVO_NEXT * W + w] = following if following > now else now + period
            J[R.SERVO_FORCE * W + w] = force
        J[R.DRIVE * W + w] = force if due else J[R.SERVO_FORCE * W + w]


@law
def actuator_path(S, J, n, on, has, j):
    """From the command of a joint to the force on it."""
    if has[j, R.ON_SERVO]:
        servo(S, J, n)
    if has[j, R.ON_OFFSET]:
        for w in range(n):
            J[R.DRIVE * W + w] += J[R.OFFSET * W + w]
    if has[j, R.ON_DEAD_ZONE]:
        for w in range(n):
            J[R.DRIVE * W + w] = dead_zone.force(J[R.DRIVE * W + w], J[R.DEAD_BAND * W + w], J[R.SPREAD * W + w])
    if has[j, R.ON_SAG]:
        for w in range(n):
            middle = J[R.SAG_MIDDLE * W + w]
            emptied = J[R.SAG_TIME * W + w] * (min(S[R.TIME * W + w], 2.0 * middle) - middle)
            load, usual, most = J[R.SAG_LOAD * W + w], J[R.SAG_USUAL * W + w], J[R.SAG_MOST * W + w]
            J[R.DRIVE * W + w] = sag.force(J[R.DRIVE * W + w], emptied, load, usual, most, J[R.SPREAD * W + w])
    if has[j, R.ON_GAIN]:
        for w in range(n):
            J[R.DRIVE * W + w] *= J[R.GAIN * W + w]
    if has[j, R.ON_SATURATION]:
        for w in range(n):
            J[R.DRIVE * W + w] = saturation.force(J[R.DRIVE * W + w], J[R.FORCE_MAX * W + w], J[R.SPREAD * W + w])
    if has[j, R.ON_SPEED_LIMIT]:
        for w in range(n):
            J[R.DRIVE * W + w] = speed_limit.limited(
                J[R.DRIVE * W + w], J[R.RATE * W + w], J[R.STALL * W + w], J[R.FREE_SPEED * W + w], J[R.SPREAD * W + w]
            )
    if has[j, R.ON_BACK_EMF]:
        for w in range(n):
            J[R.DRIVE * W + w] -= J[R.BACK_EMF * W + w] * J[R.RATE * W + w]
    if has[j, R.ON_LAG]:
        for w in range(n):
            rest = J[R.STARTED * W + w] * (J[R.LAGGED * W + w] - J[R.DRIVE * W + w])
            lagged = J[R.DRIVE * W + w] + rest * J[R.LAG_KEPT * W + w]
            J[R.LAGGED * W + w] = lagged if J[R.H * W + w] > 0.0 else J[R.LAGGED * W + w]
            J[R.DRIVE * W + w] += rest * J[R.LAG_MEAN * W + w]
    if on[R.ON_REPORT]:
        for w in range(n):
            J[R.DELIVERED * W + w] += J[R.H * W + w] * J[R.DRIVE * W + w]
    if has[j, R.ON_RIPPLE]:
        for w in range(n):
            angle = J[R.RIPPLE_PERIODS * W + w] * J[R.MID * W + w] + J[R.RIPPLE_PHASE * W + w]
            _, cosine = sin_cos(angle)
            J[R.DRIVE * W + w] += J[R.RIPPLE * W + w] * cosine
    if has[j, R.ON_BACKLASH]:
        backlash(J, n)
    if has[j, R.ON_ELASTICITY]:
        elastic(J, n)


@law
def backlash(J, n):
    """Pass on the force of a joint where its drive is in contact."""
    for w in range(n):
        force = J[R.DRIVE * W + w]
        gap = J[R.GAP * W + w]
        begun = J[R.STARTED * W + w] > 0.0
        before = J[R.PLACE * W + w] if begun else 0.5 * gap * sign(force)
        place, speed, passed = backlash_law.cross(
            before,
            J[R.DRIVE_SPEED * W + w],
            force,
            J[R.ACCELERATION * W + w] - J[R.MADE * W + w],
            J[R.LIGHTNESS * W + w],
            gap,
            J[R.DRIVE_INERTIA * W + w],
            J[R.DRIVE_DAMPING * W + w],
            J[R.RETURNED * W + w],
            J[R.H * W + w],
        )
        passed = passed if gap > 0.0 else force
        rest = J[R.PASSED * W + w] - passed if begun and gap > 0.0 else 0.0
        J[R.PLACE * W + w] = place
        J[R.DRIVE_SPEED * W + w] = speed
        if J[R.H * W + w] > 0.0:
            J[R.PASSED * W + w] = passed + rest * J[R.CONTACT_KEPT * W + w]
        J[R.DRIVE * W + w] = passed + rest * J[R.CONTACT_MEAN * W + w]


@law
def elastic(J, n):
    """Pass on the force of a joint through the spring of its drive, which at first holds that force at rest."""
    for w in range(n):
        stiffness, damping = J[R.ELASTIC_STIFFNESS * W + w], J[R.ELASTIC_DAMPING * W + w]
        inertia, h = J[R.ELASTIC_INERTIA * W + w], J[R.H * W + w]
        force, begun = J[R.DRIVE * W + w], J[R.STARTED * W + w] > 0.0
        twist = J[R.TWIST * W + w] if begun else force / stiffness
        rate = J[R.DRIVE_RATE * W + w] if begun else J[R.V * W + w]
        still, lost = elasticity.passed_on(force, twist, rate, stiffness, damping, inertia, h)
        J[R.TWIST * W + w], J[R.DRIVE_RATE * W + w] = twist, rate
        J[R.MOTOR_FORCE * W + w], J[R.TAKEN_BACK * W + w] = force, lost
        J[R.DRIVE * W + w] = still - lost * J[R.RATE * W + w]


@law
def taken_back(J, n):
    """What the spring of a drive takes back per rate of its link: linear in that of the step, which is solved for."""
    for w in range(n):
        J[R.FORCE * W + w] += J[R.TAKEN_BACK * W + w] * J[R.RATE * W + w]
        J[R.DAMPING * W + w] += J[R.TAKEN_BACK * W + w]


@law
def sprung(J, n):
    """Move the drive on its spring, after the mean rate of its link is known."""
    for w in range(n):
        J[R.TWIST * W + w], J[R.DRIVE_RATE * W + w] = elasticity.moved(
            J[R.MOTOR_FORCE * W + w],
            J[R.TWIST * W + w],
            J[R.DRIVE_RATE * W + w],
            J[R.RATE * W + w],
            J[R.ELASTIC_STIFFNESS * W + w],
            J[R.ELASTIC_DAMPING * W + w],
            J[R.ELASTIC_INERTIA * W + w],
            J[R.H * W + w],
        )
