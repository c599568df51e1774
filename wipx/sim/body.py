"""Mass matrix and forces of rigid body and environment in mid-step; compiled. Contract section 2."""

from wipx.core.law import clip, law, maximum, sin_cos
from wipx.sim import rows as R
from wipx.sim.rows import W


@law
def load_body(S, n):
    """The body as it is before any payload event."""
    for w in range(n):
        S[R.M11 * W + w] = S[R.MASS * W + w]
        S[R.M22 * W + w] = S[R.INERTIA * W + w]
        S[R.COUPLING_NOW * W + w] = S[R.COUPLING * W + w]
        S[R.GRAVITY_NOW * W + w] = S[R.GRAVITY * W + w]


@law
def share_after(S, w):
    """Share of the step of lane w that is after the payload event."""
    h = maximum(S[R.STEP * W + w], 1e-12)
    return clip((S[R.TIME * W + w] + h - S[R.EVENT_TIME * W + w]) / h, 0.0, 1.0)


@law
def payload_event(S, n):
    """Masses after t0 in place of those before, weighed by the share of the step after t0."""
    load_body(S, n)
    for w in range(n):
        after = share_after(S, w)
        S[R.M11 * W + w] += after * S[R.EVENT_MASS * W + w]
        S[R.M22 * W + w] += after * S[R.EVENT_INERTIA * W + w]
        S[R.COUPLING_NOW * W + w] += after * S[R.EVENT_COUPLING * W + w]
        S[R.GRAVITY_NOW * W + w] += after * S[R.EVENT_GRAVITY * W + w]
        S[R.FORCE * W + w] -= after * S[R.EVENT_WEIGHT * W + w]


@law
def spring(S, n):
    """Cable, hose or bumper on the carriage."""
    for w in range(n):
        S[R.FORCE * W + w] -= S[R.SPRING * W + w] * (S[R.MID * W + w] - S[R.SPRING_REST * W + w])


@law
def wip_body(S, n, on):
    """Mass matrix and forces of the rigid body; contract section 2."""
    for w in range(n):
        s, c = sin_cos(S[R.MID1 * W + w] - S[R.BALANCE * W + w])
        rate = S[R.RATE1 * W + w]
        coupling = S[R.COUPLING_NOW * W + w]
        S[R.M12 * W + w] = -coupling * c
        S[R.FORCE * W + w] -= coupling * s * rate * rate
        S[R.FORCE1 * W + w] += S[R.GRAVITY_NOW * W + w] * s
    if on[R.ON_TILT]:
        # The coupling sees the angle to the rail, gravity the angle to the vertical.
        for w in range(n):
            upright = S[R.MID1 * W + w] - S[R.BALANCE * W + w]
            s0, _ = sin_cos(upright)
            s, c = sin_cos(upright - S[R.TILT * W + w])
            rate = S[R.RATE1 * W + w]
            coupling = S[R.COUPLING_NOW * W + w]
            S[R.M12 * W + w] = -coupling * c
            S[R.FORCE * W + w] += coupling * (s0 - s) * rate * rate - S[R.TILT_FORCE * W + w]


@law
def double_body(S, n):
    """Mass matrix and forces of the double pendulum, theta1 = 0 hanging."""
    for w in range(n):
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
