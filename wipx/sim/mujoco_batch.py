"""MuJoCo's own batches: open-loop rollouts of rigid bodies alone, without Python in between.

They serve where nothing but the rigid body moves and each window's rows are evenly spaced. The integrator is
fourth-order Runge-Kutta, whose step costs four evaluations of the dynamics; it takes four of the loop's at once.
"""

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.sim import rows as R
from wipx.sim.coefficients import coefficients
from wipx.sim.inputs import Inputs
from wipx.sim.layout import Layout
from wipx.sim.mjcf import mjcf
from wipx.sim.simulator import Rollouts
from wipx.sim.stepped import single

LONGER = 4.0  # steps of the loop in one
EVEN = 1e-9  # relative spread of the steps of a window that counts as even
BLOCK = 256  # rollouts held in memory at once
RIGID = (R.ON_TREE, R.ON_DOUBLE, R.ON_TILT, R.ON_SMOOTHING)  # flags that add no physics to the rigid body


def serves(batch: ModelBatch, inputs: Inputs, initial: np.ndarray, step: float) -> bool:
    """Whether MuJoCo alone can replay these windows.

    Args:
        batch: P models.
        inputs: R windows.
        initial: Shape (2 joints, P, R).
        step: Longest step of the loop [s].
    """
    known = coefficients(batch)
    on, has = known.on.copy(), known.has.copy()
    on[list(RIGID)] = False
    has[:, [R.ACTUATED, R.ON_PATH, R.ON_GAIN]] = False
    if on.any() or has.any() or inputs.ramps is not None or not np.isfinite(initial).all():
        return False
    return _Steps.of(inputs, step).even


@dataclass(frozen=True)
class _Steps:
    """How the rows of the windows are divided.

    Attributes:
        counts: Steps from each row to the next, shape (K, R).
        length: Of a window's steps, the mean of them, shape (R,) [s].
        even: Whether every step of a window is as long as its others.
    """

    counts: np.ndarray
    length: np.ndarray
    even: bool

    @classmethod
    def of(cls, inputs: Inputs, step: float) -> "_Steps":
        counts = inputs.substeps(LONGER * step)
        lengths = np.diff(inputs.t, axis=0) / np.maximum(counts, 1)
        taken = counts > 0
        longest = np.max(np.where(taken, lengths, 0.0), axis=0)
        shortest = np.min(np.where(taken, lengths, np.inf), axis=0, initial=np.inf)
        length = np.sum(counts * np.where(taken, lengths, 0.0), axis=0) / np.maximum(counts.sum(axis=0), 1)
        return cls(counts, length, bool(np.all(longest - shortest <= EVEN * longest)))


def replay(mujoco: Any, batch: ModelBatch, inputs: Inputs, initial: np.ndarray, step: float) -> Rollouts:
    """Open loop, as `Simulator.replay`.

    Args:
        mujoco: The engine's module.
        batch: P models.
        inputs: R windows.
        initial: Shape (2 joints, P, R).
        step: Longest step of the loop [s].
    """
    layout = Layout(batch.model.plant, batch.size, inputs)
    steps = _Steps.of(inputs, step)
    blocks = coefficients(batch).joints
    gains = blocks[layout.joints, R.INPUT_GAIN] * blocks[layout.joints, R.GAIN]
    forces = layout.recorded()[:, layout.joints, None] * gains[:, :, None]
    states = layout.states(initial)[layout.joints]
    starts = np.concatenate([states[:, R.Q], states[:, R.V]]).T
    ends = np.concatenate([np.zeros((1, inputs.windows), dtype=int), np.cumsum(steps.counts, axis=0)])
    models = _models(mujoco, batch, steps)
    data = mujoco.MjData(models[0])
    run = importlib.import_module("mujoco.rollout").rollout
    out = np.zeros((layout.rows + 1, 2 * layout.width, layout.lanes))
    for begin in range(0, layout.lanes, BLOCK):
        lanes = range(begin, min(begin + BLOCK, layout.lanes))
        control = np.zeros((len(lanes), max(1, int(ends[-1].max())), forces.shape[1]))
        start = np.column_stack([np.zeros(len(lanes)), starts[lanes.start : lanes.stop]])
        for i, lane in enumerate(lanes):
            p, r = divmod(lane, inputs.windows)
            control[i, : ends[-1, r]] = np.repeat(forces[:, :, p, r], steps.counts[:, r], axis=0)
        applied = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
        course, _ = run([models[lane] for lane in lanes], data, start, control, control_spec=applied)
        course = np.concatenate([start[:, None], course], axis=1)[:, :, 1:]
        for i, lane in enumerate(lanes):
            out[:, layout.pattern, lane] = course[i, ends[:, lane % inputs.windows]]
    for j in range(layout.width):
        scale, bias = (np.repeat(blocks[j, row], inputs.windows) for row in (R.SCALE, R.BIAS))
        out[:, j] = (1.0 + scale) * out[:, j] + bias
    return layout.rollouts(out, inputs.commands[:, :, None, :])


def _models(mujoco: Any, batch: ModelBatch, steps: _Steps) -> list[Any]:
    """The compiled model of every lane; windows of one step share them."""
    every = []
    for p in range(batch.size):
        model = single(batch, p)
        lengths = np.round(steps.length, 14).tolist()
        compiled = {length: _compiled(mujoco, model, length) for length in set(lengths)}
        every += [compiled[length] for length in lengths]
    return every


def _compiled(mujoco: Any, model: Model, step: float) -> Any:
    compiled = mujoco.MjModel.from_xml_string(mjcf(model, max(step, 1e-6)))
    compiled.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    return compiled
