"""What the sensors show at a row of the log, the feedback computed from it, and an observer's correction; compiled."""

from wipx.core.law import clip, law, maximum, minimum
from wipx.sim import rows as R
from wipx.sim.rows import W


@law
def interpolate(past, t_rows, window, k, j, lane, moment):
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
def record(S, n, on, past, t_rows, lanes, k, out, lane0, count):
    """Write what the sensors show at row k: coordinates as recorded, rates as they are."""
    for j in range(2):
        for w in range(n):
            true = S[(R.Q + j) * W + w]
            S[(R.SHOWN + j) * W + w] = (1.0 + S[(R.SCALE + j) * W + w]) * true + S[(R.BIAS + j) * W + w]
    if on[R.ON_SENSOR_DELAY]:
        for j in range(2):
            for w in range(count):
                past[k, j, lane0 + w] = S[(R.Q + j) * W + w]
                past[k, 2 + j, lane0 + w] = S[(R.V + j) * W + w]
                moment = t_rows[k, lanes[0, w]] - S[(R.SENSOR_DELAY + j) * W + w]
                late = interpolate(past, t_rows, lanes[0, w], k, j, lane0 + w, moment)
                S[(R.SHOWN + j) * W + w] = (1.0 + S[(R.SCALE + j) * W + w]) * late + S[(R.BIAS + j) * W + w]
    for j in range(2):
        out[k, j, lane0 : lane0 + count] = S[(R.SHOWN + j) * W : (R.SHOWN + j) * W + count]
        out[k, 2 + j, lane0 : lane0 + count] = S[(R.V + j) * W : (R.V + j) * W + count]


@law
def feedback(S, n, t_rows, u_rows, lanes, k, lane0, count, gains, references, noise, settings):
    """State feedback u = -K (y - y_ref) on what the sensors show, at the rows of the log."""
    smoothing, limit = settings[0], settings[1]
    for i in range(4):
        S[(R.NOISE + i) * W : (R.NOISE + i) * W + count] = noise[k, i, lane0 : lane0 + count]
        reference = references[k, i]
        for w in range(n):
            S[(R.REFERENCE + i) * W + w] = reference[lanes[0, w]]
    if smoothing >= 0.0:  # rates from differences of the coordinates, through a low-pass
        for w in range(n):
            window = lanes[0, w]
            S[R.TIME * W + w] = t_rows[k, window] - t_rows[max(k, 1) - 1, window]
    for j in range(2):
        if smoothing < 0.0:
            for w in range(n):
                S[(R.MEASURED_RATE + j) * W + w] = S[(R.V + j) * W + w] + S[(R.NOISE_RATE + j) * W + w]
        else:
            for w in range(n):
                dt = S[R.TIME * W + w]
                moved = S[(R.SHOWN + j) * W + w] + S[(R.NOISE + j) * W + w] - S[(R.MEASURED + j) * W + w]
                rate = S[(R.MEASURED_RATE + j) * W + w]
                filtered = rate + (moved - rate * dt) / (dt + smoothing)
                S[(R.MEASURED_RATE + j) * W + w] = filtered if k > 0 else 0.0
        for w in range(n):
            S[(R.MEASURED + j) * W + w] = S[(R.SHOWN + j) * W + w] + S[(R.NOISE + j) * W + w]
    for c in range(2):
        k0, k1, k2, k3 = gains[c, 0], gains[c, 1], gains[c, 2], gains[c, 3]
        for w in range(n):
            u = -k0 * (S[R.MEASURED * W + w] - S[R.REFERENCE * W + w])
            u -= k1 * (S[R.MEASURED1 * W + w] - S[R.REFERENCE1 * W + w])
            u -= k2 * (S[R.MEASURED_RATE * W + w] - S[R.REFERENCE_RATE * W + w])
            u -= k3 * (S[R.MEASURED_RATE1 * W + w] - S[R.REFERENCE_RATE1 * W + w])
            S[(R.COMMAND + c) * W + w] = clip(u, -limit, limit)
        u_rows[k, c, lane0 : lane0 + count] = S[(R.COMMAND + c) * W : (R.COMMAND + c) * W + count]


@law
def correct(S, on, past, t_rows, lanes, k, lane0, count, measured, gains, drift, group, counts):
    """Move the state by what an observer's gains make of recorded minus shown, at a row of the log.

    `measured` has coordinates and rates, shape (K + 1, 4, R); `gains` the shape (groups, K + 1, R, 4 states,
    4 channels), zero where nothing was measured; `group` says which of them each model has. `drift` has the gains of
    an acceleration that acts on each joint besides, shape (groups, K + 1, R, 2, 4), or (1, 1, 1, 2, 4) without one:
    what it does until the next row is added at once.
    """
    windows = measured.shape[2]
    for w in range(count):
        window = lanes[0, w]
        gain = gains[group[(lane0 + w) // windows], k, window]
        e0 = measured[k, 0, window] - S[R.SHOWN * W + w]
        e1 = measured[k, 1, window] - S[R.SHOWN1 * W + w]
        e2 = measured[k, 2, window] - S[R.V * W + w]
        e3 = measured[k, 3, window] - S[R.V1 * W + w]
        for j in range(2):
            way = gain[j, 0] * e0 + gain[j, 1] * e1 + gain[j, 2] * e2 + gain[j, 3] * e3
            rate = gain[2 + j, 0] * e0 + gain[2 + j, 1] * e1 + gain[2 + j, 2] * e2 + gain[2 + j, 3] * e3
            S[(R.Q + j) * W + w] += way
            S[(R.V + j) * W + w] += rate
            if on[R.ON_SENSOR_DELAY]:
                correct_past(past, t_rows, window, k, j, lane0 + w, way, rate, S[(R.SENSOR_DELAY + j) * W + w])
        if drift.shape[1] > 1 and counts[w] > 0:
            own = drift[group[(lane0 + w) // windows], k, window]
            dt = t_rows[k + 1, window] - t_rows[k, window]
            for j in range(2):
                S[(R.EXTRA + j) * W + w] += own[j, 0] * e0 + own[j, 1] * e1 + own[j, 2] * e2 + own[j, 3] * e3
                S[(R.Q + j) * W + w] -= 0.5 * S[(R.EXTRA + j) * W + w] * dt**2  # the rate below drifts on by twice this
                S[(R.V + j) * W + w] += S[(R.EXTRA + j) * W + w] * dt


@law
def guide(S, lanes, k, lane0, count, path, until):
    """Put the state where a path leads, at the rows up to `until` (R,) of each window.

    The path has the shape (rows, 4, R) if all models share it, else (rows, 4, P R).
    """
    size = path.shape[2]
    for w in range(count):
        if k <= until[lanes[0, w]]:
            for i in range(4):
                S[(R.Q + i) * W + w] = path[k, i, (lane0 + w) % size]


@law
def correct_past(past, t_rows, window, k, j, lane, way, rate, delay):
    """Move the course of coordinate j too, as far back as its sensor still shows it."""
    i = k
    while i >= 0:
        ago = t_rows[k, window] - t_rows[i, window]
        past[i, j, lane] += way - ago * rate
        past[i, 2 + j, lane] += rate
        if ago > delay:
            break
        i -= 1
