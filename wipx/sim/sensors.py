"""What the sensors show at a row of the log, the feedback computed from it, and an observer's correction; compiled."""

from wipx.core.law import clip, law, maximum, minimum, sin_cos
from wipx.sim import rows as R
from wipx.sim.rows import W


@law
def interpolate(past, t_rows, window, k, j, lane, moment):
    """Coordinate j at a `moment` up to row k: cubic Hermite between rows; at a steady rate before the first."""
    joints = past.shape[1] // 2
    if moment <= t_rows[0, window]:
        return past[0, j, lane] + (moment - t_rows[0, window]) * past[0, joints + j, lane]
    i = k - 1
    while i > 0 and t_rows[i, window] > moment:
        i -= 1
    h = t_rows[i + 1, window] - t_rows[i, window]
    if h <= 0.0:
        return past[i + 1, j, lane]
    x = minimum(maximum((moment - t_rows[i, window]) / h, 0.0), 1.0)
    a, b = past[i, j, lane], past[i + 1, j, lane]
    da, db = h * past[i, joints + j, lane], h * past[i + 1, joints + j, lane]
    c = b - a
    return a + x * (da + x * ((3.0 * c - 2.0 * da - db) + x * (da + db - 2.0 * c)))


@law
def record(B, n, has, past, t_rows, lanes, k, out, lane0, count):
    """Write what the sensors show at row k: coordinates as recorded, rates as they are."""
    joints = out.shape[1] // 2
    for j in range(joints):
        J = B[j]
        for w in range(n):
            J[R.SHOWN * W + w] = (1.0 + J[R.SCALE * W + w]) * J[R.Q * W + w] + J[R.BIAS * W + w]
        if has[j, R.ON_SENSOR_DELAY]:
            for w in range(count):
                past[k, j, lane0 + w] = J[R.Q * W + w]
                past[k, joints + j, lane0 + w] = J[R.V * W + w]
                moment = t_rows[k, lanes[0, w]] - J[R.SENSOR_DELAY * W + w]
                late = interpolate(past, t_rows, lanes[0, w], k, j, lane0 + w, moment)
                J[R.SHOWN * W + w] = (1.0 + J[R.SCALE * W + w]) * late + J[R.BIAS * W + w]
        if has[j, R.ON_ECCENTRICITY]:
            for w in range(n):
                sine, cosine = sin_cos(J[R.ECCENTRIC_NUMBER * W + w] * J[R.SHOWN * W + w])
                error = J[R.ECCENTRIC_SINE * W + w] * sine + J[R.ECCENTRIC_COSINE * W + w] * cosine
                J[R.SHOWN * W + w] += error / J[R.ECCENTRIC_NUMBER * W + w]
        for w in range(count):
            out[k, j, lane0 + w] = J[R.SHOWN * W + w]
            out[k, joints + j, lane0 + w] = J[R.V * W + w]


@law
def feedback(B, n, t_rows, u_rows, lanes, k, lane0, count, gains, references, noise, settings):
    """State feedback u = -K (y - y_ref) on what the sensors show, at the rows of the log."""
    smoothing, limit = settings[0], settings[1]
    joints = len(gains)
    for j in range(joints):
        J = B[j]
        for w in range(count):
            J[R.NOISE * W + w] = noise[k, j, lane0 + w]
            J[R.NOISE_RATE * W + w] = noise[k, joints + j, lane0 + w]
        for w in range(n):
            window = lanes[0, w]
            J[R.REFERENCE * W + w] = references[k, j, window]
            J[R.REFERENCE_RATE * W + w] = references[k, joints + j, window]
        if smoothing < 0.0:
            for w in range(n):
                J[R.MEASURED_RATE * W + w] = J[R.V * W + w] + J[R.NOISE_RATE * W + w]
        else:  # rates from differences of the coordinates, through a low-pass
            for w in range(n):
                window = lanes[0, w]
                dt = t_rows[k, window] - t_rows[max(k, 1) - 1, window]
                moved = J[R.SHOWN * W + w] + J[R.NOISE * W + w] - J[R.MEASURED * W + w]
                rate = J[R.MEASURED_RATE * W + w]
                filtered = rate + (moved - rate * dt) / (dt + smoothing)
                J[R.MEASURED_RATE * W + w] = filtered if k > 0 else 0.0
        for w in range(n):
            J[R.MEASURED * W + w] = J[R.SHOWN * W + w] + J[R.NOISE * W + w]
    for c in range(joints):
        C = B[c]
        for w in range(n):
            C[R.COMMAND * W + w] = 0.0
        for j in range(joints):
            J = B[j]
            place, rate = gains[c, j], gains[c, joints + j]
            for w in range(n):
                off = place * (J[R.MEASURED * W + w] - J[R.REFERENCE * W + w])
                C[R.COMMAND * W + w] -= off + rate * (J[R.MEASURED_RATE * W + w] - J[R.REFERENCE_RATE * W + w])
        for w in range(n):
            C[R.COMMAND * W + w] = clip(C[R.COMMAND * W + w], -limit, limit)
        for w in range(count):
            u_rows[k, c, lane0 + w] = C[R.COMMAND * W + w]


@law
def correct(B, has, past, t_rows, lanes, k, lane0, count, measured, gains, group, counts):
    """Move the state by what an observer's gains make of recorded minus shown, at a row of the log.

    `measured` has the coordinates of N joints, and maybe their rates, shape (K + 1, channels, R). `gains` has the shape
    (groups, K + 1, R, states, channels), zero where nothing was measured; the states are coordinates, rates, and maybe
    an acceleration that acts on each joint besides. `group` says which of the gains each model has.
    """
    windows, joints = measured.shape[2], len(B)
    sees_rates, pushes = measured.shape[1] > joints, gains.shape[3] > 2 * joints
    for w in range(count):
        window = lanes[0, w]
        gain = gains[group[(lane0 + w) // windows], k, window]
        for i in range(joints):
            J = B[i]
            J[R.NEXT * W + w] = measured[k, i, window] - J[R.SHOWN * W + w]
            if sees_rates:
                J[R.RIGHT * W + w] = measured[k, joints + i, window] - J[R.V * W + w]
        for j in range(joints):
            J = B[j]
            way, rate, extra = 0.0, 0.0, 0.0
            for i in range(joints):
                place = B[i, R.NEXT * W + w]
                way += gain[j, i] * place
                rate += gain[joints + j, i] * place
                if pushes:
                    extra += gain[2 * joints + j, i] * place
                if sees_rates:
                    speed = B[i, R.RIGHT * W + w]
                    way += gain[j, joints + i] * speed
                    rate += gain[joints + j, joints + i] * speed
                    if pushes:
                        extra += gain[2 * joints + j, joints + i] * speed
            J[R.Q * W + w] += way
            J[R.V * W + w] += rate
            if has[j, R.ON_SENSOR_DELAY]:
                correct_past(past, t_rows, window, k, j, lane0 + w, way, rate, J[R.SENSOR_DELAY * W + w])
            if pushes and counts[w] > 0:
                J[R.EXTRA * W + w] += extra


@law
def pushed(B, joints, n):
    """What the accelerations that an observer adds do in a step."""
    for j in range(joints):
        J = B[j]
        for w in range(n):
            rate = J[R.EXTRA * W + w] * J[R.H * W + w]
            J[R.Q * W + w] += 0.5 * J[R.H * W + w] * rate
            J[R.V * W + w] += rate


@law
def guide(B, lanes, k, lane0, count, path, until):
    """Put the state where a path leads, at the rows up to `until` (R,) of each window.

    The path has the shape (rows, 2 N, R) if all models share it, else (rows, 2 N, P R).
    """
    size, joints = path.shape[2], path.shape[1] // 2
    for w in range(count):
        if k <= until[lanes[0, w]]:
            for j in range(joints):
                B[j, R.Q * W + w] = path[k, j, (lane0 + w) % size]
                B[j, R.V * W + w] = path[k, joints + j, (lane0 + w) % size]


@law
def keep(B, lanes, k, lane0, count, places, carried):
    """Store what each lane carries from step to step where `places` (rows, R) has a place for the row, not -1.

    `carried` has the shape (N, STATES, P, places).
    """
    windows = places.shape[1]
    for w in range(count):
        place = places[k, lanes[0, w]]
        if place >= 0:
            for j in range(len(B)):
                for i in range(R.STATES):
                    carried[j, i, (lane0 + w) // windows, place] = B[j, i * W + w]


@law
def correct_past(past, t_rows, window, k, j, lane, way, rate, delay):
    """Move the course of coordinate j too, as far back as its sensor still shows it."""
    joints = past.shape[1] // 2
    i = k
    while i >= 0:
        ago = t_rows[k, window] - t_rows[i, window]
        past[i, j, lane] += way - ago * rate
        past[i, joints + j, lane] += rate
        if ago > delay:
            break
        i -= 1
