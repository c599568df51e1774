"""The laws around a rigid body that an engine moves: the kernel's own, with the engine in place of `body`; compiled.

The engine stands in mid-step, with the coordinates and the predicted rates of that moment. It gives mass matrix and
bias forces there; the laws find the rates at the step's end (with friction, sticking, implicit damping), and the
force with which the engine gets there by itself. Its semi-implicit Euler step then ends in the middle of the next
step, half a step of whose drift is taken back: together that is the kernel's position Verlet.
"""

from wipx.core.law import law
from wipx.sim import exchange as E
from wipx.sim import rows as R
from wipx.sim.body import share_after
from wipx.sim.cache import cached
from wipx.sim.kernel import begin_row, replay, respond, set_step, step
from wipx.sim.rows import W
from wipx.sim.sensors import feedback, guide, record

LOST = 1e6  # [m, rad, m/s, rad/s]; beyond it a rollout has fallen over, and the engine is spared it


@cached
def show(S, n, on, past, t_rows, lanes, k, out, lane0, count, path, until):
    """Put the state where a path leads, if one does, and write what the sensors show at row k."""
    if k < len(path):
        guide(S, lanes, k, lane0, count, path, until)
    record(S, n, on, past, t_rows, lanes, k, out, lane0, count)


@cached
def begin(
    S,
    n,
    on,
    t_rows,
    u_rows,
    ramps,
    row_steps,
    substeps,
    lanes,
    counts,
    actuated,
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
        feedback(S, n, t_rows, u_rows, lanes, k, lane0, count, gains, references, noise, settings)
    else:
        replay(S, n, on, u_rows, ramps, lanes, actuated, k)
    least, most = begin_row(S, n, on, t_rows, row_steps, substeps, lanes, counts, k)
    if count < n:
        for w in range(count, n):
            counts[w] = 0
        least = 0
    return least, most


@cached
def before(S, n, X, on, t_rows, u_rows, ramps, lanes, pointers, actuated, counts, least, s):
    """Step s of a row up to the forces that act in mid-step, and where the engine is to stand (rows of `exchange`)."""
    if s == 0 or s >= least:
        set_step(S, n, on, counts, s)
    step(S, n, on, t_rows, u_rows, ramps, lanes, pointers, actuated)
    for w in range(n):
        place, place1 = S[R.MID * W + w], S[R.MID1 * W + w]
        speed, speed1 = S[R.RATE * W + w], S[R.RATE1 * W + w]
        found = abs(place) < LOST and abs(place1) < LOST and abs(speed) < LOST and abs(speed1) < LOST
        X[E.DURATION, w] = S[R.STEP * W + w] if found else 0.0
        X[E.PLACE, w], X[E.PLACE1, w] = place, place1
        X[E.SPEED, w], X[E.SPEED1, w] = speed, speed1
    if on[R.ON_EVENT]:
        for w in range(n):
            X[E.LOADED, w] = share_after(S, w)


@cached
def between(S, n, X, on):
    """The rates at the end of the step from the engine's mass matrix and bias, and the force that leads there."""
    for w in range(n):
        S[R.M11 * W + w] = X[E.MASS11, w] + X[E.ROTOR, w]
        S[R.M12 * W + w] = X[E.MASS12, w]
        S[R.M22 * W + w] = X[E.MASS22, w] + X[E.ROTOR1, w]
        S[R.FORCE * W + w] -= X[E.BIAS, w]
        S[R.FORCE1 * W + w] -= X[E.BIAS1, w]
    respond(S, n, on)
    for w in range(n):
        per_step = S[R.PER_STEP * W + w]
        a0 = (S[R.V * W + w] - X[E.SPEED, w]) * per_step
        a1 = (S[R.V1 * W + w] - X[E.SPEED1, w]) * per_step
        X[E.GAINED, w], X[E.GAINED1, w] = a0, a1
        X[E.PUSH, w] = X[E.MASS11, w] * a0 + X[E.MASS12, w] * a1 + X[E.BIAS, w]
        X[E.PUSH1, w] = X[E.MASS12, w] * a0 + X[E.MASS22, w] * a1 + X[E.BIAS1, w]


@law
def lost(S, X, w):
    """Whether lane w has a step and the engine did not take it."""
    return S[R.STEP * W + w] > 0.0 and not X[E.DURATION, w] > 0.0


@cached
def after(S, n, X):
    """Take over where the engine stands after its step."""
    for w in range(n):
        h = X[E.DURATION, w]
        if h > 0.0:
            S[R.V * W + w], S[R.V1 * W + w] = X[E.SPEED, w], X[E.SPEED1, w]
            S[R.Q * W + w] = X[E.PLACE, w] - 0.5 * h * X[E.SPEED, w]
            S[R.Q1 * W + w] = X[E.PLACE1, w] - 0.5 * h * X[E.SPEED1, w]
        elif lost(S, X, w):
            for j in range(2):
                S[(R.Q + j) * W + w] = S[(R.V + j) * W + w] = float("nan")
