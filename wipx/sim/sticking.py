"""The rates at the end of a step, with dry friction that truly sticks; compiled.

Dry friction is set-valued: with A the mass matrix and half a step of damping, the impulses p of all joints solve

    A v' = c + p,   p_i in [-h F+_i, h F-_i],   v'_i = 0 inside, p_i at an end otherwise

exactly, so that a joint sticks and is not smoothed (Moreau's time stepping; Acary and Brogliato 2008, Numerical
Methods for Nonsmooth Dynamical Systems, ch. 10). One and two joints have closed forms. For more, each joint has a
side: 1 or -1 where friction pushes with all it has, 0 where it holds the joint. A round solves for the rates with the
held joints at rest, and takes a joint to another side where its impulse or its rate contradicts the side it is on.
From some round on only the first such joint of a lane moves, which ends for certain (Murty 1974, Note on a Bard-type
scheme for solving the complementarity problem, Opsearch 11).
"""

from wipx.core.law import clip, law, maximum
from wipx.sim import rows as R
from wipx.sim.rows import W

TOGETHER_UNTIL = 8  # rounds in which all joints may change sides
MOST_ROUNDS = 200


@law
def row_of(i, j):
    """Row of entry (i, j) of the mass matrix, j <= i."""
    return R.COMMON + i * (i + 1) // 2 + j


@law
def one_joint(S, B, n, on):
    """The closed form for one joint."""
    J = B[0]
    for w in range(n):
        inverse = 1.0 / S[R.COMMON * W + w]
        J[R.INVERSE * W + w] = inverse
        J[R.NEXT * W + w] = J[R.V * W + w] + J[R.H * W + w] * J[R.FORCE * W + w] * inverse
    if on[R.ON_FRICTION]:
        for w in range(n):
            h, inverse, b = J[R.H * W + w], J[R.INVERSE * W + w], J[R.NEXT * W + w]
            p = clip(-b / (inverse + J[R.YIELD * W + w]), -h * J[R.PLUS * W + w], h * J[R.MINUS * W + w])
            J[R.NEXT * W + w] = b + inverse * p


@law
def two_joints(A, n, on):
    """The closed form for two joints."""
    second, whole = R.BLOCK, 2 * R.BLOCK  # rows of the second joint, and of the whole robot
    for w in range(n):
        h = A[(whole + R.STEP) * W + w]
        a11 = A[(whole + R.COMMON) * W + w]
        a12 = A[(whole + R.COMMON + 1) * W + w]
        a22 = A[(whole + R.COMMON + 2) * W + w]
        r0, r1 = h * A[R.FORCE * W + w], h * A[(second + R.FORCE) * W + w]
        inverse = 1.0 / (a11 * a22 - a12 * a12)
        A[R.INVERSE * W + w] = a22 * inverse
        A[(whole + R.CROSS) * W + w] = -a12 * inverse
        A[(second + R.INVERSE) * W + w] = a11 * inverse
        A[R.NEXT * W + w] = A[R.V * W + w] + (a22 * r0 - a12 * r1) * inverse
        A[(second + R.NEXT) * W + w] = A[(second + R.V) * W + w] + (a11 * r1 - a12 * r0) * inverse
    if not on[R.ON_FRICTION]:
        return
    for w in range(n):
        h = A[(whole + R.STEP) * W + w]
        w11, w12, w22 = A[R.INVERSE * W + w], A[(whole + R.CROSS) * W + w], A[(second + R.INVERSE) * W + w]
        b0, b1 = A[R.NEXT * W + w], A[(second + R.NEXT) * W + w]
        low0, high0 = -h * A[R.PLUS * W + w], h * A[R.MINUS * W + w]
        low1, high1 = -h * A[(second + R.PLUS) * W + w], h * A[(second + R.MINUS) * W + w]
        c11, c22 = w11 + A[R.YIELD * W + w], w22 + A[(second + R.YIELD) * W + w]
        both_stick = (w12 * b0 - c11 * b1) / (c11 * c22 - w12 * w12)
        p0 = clip(-(b0 + w12 * clip(both_stick, low1, high1)) / c11, low0, high0)
        p1 = clip(-(b1 + w12 * p0) / c22, low1, high1)
        A[R.NEXT * W + w] = b0 + w11 * p0 + w12 * p1
        A[(second + R.NEXT) * W + w] = b1 + w12 * p0 + w22 * p1


@law
def many_joints(S, B, n, on, has, rigid):
    """Any number of joints; `rigid` holds what solves with their mass matrix, and what multiplies with it."""
    joints = len(has)
    for j in range(joints):
        J = B[j]
        for w in range(n):
            J[R.KEEP * W + w], J[R.HOLD * W + w] = 1.0, 0.0
            J[R.RIGHT * W + w] = J[R.H * W + w] * J[R.FORCE * W + w]
    rigid(S, B, n, on, R.SOLVE)
    for j in range(joints):
        J = B[j]
        for w in range(n):
            J[R.NEXT * W + w] += J[R.V * W + w]
    if on[R.ON_FRICTION]:
        stick_or_slide(S, B, n, on, joints, rigid)
    for j in range(joints):
        if has[j, R.ON_BACKLASH]:
            inverse_mass(S, B, n, on, joints, j, rigid)


@law
def stick_or_slide(S, B, n, on, joints, rigid):
    """Rates with friction, from the rates without; rounds until every joint is on the side that its motion asks for."""
    rigid(S, B, n, on, R.MULTIPLY)  # A times the rates without friction: the impulses c
    for j in range(joints):
        J = B[j]
        for w in range(n):
            J[R.AIM * W + w] = J[R.PUSHED * W + w]
    for turn in range(MOST_ROUNDS):
        for j in range(joints):
            J = B[j]
            held(J, n, on)
        rigid(S, B, n, on, R.SOLVE)
        rigid(S, B, n, on, R.MULTIPLY)
        moved = 0
        if turn < TOGETHER_UNTIL:
            for j in range(joints):
                J = B[j]
                M = S[row_of(j, j) * W : row_of(j, j) * W + W]
                for w in range(n):
                    wanted = side_of(J, M, w)
                    moved += 1 if wanted != J[R.SIDE * W + w] else 0
                    J[R.SIDE * W + w] = wanted
        else:
            for w in range(n):
                moved += one_moves(S, B, w)
        if moved == 0:
            break


@law
def held(J, n, on):
    """The system of a round: joints that slide with their impulses, the others at rest or, smoothed, damped."""
    for w in range(n):
        side, h = J[R.SIDE * W + w], J[R.H * W + w]
        slides = side * side
        impulse = h * (J[R.MINUS * W + w] if side > 0.0 else -J[R.PLUS * W + w])
        yields = J[R.YIELD * W + w]
        keep = maximum(slides, 1.0 if yields > 0.0 else 0.0)
        J[R.KEEP * W + w] = keep
        J[R.HOLD * W + w] = (1.0 - slides) * (1.0 / yields if yields > 0.0 else 1.0)
        J[R.RIGHT * W + w] = keep * (J[R.AIM * W + w] + slides * impulse)


@law
def side_of(J, M, w):
    """The side that lane w of a joint asks for, after the rates of a round are known."""
    rate, h = J[R.NEXT * W + w], J[R.H * W + w]
    impulse = J[R.PUSHED * W + w] - J[R.AIM * W + w]
    asks = impulse - M[w] * (rate + J[R.YIELD * W + w] * impulse)
    return (1.0 if asks > h * J[R.MINUS * W + w] else 0.0) - (1.0 if asks < -h * J[R.PLUS * W + w] else 0.0)


@law
def one_moves(S, B, w):
    """Take the first joint of lane w that is on a wrong side one side on; how many there were, 0 or 1."""
    for j in range(len(B)):
        J = B[j]
        M = S[row_of(j, j) * W : row_of(j, j) * W + W]
        wanted, side = side_of(J, M, w), J[R.SIDE * W + w]
        if wanted != side:
            J[R.SIDE * W + w] = side + (1.0 if wanted > side else -1.0)
            return 1
    return 0


@law
def inverse_mass(S, B, n, on, joints, j, rigid):
    """Own entry of joint j in the inverse of A; the rates at the end are kept."""
    for i in range(joints):
        J = B[i]
        for w in range(n):
            J[R.AIM * W + w] = J[R.NEXT * W + w]
            J[R.KEEP * W + w], J[R.HOLD * W + w] = 1.0, 0.0
            J[R.RIGHT * W + w] = 1.0 if i == j else 0.0
    rigid(S, B, n, on, R.SOLVE)
    for i in range(joints):
        J = B[i]
        for w in range(n):
            if i == j:
                J[R.INVERSE * W + w] = J[R.NEXT * W + w]
            J[R.NEXT * W + w] = J[R.AIM * W + w]


@law
def rates_at_the_end(A, S, B, n, on, has, rigid):
    """Solve for the rates at the end of the step, and for the inverse mass of joints that ask for it."""
    joints = len(has)
    if on[R.ON_DAMPING]:
        for j in range(joints):
            J, M = B[j], S[row_of(j, j) * W : row_of(j, j) * W + W]
            for w in range(n):
                M[w] += 0.5 * J[R.H * W + w] * J[R.DAMPING * W + w]
                J[R.FORCE * W + w] -= J[R.DAMPING * W + w] * J[R.V * W + w]
    if on[R.ON_SMOOTHING]:  # a joint that yields while it "sticks" is a compliance in series
        for j in range(joints):
            J = B[j]
            for w in range(n):
                reach = J[R.H * W + w] * (J[R.PLUS * W + w] + J[R.MINUS * W + w])
                J[R.YIELD * W + w] = 2.0 * J[R.SMOOTHING * W + w] / maximum(reach, 1e-15)
    if joints == 1:
        one_joint(S, B, n, on)
    elif joints == 2:
        two_joints(A, n, on)
    else:
        many_joints(S, B, n, on, has, rigid)
