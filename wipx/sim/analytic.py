"""The analytic simulator: thousands of rollouts at once in compiled code.

A rollout is one model on one window of inputs. Open loop it replays commands; closed loop a
state feedback computes them at the rows of the window, from what the sensors show. Controllers
that are Python objects drive the same code row by row (`drive`).
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from wipx.core.errors import check_positive
from wipx.core.model import Model, ModelBatch
from wipx.sim import rows as R
from wipx.sim.coefficients import coefficients
from wipx.sim.first_use import compile_filters_meanwhile
from wipx.sim.inputs import Inputs
from wipx.sim.kernel import rollout
from wipx.sim.layout import ClosedLoop, Layout
from wipx.sim.rows import TOGETHER
from wipx.sim.simulator import Path, Rollouts, StateFeedback

Item = TypeVar("Item")
Result = TypeVar("Result")

LEAST_WORK_PER_THREAD = 75_000  # lane steps, about 1 ms: less is not worth a thread


@dataclass(frozen=True)
class Observer:
    """Corrects the state at every row by gains times recorded minus shown.

    Attributes:
        recorded: Coordinates, then rates if they are seen, shape (K + 1, channels, R).
        gains: Shape (groups, K + 1, R, states, channels), from channels to states; zero where nothing was measured.
            States are coordinates, then rates, then accelerations that the observer adds to the model's, if it does.
        group: Which of the gains each model has, shape (P,).
        reports: Whether to tell the forces of the drives.
        kept: Rows (W,) of recordings (W,) at which to tell what joints carry from step to step; None for none.
    """

    recorded: np.ndarray
    gains: np.ndarray
    group: np.ndarray
    reports: bool = False
    kept: tuple[np.ndarray, np.ndarray] | None = None


@dataclass(frozen=True)
class AnalyticSimulator:
    """The compiled simulator; `wipx.sim.kernel` holds its physics.

    Attributes:
        step: Longest step of the integrator [s]; rows further apart are divided evenly.
        threads: Threads of a large batch; 0 takes all cores.
        smoothing: Speed over which the dry friction of each joint builds up, shape (joints,)
            [m/s, rad/s]; empty for true sticking. Only searches use it, on their way.
    """

    step: float = 1e-3
    threads: int = 0
    smoothing: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check_positive(step=self.step)

    @property
    def cores(self) -> int:
        """How many threads may run side by side."""
        return self.threads or os.cpu_count() or 1

    def side_by_side(self, work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """What some work, most of which is simulation, makes of each item, several at the same time."""
        with ThreadPoolExecutor(self.cores) as pool:
            return list(pool.map(work, items))

    def smoothed(self, speeds: tuple[float, ...]) -> "AnalyticSimulator":
        """The same engine with dry friction that builds up over these `speeds` of the joints [m/s, rad/s]."""
        return replace(self, smoothing=speeds)

    def replay(self, batch: ModelBatch, inputs: Inputs, initial: np.ndarray, path: Path | None = None) -> Rollouts:
        """Open loop: the recorded commands act on every model.

        Args:
            batch: P models.
            inputs: R windows.
            initial: True coordinates, then rates, at each window's first integrated row,
                shape (2 joints, P, R) [m, rad, m/s, rad/s].
            path: Where the rollouts are led at first; None where they are left to themselves from the start.
        """
        run = _Run(self, batch, inputs)
        run.advance(run.layout.states(initial, path), run.begin(initial), run.layout.rows, path=path)
        return run.rollouts(inputs.commands[:, :, None, :])

    def follow(self, batch: ModelBatch, inputs: Inputs, initial: np.ndarray, observer: Observer) -> Rollouts:
        """Replay that an observer keeps close to the recordings: what every model shows one row ahead.

        Args:
            batch: P models.
            inputs: R recordings.
            initial: As in `replay`.
            observer: Corrects the state at every row, after it is shown.
        """
        run = _Run(self, batch, inputs)
        if observer.reports:
            run.report()
        if observer.kept is not None:
            run.keep(*observer.kept)
        run.advance(run.layout.states(initial), 0, run.layout.rows, observer=observer)
        return run.rollouts(inputs.commands[:, :, None, :])

    def close_loop(
        self,
        batch: ModelBatch,
        inputs: Inputs,
        initial: np.ndarray,
        feedback: StateFeedback,
        references: np.ndarray,
        noise: np.ndarray | None = None,
    ) -> Rollouts:
        """Closed loop: the feedback computes the command at every row.

        Args:
            batch: P models.
            inputs: Rows of the controller; its commands are ignored.
            initial: As in `replay`.
            feedback: The controller.
            references: Of coordinates and rates, shape (K, 2 joints, R).
            noise: Added to what the controller measures, shape (K, 2 joints, P, R).
        """
        run = _Run(self, batch, inputs)
        layout = run.layout
        commands = np.zeros((layout.rows, layout.width, layout.lanes))
        loop = layout.loop(feedback, references, noise)
        run.advance(layout.states(initial), 0, layout.rows, commands, loop)
        return run.rollouts(layout.per_command(commands))

    def drive(
        self, model: Model, inputs: Inputs, initial: np.ndarray, controller: Callable[[float, np.ndarray], np.ndarray]
    ) -> Rollouts:
        """Closed loop with any controller, one row at a time.

        Args:
            model: The robot.
            inputs: One window: the rows at which the controller runs.
            initial: True coordinates, then rates, shape (2 joints,).
            controller: Called with the time [s] and the measured coordinates and rates
                (2 joints,); returns the commands (inputs,).
        """
        run = _Run(self, ModelBatch(model), inputs)
        layout = run.layout
        states = layout.states(initial[:, None, None])
        commands = np.zeros((layout.rows, layout.width, 1))
        run.advance(states, 0, 0, commands)
        for k in range(layout.rows):
            measured = run.out[k, layout.pattern, 0]
            commands[k, layout.driven, 0] = controller(float(inputs.t[k, 0]), measured)
            run.advance(states, k, k + 1, commands)
        return run.rollouts(layout.per_command(commands))


class _Run:
    """One call of the kernel: its arrays, in the kernel's layout."""

    def __init__(self, simulator: AnalyticSimulator, batch: ModelBatch, inputs: Inputs) -> None:
        self.layout = Layout(batch.model.plant, batch.size, inputs)
        self.inputs = inputs
        self.batch = batch
        self.simulator = simulator
        self.coefficients = coefficients(batch, simulator.smoothing)
        self.coefficients.joints[:, R.SPREAD] = self.layout.spread()
        self.substeps = inputs.substeps(simulator.step)
        self.row_steps = np.diff(inputs.t, axis=0) / np.maximum(self.substeps, 1)
        self.out = np.empty((self.layout.rows + 1, 2 * self.layout.width, self.layout.lanes))
        self.past = self.layout.past(self.coefficients.has)
        self.delivered = self.layout.held()
        self.places = np.full((0, 1), -1)
        self.kept, self.carried = np.zeros(0, dtype=np.int64), np.zeros((1, R.STATES, 1, 0))

    def begin(self, initial: np.ndarray) -> int:
        """Row from which a replay must be simulated: that of the first step, where no sensor looks further back."""
        row = 0 if self.coefficients.has[:, R.ON_SENSOR_DELAY].any() else int(self.inputs.first.min())
        if row:
            states = self.layout.states(initial)
            self.out[:row] = np.concatenate([states[:, R.Q], states[:, R.V]])
        return row

    def report(self) -> None:
        """Keep the forces of the drives too."""
        self.coefficients.on[R.ON_REPORT] = True
        self.delivered = np.zeros((self.layout.rows, self.layout.width, self.layout.lanes))

    def keep(self, rows: np.ndarray, windows: np.ndarray) -> None:
        """Keep what joints carry at some rows (W,) of windows (W,)."""
        self.places = np.full(self.inputs.t.shape, -1)
        once, self.kept = np.unique(np.ravel_multi_index((rows, windows), self.places.shape), return_inverse=True)
        self.places.ravel()[once] = np.arange(len(once))
        self.carried = np.zeros((self.layout.width, R.STATES, self.layout.models, len(once)))

    def advance(
        self, states, first_row, last_row, commands=None, loop: ClosedLoop | None = None, observer=None, path=None
    ) -> None:
        """Simulate rows; `commands` (K, N, lanes) are per lane, otherwise the inputs' own are replayed."""
        compile_filters_meanwhile()
        per_lane = commands is not None
        closed, ramps = loop is not None, None
        if commands is None:
            commands = self.layout.recorded()
            ramps = self.layout.ramps()
        self.coefficients.on[R.ON_RAMP] = ramps is not None
        ramps = self.layout.held() if ramps is None else ramps
        loop = loop or self.layout.open_loop()
        measured, corrections, group = self._observed(observer)
        led, until = self.layout.led(path)

        def work(begin: int, end: int) -> None:
            rollout(
                self.coefficients.body,
                self.coefficients.joints,
                self.coefficients.on,
                self.coefficients.has,
                self.coefficients.rigid,
                states,
                self.inputs.t,
                commands,
                ramps,
                self.row_steps,
                self.substeps,
                per_lane,
                closed,
                loop.gains,
                loop.references,
                loop.noise,
                loop.settings,
                observer is not None,
                measured,
                corrections,
                group,
                self.places,
                self.carried,
                led,
                until,
                self.past,
                self.out,
                self.delivered,
                first_row,
                last_row,
                begin,
                end,
                *self.layout.block(len(self.coefficients.body)),
            )

        bounds = self._shares(first_row, last_row)
        if len(bounds) == 2:
            work(*bounds)
            return
        with ThreadPoolExecutor(len(bounds) - 1) as pool:
            list(pool.map(work, bounds[:-1], bounds[1:]))

    def _observed(self, observer: Observer | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Recorded signals, gains and groups in the kernel's layout."""
        width, group = self.layout.width, np.zeros(1, dtype=np.int64)
        if observer is None:
            return np.zeros((1, width, 1)), np.zeros((1, 1, 1, 2 * width, width)), group
        recorded, gains, group = observer.recorded, observer.gains, observer.group.astype(np.int64)
        kinds = [count // len(self.batch.model.plant.joints) for count in gains.shape[3:]]
        states, channels = (self.layout.places(kind) for kind in kinds)
        if len(channels) == kinds[1] * width:
            return np.ascontiguousarray(recorded), np.ascontiguousarray(gains), group
        seen = np.zeros((len(recorded), kinds[1] * width, self.inputs.windows))
        seen[:, channels] = recorded
        corrections = np.zeros((*gains.shape[:3], *(kind * width for kind in kinds)))
        corrections[..., np.array(states)[:, None], channels] = gains
        return seen, corrections, group

    def _shares(self, first_row: int, last_row: int) -> list[int]:
        """Lane bounds of the threads, in whole vectors."""
        threads = self.simulator.cores
        steps = self.layout.lanes * int(self.substeps[first_row:last_row].max(axis=1, initial=0).sum())
        lanes = self.layout.lanes
        vectors = -(-lanes // TOGETHER)
        shares = max(1, min(threads, vectors, steps // LEAST_WORK_PER_THREAD))
        return [TOGETHER * (vectors * i // shares) for i in range(shares)] + [lanes]

    def rollouts(self, commands: np.ndarray) -> Rollouts:
        reported = self.coefficients.on[R.ON_REPORT]
        delivered = self.layout.per_command(self.delivered) if reported else None
        return self.layout.rollouts(
            self.out, commands, delivered, self.carried[..., self.kept] if len(self.places) else None
        )
