"""The compiled simulator: one step of physics for a block of rollouts ("lanes") at a time.

A block has room for `W` lanes, of which the first `n` are computed: those in use, filled up to whole vectors.
`step` is the page of physics in causal order: the command's path (`actuator`), environment and rigid
body (`body`), friction and motion (`joints`); `sensors` shows what is recorded. Each part is a loop
over the lanes of a block that the compiler turns into vector instructions; a part that is
absent costs one untaken branch per block. An engine in place of `body` has the same page
around it (`wipx.sim.coupling`).

Integrator: position Verlet. Coordinates drift half a step, rates take a whole one with forces
of mid-step, coordinates drift the other half; second order. Viscous terms are implicit in the
mean rate, Coriolis terms use a predicted rate of mid-step.
"""

import numpy as np

from wipx.core.law import inlined, law, maximum, relaxing
from wipx.sim import rows as R
from wipx.sim.actuator import actuator_path, delayed_command
from wipx.sim.body import double_body, load_body, payload_event, spring, wip_body
from wipx.sim.cache import cached
from wipx.sim.joints import levels, move, smooth_friction
from wipx.sim.rows import TOGETHER, W
from wipx.sim.sensors import correct, feedback, guide, record


@law
def filled(count):
    """How many lanes of a block are computed where `count` are in use."""
    return -(-count // TOGETHER) * TOGETHER


@inlined
def respond(S, n, on):
    """Friction, and the motion under all forces; the rigid body's mass matrix and forces are known."""
    levels(S, n, on, 0)
    levels(S, n, on, 1)
    smooth_friction(S, n, on, 0)
    smooth_friction(S, n, on, 1)
    move(S, n, on)
    for w in range(n):
        h = S[R.STEP * W + w]
        S[R.TIME * W + w] += h
        S[R.STARTED * W + w] = maximum(S[R.STARTED * W + w], 1.0 if h > 0.0 else 0.0)


@law
def step(S, n, on, t_rows, u_rows, ramps, lanes, pointers, actuated):
    """Advance every lane of the block by its step; a lane whose step is zero keeps its state to the bit.

    Where an engine moves the rigid body, this ends with the forces that act on it.
    """
    for j in range(2):
        for w in range(n):
            half = 0.5 * S[R.STEP * W + w]
            S[(R.MID + j) * W + w] = S[(R.Q + j) * W + w] + half * S[(R.V + j) * W + w]
            S[(R.RATE + j) * W + w] = S[(R.V + j) * W + w] + half * S[(R.ACCELERATION + j) * W + w]
    if on[R.ON_DELAY]:
        delayed_command(S, n, on, t_rows, u_rows, ramps, lanes, pointers, actuated)
    else:
        for w in range(n):
            S[R.DRIVE * W + w] = S[R.COMMAND * W + w]
            S[R.DRIVE1 * W + w] = S[R.COMMAND1 * W + w]
        if on[R.ON_RAMP]:
            for w in range(n):
                S[R.DRIVE * W + w] += S[R.RAMP * W + w] * S[R.PHASE * W + w]
                S[R.DRIVE1 * W + w] += S[R.RAMP1 * W + w] * S[R.PHASE * W + w]
                S[R.PHASE * W + w] += S[R.PER_ROW * W + w]
    if actuated[0]:
        actuator_path(S, n, on, 0)
    if actuated[1]:
        actuator_path(S, n, on, 1)
    for w in range(n):
        S[R.FORCE * W + w] = S[R.DRIVE * W + w]
        S[R.FORCE1 * W + w] = S[R.DRIVE1 * W + w]
    if on[R.ON_DAMPING]:
        for w in range(n):
            S[R.DAMPING * W + w] = S[R.VISCOUS * W + w]
            S[R.DAMPING1 * W + w] = S[R.VISCOUS1 * W + w]
    if on[R.ON_FRICTION]:
        for w in range(n):
            S[R.PLUS * W + w] = S[R.LEVEL_PLUS * W + w]
            S[R.PLUS1 * W + w] = S[R.LEVEL_PLUS1 * W + w]
            S[R.MINUS * W + w] = S[R.LEVEL_MINUS * W + w]
            S[R.MINUS1 * W + w] = S[R.LEVEL_MINUS1 * W + w]
    if on[R.ON_SPRING]:
        spring(S, n)
    if on[R.ON_ENGINE]:
        return
    if on[R.ON_EVENT]:
        payload_event(S, n)
    if on[R.ON_DOUBLE]:
        double_body(S, n)
    else:
        wip_body(S, n, on)
    respond(S, n, on)


@law
def begin_row(S, n, on, t_rows, row_steps, substeps, lanes, counts, k):
    """Load the step of row k; the smallest and the largest number of steps."""
    least, most = substeps[k, lanes[0, 0]], 0
    steps, numbers = row_steps[k], substeps[k]
    for w in range(n):
        window = lanes[0, w]
        S[R.ROW_STEP * W + w] = steps[window]
        counts[w] = numbers[window]
        least, most = min(least, counts[w]), max(most, counts[w])
    if on[R.ON_DELAY] or on[R.ON_EVENT] or on[R.ON_REMAINDER] or on[R.ON_REMAINDER1]:
        times = t_rows[k]
        for w in range(n):
            S[R.TIME * W + w] = times[lanes[0, w]]
    for w in range(n):
        S[R.COMMAND * W + w] *= S[R.INPUT_GAIN * W + w]
        S[R.COMMAND1 * W + w] *= S[R.INPUT_GAIN * W + w]
    if on[R.ON_RAMP]:
        for w in range(n):
            S[R.RAMP * W + w] *= S[R.INPUT_GAIN * W + w]
            S[R.RAMP1 * W + w] *= S[R.INPUT_GAIN * W + w]
            S[R.PER_ROW * W + w] = 1.0 / max(counts[w], 1)
            S[R.PHASE * W + w] = 0.5 * S[R.PER_ROW * W + w] - 0.5
    return least, most


@law
def replay(S, n, on, u_rows, ramps, lanes, actuated, k):
    """Load the recorded commands of row k."""
    for j in range(2):
        if actuated[j]:
            commands = u_rows[k, j]
            for w in range(n):
                S[(R.COMMAND + j) * W + w] = commands[lanes[1, w]]
            if on[R.ON_RAMP]:
                changes = ramps[k, j]
                for w in range(n):
                    S[(R.RAMP + j) * W + w] = changes[lanes[0, w]]


@law
def report(S, counts, k, lane0, count, delivered):
    """The mean force of the drives over row k."""
    for j in range(2):
        for w in range(count):
            length = max(counts[w] * S[R.ROW_STEP * W + w], 1e-12)
            delivered[k, j, lane0 + w] = S[(R.DELIVERED + j) * W + w] / length


@law
def set_step(S, n, on, counts, s):
    """The step of every lane, zero for one that is through with this row, and what lags do in it."""
    for w in range(n):
        h = S[R.ROW_STEP * W + w]
        S[R.STEP * W + w] = h if s < counts[w] else 0.0
        S[R.PER_STEP * W + w] = 1.0 / h if s < counts[w] else 0.0
    if on[R.ON_LAG]:
        for w in range(n):
            kept, mean = relaxing(S[R.STEP * W + w] * S[R.LAG_RATE * W + w])
            S[R.LAG_KEPT * W + w] = kept
            S[R.LAG_MEAN * W + w] = mean
    if on[R.ON_BACKLASH]:
        for w in range(n):
            kept, mean = relaxing(S[R.STEP * W + w] * S[R.CONTACT_RATE * W + w])
            S[R.CONTACT_KEPT * W + w] = kept
            S[R.CONTACT_MEAN * W + w] = mean
    for j in range(2):
        if on[R.ON_PAPER + j]:
            for w in range(n):
                kept, mean = relaxing(S[R.STEP * W + w] * S[(R.PAPER_RATE + j) * W + w])
                S[(R.PAPER_KEPT + j) * W + w] = kept
                S[(R.PAPER_MEAN + j) * W + w] = mean


@cached
def rollout(
    coefficients,
    on,
    actuated,
    states,
    t_rows,
    u_rows,
    ramps,
    spread,
    row_steps,
    substeps,
    per_lane,
    closed,
    gains,
    references,
    noise,
    settings,
    follows,
    measured,
    observer,
    drift,
    group,
    path,
    until,
    past,
    out,
    delivered,
    first_row,
    last_row,
    begin,
    end,
):
    """Simulate lanes [begin, end): lane = model * windows + window.

    Args:
        coefficients: Shape (N_COEFFICIENTS, P).
        on: Parts that are present, shape (N_FLAGS,).
        actuated: Whether each joint has a command, shape (2,).
        states: Start of each lane, shape (STATES, lanes); overwritten with the end.
        t_rows: Time of each row, shape (K + 1, R) [s].
        u_rows: Command of each joint, shape (K, 2, lanes) if `per_lane` (written in closed loop), else (K, 2, R).
        ramps: Change of each command along a row, shape (K, 2, R); else (1, 2, 1).
        spread: Half width of each joint's single commands about their mean, shape (2, P).
        row_steps: Length of the steps from each row to the next, shape (K, R) [s].
        substeps: Their number, shape (K, R); 0 holds the state.
        per_lane: Whether every lane has commands of its own.
        closed: Whether `gains` close the loop; then `per_lane`.
        gains: State feedback, shape (2, 4).
        references: Shape (K, 4, R).
        noise: Measurement noise of the loop, shape (K, 4, lanes); closed loop only.
        settings: Time constant of the rate filter [s] (negative: rates are measured), limit of the command.
        follows: Whether an observer corrects the state at every row.
        measured: What it sees, shape (K + 1, 4, R).
        observer: Its gains, shape (groups, K + 1, R, 4, 4).
        drift: Its gains of an acceleration on each joint, shape (groups, K + 1, R, 2, 4); else (1, 1, 1, 2, 4).
        group: Which of them each model has, shape (P,).
        path: True coordinates and rates to which the state is put, shape (rows, 4, lanes), or R for all models.
        until: Last row at which it is, shape (R,); -1 for never.
        past: True coordinates and rates for sensor delays, shape (K + 1, 4, lanes); else (1, 4, 1).
        out: Coordinates as recorded, then true rates, shape (K + 1, 4, lanes).
        delivered: Mean force of each joint's drive over each row, shape (K, 2, lanes); else (1, 2, 1).
        first_row: Row at which the states stand.
        last_row: Row to which they are brought.
        begin: First lane.
        end: Lane after the last.
    """
    windows = substeps.shape[1]
    S = np.zeros(R.N_ROWS * W)
    pointers = np.zeros(W, dtype=np.int64)
    counts = np.zeros(W, dtype=np.int64)
    lanes = np.zeros((2, W), dtype=np.int64)
    for lane0 in range(begin, end, W):
        count = min(W, end - lane0)
        n = filled(count)
        for w in range(n):
            lane = lane0 + min(w, count - 1)  # a short block repeats its last lane
            lanes[0, w] = lane % windows
            lanes[1, w] = lane if per_lane else lane % windows
            pointers[w] = 0
            S[R.SPREAD * W + w] = spread[0, lane // windows]
            S[R.SPREAD1 * W + w] = spread[1, lane // windows]
            for i in range(R.N_COEFFICIENTS):
                S[i * W + w] = coefficients[i, lane // windows]
            for i in range(R.STATES):
                S[(R.N_COEFFICIENTS + i) * W + w] = states[i, lane]
        load_body(S, n)
        for k in range(first_row, last_row):
            if k < len(path):
                guide(S, lanes, k, lane0, count, path, until)
            record(S, n, on, past, t_rows, lanes, k, out, lane0, count)
            if follows:
                for w in range(count):
                    counts[w] = substeps[k, lanes[0, w]]
                correct(S, on, past, t_rows, lanes, k, lane0, count, measured, observer, drift, group, counts)
            if closed:
                feedback(S, n, t_rows, u_rows, lanes, k, lane0, count, gains, references, noise, settings)
            else:
                replay(S, n, on, u_rows, ramps, lanes, actuated, k)
            if on[R.ON_REPORT]:
                for w in range(n):
                    S[R.DELIVERED * W + w] = 0.0
                    S[R.DELIVERED1 * W + w] = 0.0
            least, most = begin_row(S, n, on, t_rows, row_steps, substeps, lanes, counts, k)
            for s in range(most):
                if s == 0 or s >= least:
                    set_step(S, n, on, counts, s)
                step(S, n, on, t_rows, u_rows, ramps, lanes, pointers, actuated)
            if on[R.ON_REPORT]:
                report(S, counts, k, lane0, count, delivered)
        record(S, n, on, past, t_rows, lanes, last_row, out, lane0, count)
        for w in range(count):
            for i in range(R.STATES):
                states[i, lane0 + w] = S[(R.N_COEFFICIENTS + i) * W + w]
