"""Physics engines behind the contract of simulators: the engine moves the rigid body, the compiled laws do the rest.

An engine is stepped in Python, a world of one model at a time. Delays, actuators, friction, sensors and feedback
are those of the analytic simulator (`wipx.sim.coupling`); no law stands twice.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np

from wipx.core.errors import check_positive
from wipx.core.model import Model, ModelBatch
from wipx.sim import rows as R
from wipx.sim.cache import settled
from wipx.sim.coefficients import coefficients
from wipx.sim.coupling import after, before, begin, between, show
from wipx.sim.exchange import Exchange
from wipx.sim.inputs import Inputs
from wipx.sim.kernel import filled
from wipx.sim.layout import ClosedLoop, Layout
from wipx.sim.mechanism import check_possible
from wipx.sim.rows import W
from wipx.sim.simulator import Path, Rollouts, StateFeedback

ANALYTIC = ", or use sim=analytic"  # which does what is no rigid body too


class World(Protocol):
    """An engine that moves rigid bodies; it holds one model at a time, in up to `W` lanes."""

    def load(self, model: Model, exchange: Exchange, lanes: int) -> None:
        """Take a model's body in place of the one before.

        Args:
            model: Rigid body, with what geometry and environment have to do with it.
            exchange: Where states and forces are read and written in each step; inertia that the engine's
                joints cannot have is written into it now.
            lanes: States of the body that are moved side by side.
        """
        ...

    def weigh(self) -> None:
        """Write mass matrix and bias forces of every lane that has a step."""
        ...

    def advance(self) -> None:
        """One semi-implicit Euler step of every lane that has one, under its push; write places and speeds."""
        ...

    def close(self) -> None:
        """Give back what the engine holds."""
        ...


def single(batch: ModelBatch, p: int) -> Model:
    """Model p of a batch."""
    if batch.values is None:
        return batch.model
    return batch.model.with_values(dict(zip(batch.names, batch.values[p].tolist(), strict=True)))


@dataclass(frozen=True)
class SteppedSimulator(ABC):
    """A physics engine with the effects around it.

    Attributes:
        step: Longest step of the engine [s]; rows further apart are divided evenly.
        smoothing: Speed over which the dry friction of each joint builds up, shape (joints,)
            [m/s, rad/s]; empty for true sticking. Only searches use it, on their way.
    """

    step: float = 1e-3
    smoothing: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check_positive(step=self.step)

    @property
    @abstractmethod
    def name(self) -> str:
        """Of the engine, as `sim=` has it."""

    @abstractmethod
    def open(self) -> World:
        """An empty world.

        Raises:
            InputError: the engine's package is not installed.
        """

    def smoothed(self, speeds: tuple[float, ...]) -> Self:
        """The same engine with dry friction that builds up over these `speeds` of the joints [m/s, rad/s]."""
        return replace(self, smoothing=speeds)

    def replay(self, batch: ModelBatch, inputs: Inputs, initial: np.ndarray, path: Path | None = None) -> Rollouts:
        """Open loop: the recorded commands act on every model; see `Simulator.replay`."""
        run = _Run(self, batch, inputs)
        out = run.advance(initial, run.layout.recorded(), ramps=run.layout.ramps(), path=path)
        return run.layout.rollouts(out, inputs.commands[:, :, None, :])

    def close_loop(
        self,
        batch: ModelBatch,
        inputs: Inputs,
        initial: np.ndarray,
        feedback: StateFeedback,
        references: np.ndarray,
        noise: np.ndarray | None = None,
    ) -> Rollouts:
        """Closed loop: the feedback computes the command at every row; see `Simulator.close_loop`."""
        run = _Run(self, batch, inputs)
        commands = np.zeros((run.layout.rows, run.layout.width, run.layout.lanes))
        out = run.advance(initial, commands, loop=run.layout.loop(feedback, references, noise))
        return run.layout.rollouts(out, run.layout.per_command(commands))

    def drive(
        self, model: Model, inputs: Inputs, initial: np.ndarray, controller: Callable[[float, np.ndarray], np.ndarray]
    ) -> Rollouts:
        """Closed loop with any controller, one row at a time; see `Simulator.drive`."""
        run = _Run(self, ModelBatch(model), inputs)
        commands = np.zeros((run.layout.rows, run.layout.width, 1))
        out = run.advance(initial[:, None, None], commands, controller=controller)
        return run.layout.rollouts(out, run.layout.per_command(commands))


@dataclass(frozen=True)
class _Block:
    """Lanes of one model in the layout of the compiled code.

    Attributes:
        exchange: Between the laws and the engine.
        rows: Of the joints, then of the whole robot, shape (all W,).
        lanes: Window and column of the commands of every lane, shape (2, W).
        pointers: Row whose command is just leaving the transport delay, by joint, shape (N, W).
        counts: Steps of the present row, shape (W,).
        first: Lane of the first among all.
        count: How many there are.
    """

    exchange: Exchange
    rows: np.ndarray
    lanes: np.ndarray
    pointers: np.ndarray
    counts: np.ndarray
    first: int
    count: int

    @property
    def joints(self) -> np.ndarray:
        """Rows of each joint, a view of shape (N, BLOCK W)."""
        width = len(self.exchange.lanes.place)
        return self.rows[: width * R.BLOCK * W].reshape(width, -1)

    @property
    def body(self) -> np.ndarray:
        """Rows of the whole robot, a view of shape (rows W,)."""
        return self.rows[len(self.exchange.lanes.place) * R.BLOCK * W :]


class _Run:
    """One call of the simulator."""

    def __init__(self, simulator: SteppedSimulator, batch: ModelBatch, inputs: Inputs) -> None:
        self.simulator = simulator
        self.models = [single(batch, p) for p in range(batch.size)]
        for model in self.models:
            check_possible(model, f"sim={simulator.name}", ANALYTIC)
        self.inputs = inputs
        self.layout = Layout(batch.model.plant, batch.size, inputs)
        self.coefficients = coefficients(batch, simulator.smoothing)
        self.coefficients.joints[:, R.SPREAD] = self.layout.spread()
        self.coefficients.on[R.ON_ENGINE] = True
        self.substeps = inputs.substeps(simulator.step)
        self.row_steps = np.diff(inputs.t, axis=0) / np.maximum(self.substeps, 1)
        self.past = self.layout.past(self.coefficients.has)

    def advance(
        self,
        initial: np.ndarray,
        commands: np.ndarray,
        *,
        ramps: np.ndarray | None = None,
        loop: ClosedLoop | None = None,
        controller: Callable[[float, np.ndarray], np.ndarray] | None = None,
        path: Path | None = None,
    ) -> np.ndarray:
        """What the sensors show of every lane, shape (K + 1, 2 N, lanes).

        Args:
            initial: Shape (2 joints, P, R).
            commands: Shape (K, N, R), or (K, N, lanes) where a `loop` or a `controller` writes them.
            ramps: Change of the commands along each row, shape (K, N, R); None for none.
            loop: Compiled feedback; None for none.
            controller: Of a single lane.
            path: Where the rollouts are led at first.
        """
        led = self.layout.led(path)
        states = self.layout.states(initial, path)
        self.coefficients.on[R.ON_RAMP] = ramps is not None
        ramps = self.layout.held() if ramps is None else ramps
        out = np.empty((self.layout.rows + 1, 2 * self.layout.width, self.layout.lanes))
        own = loop is not None or controller is not None
        world = self.simulator.open()
        try:
            for p, model in enumerate(self.models):
                for window in range(0, self.inputs.windows, W):
                    block = self._block(p, window, states, own)
                    world.load(model, block.exchange, block.count)
                    self._advance(block, world, commands, ramps, loop, controller, out, *led)
        finally:
            world.close()
        return out

    def _block(self, p: int, window: int, states: np.ndarray, own: bool) -> _Block:
        """Windows of model p from `window` on; places that are left repeat the last of them and pause."""
        count = min(W, self.inputs.windows - window)
        windows = window + np.minimum(np.arange(W), count - 1)
        lanes = p * self.inputs.windows + windows
        joints = np.repeat(self.coefficients.joints[:, :, p, None], W, axis=2)
        joints[:, : R.STATES] = states[:, :, lanes]
        body = np.repeat(self.coefficients.body[:, p], W)
        return _Block(
            Exchange.of(self.layout.joints, self.layout.width),
            np.concatenate([joints.ravel(), body]),
            np.stack([windows, lanes if own else windows]).astype(np.int64),
            np.zeros((self.layout.width, W), dtype=np.int64),
            np.zeros(W, dtype=np.int64),
            int(lanes[0]),
            count,
        )

    def _advance(
        self, block: _Block, world: World, commands, ramps, loop: ClosedLoop | None, controller, out, led, until
    ) -> None:
        """Simulate every row of a block."""
        on, has, rigid, t = self.coefficients.on, self.coefficients.has, self.coefficients.rigid, self.inputs.t
        A, S, B, X = block.rows, block.body, block.joints, block.exchange.lanes
        lanes, pointers, counts = block.lanes, block.pointers, block.counts
        first, count = block.first, block.count
        closed = loop is not None
        loop = loop or self.layout.open_loop()
        n = filled(count)
        pattern, driven = self.layout.pattern, self.layout.driven
        begin_step = settled(before, A, S, B, n, X, on, has, t, commands, ramps, lanes, pointers, counts, 0, 0)
        end_step = settled(between, A, S, B, n, X, on, has, rigid)
        take_over = settled(after, S, B, n, X)
        for k in range(self.layout.rows):
            show(B, n, has, self.past, t, lanes, k, out, first, count, led, until)
            if controller is not None:
                commands[k, driven, 0] = controller(float(t[k, 0]), out[k, pattern, 0])
            least, most = begin(
                S,
                B,
                n,
                on,
                has,
                t,
                commands,
                ramps,
                self.row_steps,
                self.substeps,
                lanes,
                counts,
                k,
                first,
                count,
                closed,
                loop.gains,
                loop.references,
                loop.noise,
                loop.settings,
            )
            for s in range(most):
                begin_step(A, S, B, n, X, on, has, t, commands, ramps, lanes, pointers, counts, least, s)
                world.weigh()
                end_step(A, S, B, n, X, on, has, rigid)
                world.advance()
                take_over(S, B, n, X)
        show(B, n, has, self.past, t, lanes, self.layout.rows, out, first, count, led, until)
