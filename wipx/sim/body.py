"""Mass matrix and forces of the rigid bodies of contract section 2 in mid-step; compiled.

A rigid body is a function of the rows of a block: it writes the mass matrix and adds its forces to those on the
joints. The five plants of contract section 2 have two joints here: translation and joint1 are the first, pitch and
joint2 the second; one that a plant lacks stays at rest.
"""

from wipx.core.law import clip, law, maximum, sin_cos
from wipx.sim import rows as R
from wipx.sim.cache import part
from wipx.sim.rows import W

JOINTS = 2
M11, M12, M22 = range(R.COMMON, R.COMMON + 3)

# Numbers of the rigid body.
(
    MASS, COUPLING, INERTIA, GRAVITY,  # wip family: M11, m_b L, M22, m_b g L
    BALANCE, TILT, TILT_FORCE,
    EVENT_MASS, EVENT_COUPLING, EVENT_INERTIA, EVENT_GRAVITY, EVENT_WEIGHT, EVENT_TIME,
    DP_BASE, DP_ELBOW, DP_COUPLING, DP_GRAVITY, DP_GRAVITY1,  # double pendulum
    ROWS,
    *_,
) = range(R.COMMON + 3, 100)  # fmt: skip


@law
def share_after(S, w):
    """Share of the step of lane w that is after the payload event."""
    h = maximum(S[R.STEP * W + w], 1e-12)
    return clip((S[R.TIME * W + w] + h - S[EVENT_TIME * W + w]) / h, 0.0, 1.0)


@law
def payload_event(S, B, n):
    """Masses after t0 in place of those before, weighed by the share of the step after t0."""
    P, D = B[0], B[1]
    for w in range(n):
        after = share_after(S, w)
        s, c = sin_cos(D[R.MID * W + w] - S[BALANCE * W + w])
        rate = D[R.RATE * W + w]
        coupling = after * S[EVENT_COUPLING * W + w]
        S[M11 * W + w] += after * S[EVENT_MASS * W + w]
        S[M22 * W + w] += after * S[EVENT_INERTIA * W + w]
        S[M12 * W + w] -= coupling * c
        P[R.FORCE * W + w] -= coupling * s * rate * rate + after * S[EVENT_WEIGHT * W + w]
        D[R.FORCE * W + w] += after * S[EVENT_GRAVITY * W + w] * s


@law
def tilted(S, B, n, on):
    """The coupling sees the angle to the tilted rail, gravity the angle to the vertical."""
    P, D = B[0], B[1]
    for w in range(n):
        upright = D[R.MID * W + w] - S[BALANCE * W + w]
        s0, _ = sin_cos(upright)
        s, c = sin_cos(upright - S[TILT * W + w])
        rate = D[R.RATE * W + w]
        coupling = S[COUPLING * W + w]
        if on[R.ON_EVENT]:
            coupling += share_after(S, w) * S[EVENT_COUPLING * W + w]
        S[M12 * W + w] = -coupling * c
        P[R.FORCE * W + w] += coupling * (s0 - s) * rate * rate - S[TILT_FORCE * W + w]


@part
def wip_body(S, B, n, on, asked):
    """Wip, cart-pole, pendulum, linear axis."""
    P, D = B[0], B[1]
    for w in range(n):
        S[M11 * W + w] = S[MASS * W + w]
        S[M22 * W + w] = S[INERTIA * W + w]
    for w in range(n):
        s, c = sin_cos(D[R.MID * W + w] - S[BALANCE * W + w])
        rate = D[R.RATE * W + w]
        coupling = S[COUPLING * W + w]
        S[M12 * W + w] = -coupling * c
        P[R.FORCE * W + w] -= coupling * s * rate * rate
        D[R.FORCE * W + w] += S[GRAVITY * W + w] * s
    if on[R.ON_EVENT]:
        payload_event(S, B, n)
    if on[R.ON_TILT]:
        tilted(S, B, n, on)


@part
def double_body(S, B, n, on, asked):
    """Double pendulum, theta1 = 0 hanging."""
    P, D = B[0], B[1]
    for w in range(n):
        s2, c2 = sin_cos(D[R.MID * W + w])
        s1, _ = sin_cos(P[R.MID * W + w])
        s12, _ = sin_cos(P[R.MID * W + w] + D[R.MID * W + w])
        v1, v2 = P[R.RATE * W + w], D[R.RATE * W + w]
        h = S[DP_COUPLING * W + w]
        elbow = S[DP_ELBOW * W + w]
        S[M11 * W + w] = S[DP_BASE * W + w] + 2.0 * h * c2 + P[R.ROTOR * W + w]
        S[M12 * W + w] = elbow + h * c2
        S[M22 * W + w] = elbow + D[R.ROTOR * W + w]
        lower = S[DP_GRAVITY * W + w] * s12
        P[R.FORCE * W + w] += h * s2 * (2.0 * v1 + v2) * v2 - S[DP_GRAVITY1 * W + w] * s1 - lower
        D[R.FORCE * W + w] += -h * s2 * v1 * v1 - lower
