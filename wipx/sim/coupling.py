"""The laws around a rigid body that an engine moves: the kernel's own, with the engine in place of `body`; compiled.

The engine stands in mid-step, with the coordinates and the predicted rates of that moment. It gives mass matrix and
bias forces there; the laws find the rates at the step's end (with friction, sticking, implicit damping), and the
force with which the engine gets there by itself. Its semi-implicit Euler step then ends in the middle of the next
step, half a step of whose drift is taken back: together that is the kernel's position Verlet.
"""

from wipx.core.law import law
from wipx.sim import rows as R
from wipx.sim.body import EVENT_TIME, share_after
from wipx.sim.cache import in_place
from wipx.sim.kernel import begin_row, replay, respond, set_step, step
from wipx.sim.rows import W
from wipx.sim.sensors import feedback, guide, record
from wipx.sim.sticking import row_of

LOST = 1e6  # [m, rad, m/s, rad/s]; beyond it a rollout has fallen over, and the engine is spared it


@in_place
def show(B, n, has, past, t_rows, lanes, k, out, lane0, count, path, until):
    """Put the state where a path leads, if one does, and write what the sensors show at row k."""
    if k < len(path):
        guide(B, lanes, k, lane0, count, path, until)
    record(B, n, has, past, t_rows, lanes, k, out, lane0, count)


@in_place
def begin(
    S,
    B,
    n,
    on,
    has,
    t_rows,
    u_rows,
    ramps,
    row_steps,
    substeps,
    lanes,
    counts,
    k,
    lane0,
    count,
    closed,
    gains,
    references,
    noise,
    settings,
):
    """Load commands and steps of row k, which was shown; the smallest and the largest number of steps."""
    if closed:
        feedback(B, n, t_rows, u_rows, lanes, k, lane0, count, gains, references, noise, settings)
    else:
        replay(B, n, on, has, u_rows, ramps, lanes, k)
    least, most = begin_row(S, B, n, on, has, t_rows, row_steps, substeps, lanes, counts, k)
    if count < n:
        for w in range(count, n):
            counts[w] = 0
        least = 0
    return least, most


@law
def nobody(S, B, n, on, asked):
    """In place of a rigid body's code: the engine moves it."""


@in_place
def before(A, S, B, n, X, on, has, t_rows, u_rows, ramps, lanes, pointers, counts, least, s):
    """Step s of a row up to the forces that act in mid-step, and where the engine is to stand."""
    if s == 0 or s >= least:
        set_step(S, B, n, has, counts, s)
    step(A, S, B, n, on, has, t_rows, u_rows, ramps, lanes, pointers, nobody)
    for w in range(n):
        X.duration[w] = S[R.STEP * W + w]
    for j in range(len(has)):
        J = B[j]
        for w in range(n):
            place, speed = J[R.MID * W + w], J[R.RATE * W + w]
            X.place[j, w], X.speed[j, w] = place, speed
            X.command[j, w] = J[R.COMMAND * W + w]
            if not (abs(place) < LOST and abs(speed) < LOST):
                X.duration[w] = 0.0
    if on[R.ON_EVENT]:
        for w in range(n):
            X.loaded[w] = share_after(S[R.STEP * W + w], S[R.TIME * W + w], S[EVENT_TIME * W + w])


@in_place
def between(A, S, B, n, X, on, has, rigid):
    """The rates at the end of the step from the engine's mass matrix and bias, and the force that leads there."""
    joints = len(has)
    for i in range(joints):
        J = B[i]
        for j in range(i + 1):
            for w in range(n):
                S[row_of(i, j) * W + w] = X.mass[i, j, w] + (X.rotor[i, w] if i == j else 0.0)
        for w in range(n):
            J[R.FORCE * W + w] -= X.bias[i, w]
    respond(A, S, B, n, on, has, rigid)
    for i in range(joints):
        J = B[i]
        for w in range(n):
            X.gained[i, w] = (J[R.V * W + w] - X.speed[i, w]) * S[R.PER_STEP * W + w]
            X.push[i, w] = X.bias[i, w]
    for i in range(joints):
        for j in range(joints):
            for w in range(n):
                X.push[i, w] += X.mass[max(i, j), min(i, j), w] * X.gained[j, w]


@law
def lost(S, X, w):
    """Whether lane w has a step and the engine did not take it."""
    return S[R.STEP * W + w] > 0.0 and not X.duration[w] > 0.0


@in_place
def after(S, B, n, X):
    """Take over where the engine stands after its step."""
    for j in range(len(X.place)):
        J = B[j]
        for w in range(n):
            h = X.duration[w]
            if h > 0.0:
                J[R.V * W + w] = X.speed[j, w]
                J[R.Q * W + w] = X.place[j, w] - 0.5 * h * X.speed[j, w]
            elif lost(S, X, w):
                J[R.Q * W + w] = J[R.V * W + w] = float("nan")
