"""Mass matrix and forces of the rigid bodies of contract section 2 in mid-step; compiled.

A rigid body is a function of the rows of a block: it writes the mass matrix and adds its forces to those on the
joints. The five plants of contract section 2 have two joints here: translation and joint1 are the first, pitch and
joint2 the second; one that a plant lacks stays at rest. Here all rows are those of one array, so that the compiler sees
that they do not overlap: the block of the first joint, that of the second, the rows of the whole robot.
"""

from wipx.core.law import clip, law, maximum, sin_cos
from wipx.sim import rows as R
from wipx.sim.rows import W

JOINTS = 2
FIRST, SECOND, WHOLE = 0, R.BLOCK, 2 * R.BLOCK
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
def share_after(h, now, event):
    """Share of a step of length h from a time on that is after a payload event [s]."""
    h = maximum(h, 1e-12)
    return clip((now + h - event) / h, 0.0, 1.0)


@law
def _after(A, w):
    """That of lane w."""
    at = WHOLE * W + w
    return share_after(A[R.STEP * W + at], A[R.TIME * W + at], A[EVENT_TIME * W + at])


@law
def payload_event(A, n):
    """Masses after t0 in place of those before, weighed by the share of the step after t0."""
    for w in range(n):
        after = _after(A, w)
        s, c = sin_cos(A[(SECOND + R.MID) * W + w] - A[(WHOLE + BALANCE) * W + w])
        rate = A[(SECOND + R.RATE) * W + w]
        coupling = after * A[(WHOLE + EVENT_COUPLING) * W + w]
        A[(WHOLE + M11) * W + w] += after * A[(WHOLE + EVENT_MASS) * W + w]
        A[(WHOLE + M22) * W + w] += after * A[(WHOLE + EVENT_INERTIA) * W + w]
        A[(WHOLE + M12) * W + w] -= coupling * c
        A[(FIRST + R.FORCE) * W + w] -= coupling * s * rate * rate + after * A[(WHOLE + EVENT_WEIGHT) * W + w]
        A[(SECOND + R.FORCE) * W + w] += after * A[(WHOLE + EVENT_GRAVITY) * W + w] * s


@law
def tilted(A, n, on):
    """The coupling sees the angle to the tilted rail, gravity the angle to the vertical."""
    for w in range(n):
        upright = A[(SECOND + R.MID) * W + w] - A[(WHOLE + BALANCE) * W + w]
        s0, _ = sin_cos(upright)
        s, c = sin_cos(upright - A[(WHOLE + TILT) * W + w])
        rate = A[(SECOND + R.RATE) * W + w]
        coupling = A[(WHOLE + COUPLING) * W + w]
        if on[R.ON_EVENT]:
            coupling += _after(A, w) * A[(WHOLE + EVENT_COUPLING) * W + w]
        A[(WHOLE + M12) * W + w] = -coupling * c
        A[(FIRST + R.FORCE) * W + w] += coupling * (s0 - s) * rate * rate - A[(WHOLE + TILT_FORCE) * W + w]


@law
def wip_body(A, n, on):
    """Wip, cart-pole, pendulum, linear axis."""
    for w in range(n):
        A[(WHOLE + M11) * W + w] = A[(WHOLE + MASS) * W + w]
        A[(WHOLE + M22) * W + w] = A[(WHOLE + INERTIA) * W + w]
    for w in range(n):
        s, c = sin_cos(A[(SECOND + R.MID) * W + w] - A[(WHOLE + BALANCE) * W + w])
        rate = A[(SECOND + R.RATE) * W + w]
        coupling = A[(WHOLE + COUPLING) * W + w]
        A[(WHOLE + M12) * W + w] = -coupling * c
        A[(FIRST + R.FORCE) * W + w] -= coupling * s * rate * rate
        A[(SECOND + R.FORCE) * W + w] += A[(WHOLE + GRAVITY) * W + w] * s
    if on[R.ON_EVENT]:
        payload_event(A, n)
    if on[R.ON_TILT]:
        tilted(A, n, on)


@law
def double_body(A, n):
    """Double pendulum, theta1 = 0 hanging."""
    for w in range(n):
        s2, c2 = sin_cos(A[(SECOND + R.MID) * W + w])
        s1, _ = sin_cos(A[(FIRST + R.MID) * W + w])
        s12, _ = sin_cos(A[(FIRST + R.MID) * W + w] + A[(SECOND + R.MID) * W + w])
        v1, v2 = A[(FIRST + R.RATE) * W + w], A[(SECOND + R.RATE) * W + w]
        h = A[(WHOLE + DP_COUPLING) * W + w]
        elbow = A[(WHOLE + DP_ELBOW) * W + w]
        A[(WHOLE + M11) * W + w] = A[(WHOLE + DP_BASE) * W + w] + 2.0 * h * c2 + A[(FIRST + R.ROTOR) * W + w]
        A[(WHOLE + M12) * W + w] = elbow + h * c2
        A[(WHOLE + M22) * W + w] = elbow + A[(SECOND + R.ROTOR) * W + w]
        lower = A[(WHOLE + DP_GRAVITY) * W + w] * s12
        A[(FIRST + R.FORCE) * W + w] += h * s2 * (2.0 * v1 + v2) * v2 - A[(WHOLE + DP_GRAVITY1) * W + w] * s1 - lower
        A[(SECOND + R.FORCE) * W + w] += -h * s2 * v1 * v1 - lower
