"""The compiled simulator: one step of physics for a block of rollouts ("lanes") at a time.

A block has room for `W` lanes, of which the first `n` are computed: those in use, filled up to whole vectors.
`step` is the page of physics in causal order: the command's path (`actuator`), the rigid body (`body`, or code written
for one robot), friction and motion (`joints`, `sticking`); `sensors` shows what is recorded. Each part is a loop
over the lanes of a block that the compiler turns into vector instructions; a part that is
absent costs one untaken branch per block. Parts of a joint work on the block of rows of that joint, whichever it is.
An engine in place of the rigid body has the same page around it (`wipx.sim.coupling`).

Integrator: position Verlet. Coordinates drift half a step, rates take a whole one with forces
of mid-step, coordinates drift the other half; second order. Viscous terms are implicit in the
mean rate, Coriolis terms use a predicted rate of mid-step.
"""

from wipx.core.law import law, relaxing
from wipx.sim import rows as R
from wipx.sim.actuator import actuator_path, delayed_command, taken_back
from wipx.sim.body import double_body, wip_body
from wipx.sim.cache import in_place
from wipx.sim.joints import arrived, drifted, levels, smooth_friction
from wipx.sim.rows import TOGETHER, W
from wipx.sim.sensors import correct, feedback, guide, keep, pushed, record
from wipx.sim.sticking import rates_at_the_end


@law
def filled(count):
    """How many lanes of a block are computed where `count` are in use."""
    return -(-count // TOGETHER) * TOGETHER


@law
def respond(A, S, B, n, on, has, rigid):
    """Friction, and the motion under all forces; the rigid body's mass matrix and forces are known."""
    for j in range(len(has)):
        if has[j, R.ON_LAWS]:
            J = B[j]
            levels(J, n, has, j)
            smooth_friction(S, B, J, n, has, j)
        if has[j, R.ON_ELASTICITY]:
            taken_back(B[j], n)
    rates_at_the_end(A, S, B, n, on, has, rigid)
    for j in range(len(has)):
        arrived(B[j], n, has, j)
    if on[R.ON_TIME]:
        for w in range(n):
            S[R.TIME * W + w] += S[R.STEP * W + w]


@law
def step(A, S, B, n, on, has, t_rows, u_rows, ramps, lanes, pointers, rigid):
    """Advance every lane of the block by its step; a lane whose step is zero keeps its state to the bit.

    Where an engine moves the rigid body, this ends with the forces that act on it.
    """
    for j in range(len(has)):
        J = B[j]
        drifted(J, n)
        if on[R.ON_DELAY] and has[j, R.ACTUATED]:
            delayed_command(S, J, n, on, t_rows, u_rows, ramps, lanes, pointers, j)
        elif on[R.ON_RAMP]:
            for w in range(n):
                J[R.DRIVE * W + w] += J[R.RAMP * W + w] * S[R.PHASE * W + w]
        if has[j, R.ON_PATH] or (on[R.ON_REPORT] and has[j, R.ACTUATED]):
            actuator_path(S, J, n, on, has, j)
        loaded(J, n, on, has, j)
    if on[R.ON_RAMP]:
        for w in range(n):
            S[R.PHASE * W + w] += S[R.PER_ROW * W + w]
    if on[R.ON_ENGINE]:
        return
    if on[R.ON_TREE]:
        rigid(S, B, n, on, R.FORCES)
    elif on[R.ON_DOUBLE]:
        double_body(A, n)
    else:
        wip_body(A, n, on)
    respond(A, S, B, n, on, has, rigid)


@law
def loaded(J, n, on, has, j):
    """Begin the sums of forces, damping and levels of dry friction on a joint."""
    for w in range(n):
        J[R.FORCE * W + w] = J[R.DRIVE * W + w]
    if on[R.ON_DAMPING]:
        for w in range(n):
            J[R.DAMPING * W + w] = J[R.VISCOUS * W + w]
    if on[R.ON_FRICTION]:
        for w in range(n):
            J[R.PLUS * W + w] = J[R.LEVEL_PLUS * W + w]
            J[R.MINUS * W + w] = J[R.LEVEL_MINUS * W + w]
    if has[j, R.ON_SPRING]:
        for w in range(n):
            J[R.FORCE * W + w] -= J[R.SPRING * W + w] * (J[R.MID * W + w] - J[R.SPRING_REST * W + w])


@law
def begin_row(S, B, n, on, has, t_rows, row_steps, substeps, lanes, counts, k):
    """Load the step of row k; the smallest and the largest number of steps."""
    least, most = substeps[k, lanes[0, 0]], 0
    steps, numbers, times = row_steps[k], substeps[k], t_rows[k]
    for w in range(n):
        window = lanes[0, w]
        S[R.ROW_STEP * W + w] = steps[window]
        counts[w] = numbers[window]
        least, most = min(least, counts[w]), max(most, counts[w])
    if on[R.ON_TIME]:
        for w in range(n):
            S[R.TIME * W + w] = times[lanes[0, w]]
    for j in range(len(has)):
        if has[j, R.ACTUATED]:
            J = B[j]
            for w in range(n):
                J[R.COMMAND * W + w] *= J[R.INPUT_GAIN * W + w]
            if on[R.ON_RAMP]:
                for w in range(n):
                    J[R.RAMP * W + w] *= J[R.INPUT_GAIN * W + w]
    if on[R.ON_RAMP]:
        for w in range(n):
            S[R.PER_ROW * W + w] = 1.0 / max(counts[w], 1)
            S[R.PHASE * W + w] = 0.5 * S[R.PER_ROW * W + w] - 0.5
    return least, most


@law
def replay(B, n, on, has, u_rows, ramps, lanes, k):
    """Load the recorded commands of row k."""
    for j in range(len(has)):
        if has[j, R.ACTUATED]:
            J, commands = B[j], u_rows[k, j]
            for w in range(n):
                J[R.COMMAND * W + w] = commands[lanes[1, w]]
            if on[R.ON_RAMP]:
                changes = ramps[k, j]
                for w in range(n):
                    J[R.RAMP * W + w] = changes[lanes[0, w]]


@law
def report(S, B, counts, k, lane0, count, delivered):
    """The mean force of the drives over row k."""
    for j in range(delivered.shape[1]):
        J = B[j]
        for w in range(count):
            length = max(counts[w] * S[R.ROW_STEP * W + w], 1e-12)
            delivered[k, j, lane0 + w] = J[R.DELIVERED * W + w] / length
            J[R.DELIVERED * W + w] = 0.0


@law
def set_step(S, B, n, has, counts, s):
    """The step of every lane, zero for one that is through with this row, and what lags do in it."""
    for w in range(n):
        h = S[R.ROW_STEP * W + w]
        S[R.STEP * W + w] = h if s < counts[w] else 0.0
        S[R.PER_STEP * W + w] = 1.0 / h if s < counts[w] else 0.0
    for j in range(len(has)):
        J = B[j]
        for w in range(n):
            J[R.H * W + w] = S[R.STEP * W + w]
            J[R.PER_H * W + w] = S[R.PER_STEP * W + w]
        if has[j, R.ON_LAG]:
            for w in range(n):
                kept, mean = relaxing(J[R.H * W + w] * J[R.LAG_RATE * W + w])
                J[R.LAG_KEPT * W + w], J[R.LAG_MEAN * W + w] = kept, mean
        if has[j, R.ON_BACKLASH]:
            for w in range(n):
                kept, mean = relaxing(J[R.H * W + w] * J[R.CONTACT_RATE * W + w])
                J[R.CONTACT_KEPT * W + w], J[R.CONTACT_MEAN * W + w] = kept, mean
        if has[j, R.ON_PAPER]:
            for w in range(n):
                kept, mean = relaxing(J[R.H * W + w] * J[R.PAPER_RATE * W + w])
                J[R.PAPER_KEPT * W + w], J[R.PAPER_MEAN * W + w] = kept, mean


@in_place
def rollout(
    body,
    blocks,
    on,
    has,
    rigid,
    states,
    t_rows,
    u_rows,
    ramps,
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
    group,
    places,
    carried,
    path,
    until,
    past,
    out,
    delivered,
    first_row,
    last_row,
    begin,
    end,
    A,
    lanes,
    pointers,
    counts,
):
    """Simulate lanes [begin, end) of robots with N joints: lane = model * windows + window.

    Args:
        body: What the rows of the whole robot begin with, shape (rows, P).
        blocks: And those of each joint, shape (N, BLOCK, P).
        on: Parts of the whole robot that are present, shape (FLAGS,).
        has: And of each joint, shape (N, JOINT_FLAGS).
        rigid: Code of a tree (`wipx.sim.cache.part`); not called for the other plants.
        states: Start of each lane, shape (N, STATES, lanes); overwritten with the end.
        t_rows: Time of each row, shape (K + 1, R) [s].
        u_rows: Command of each joint, shape (K, N, lanes) if `per_lane` (written in closed loop), else (K, N, R).
        ramps: Change of each command along a row, shape (K, N, R); else (1, N, 1).
        row_steps: Length of the steps from each row to the next, shape (K, R) [s].
        substeps: Their number, shape (K, R); 0 holds the state.
        per_lane: Whether every lane has commands of its own.
        closed: Whether `gains` close the loop; then `per_lane`.
        gains: State feedback, shape (N, 2 N).
        references: Shape (K, 2 N, R).
        noise: Measurement noise of the loop, shape (K, 2 N, lanes); closed loop only.
        settings: Time constant of the rate filter [s] (negative: rates are measured), limit of the command.
        follows: Whether an observer corrects the state at every row.
        measured: What it sees, shape (K + 1, N or 2 N, R).
        observer: Its gains, shape (groups, K + 1, R, 2 N or 3 N, N or 2 N).
        group: Which of them each model has, shape (P,).
        places: Place at which a row's corrected states are kept, shape (K + 1, R), -1 for none; (0, 1) for no row.
        carried: Room for them, shape (N, STATES, P, places).
        path: True coordinates and rates to which the state is put, shape (rows, 2 N, lanes), or R for all models.
        until: Last row at which it is, shape (R,); -1 for never.
        past: True coordinates and rates for sensor delays, shape (K + 1, 2 N, lanes); else (1, 2 N, 1).
        out: Coordinates as recorded, then true rates, shape (K + 1, 2 N, lanes).
        delivered: Mean force of each joint's drive over each row, shape (K, N, lanes); else (1, N, 1).
        first_row: Row at which the states stand.
        last_row: Row to which they are brought.
        begin: First lane.
        end: Lane after the last.
        A: Room for a block, shape ((N BLOCK + rows) W,).
        lanes: Room for the window of each of its lanes, and for the column of its commands, shape (2, W).
        pointers: Room for the row whose command is just leaving each joint's transport delay, shape (N, W).
        counts: Room for the steps of the present row, shape (W,).
    """
    windows = substeps.shape[1]
    joints = len(has)
    B, S = A[: joints * R.BLOCK * W].reshape((joints, R.BLOCK * W)), A[joints * R.BLOCK * W :]
    for lane0 in range(begin, end, W):
        count = min(W, end - lane0)
        n = filled(count)
        for w in range(n):
            lane = lane0 + min(w, count - 1)  # a short block repeats its last lane
            lanes[0, w] = lane % windows
            lanes[1, w] = lane if per_lane else lane % windows
            for i in range(len(body)):
                S[i * W + w] = body[i, lane // windows]
            for j in range(joints):
                pointers[j, w] = 0
                for i in range(R.BLOCK):
                    B[j, i * W + w] = blocks[j, i, lane // windows]
                for i in range(R.STATES):
                    B[j, i * W + w] = states[j, i, lane]
        for k in range(first_row, last_row):
            if k < len(path):
                guide(B, lanes, k, lane0, count, path, until)
            record(B, n, has, past, t_rows, lanes, k, out, lane0, count)
            if follows:
                for w in range(count):
                    counts[w] = substeps[k, lanes[0, w]]
                correct(B, has, past, t_rows, lanes, k, lane0, count, measured, observer, group, counts)
                if k < len(places):
                    keep(B, lanes, k, lane0, count, places, carried)
            if closed:
                feedback(B, n, t_rows, u_rows, lanes, k, lane0, count, gains, references, noise, settings)
            else:
                replay(B, n, on, has, u_rows, ramps, lanes, k)
            least, most = begin_row(S, B, n, on, has, t_rows, row_steps, substeps, lanes, counts, k)
            for s in range(most):
                if s == 0 or s >= least:
                    set_step(S, B, n, has, counts, s)
                step(A, S, B, n, on, has, t_rows, u_rows, ramps, lanes, pointers, rigid)
                if observer.shape[3] > 2 * joints:
                    pushed(B, joints, n)
            if on[R.ON_REPORT]:
                report(S, B, counts, k, lane0, count, delivered)
        record(B, n, has, past, t_rows, lanes, last_row, out, lane0, count)
        for w in range(count):
            for j in range(joints):
                for i in range(R.STATES):
                    states[j, i, lane0 + w] = B[j, i * W + w]
