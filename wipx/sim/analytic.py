"""The analytic simulator: thousands of rollouts at once in compiled code.

A rollout is one model on one window of inputs. Open loop it replays commands; closed loop a
state feedback computes them at the rows of the window, from what the sensors show. Controllers
that are Python objects drive the same code row by row (`drive`).
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from wipx.core.errors import check_positive
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import Plant
from wipx.sim import rows as R
from wipx.sim.coefficients import coefficients, joint_index
from wipx.sim.inputs import Inputs
from wipx.sim.kernel import rollout
from wipx.sim.rows import W
from wipx.sim.simulator import Rollouts, StateFeedback

LEAST_WORK_PER_THREAD = 150_000  # lane steps, about 1.5 ms: less is not worth a thread
NO_FEEDBACK = np.zeros((1, 4, 1))
HELD = np.zeros((1, 2, 1))
NO_OBSERVER = np.zeros((1, 1, 1, 4, 4))


@dataclass(frozen=True)
class Observer:
    """Corrects the state at every row by gains times recorded minus shown.

    Attributes:
        recorded: Coordinates, then rates, shape (K + 1, 2 joints, R).
        gains: Shape (groups, K + 1, R, 2 joints, 2 joints), from channels to states; zero where nothing
            was measured.
        group: Which of the gains each model has, shape (P,).
        spread: Half width by which single commands scatter about the mean that the log has, shape (P,)
            [N or N m]; thresholds of the actuator answer to single commands.
        reports: Whether to tell the forces of the drives.
    """

    recorded: np.ndarray
    gains: np.ndarray
    group: np.ndarray
    spread: np.ndarray
    reports: bool = False


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

    def smoothed(self, speeds: tuple[float, ...]) -> "AnalyticSimulator":
        """The same engine with dry friction that builds up over these `speeds` of the joints [m/s, rad/s]."""
        return replace(self, smoothing=speeds)

    def replay(self, batch: ModelBatch, inputs: Inputs, initial: np.ndarray) -> Rollouts:
        """Open loop: the recorded commands act on every model.

        Args:
            batch: P models.
            inputs: R windows.
            initial: True coordinates, then rates, at each window's first integrated row,
                shape (2 joints, P, R) [m, rad, m/s, rad/s].
        """
        run = _Run(self, batch, inputs)
        states = run.states(initial)
        run.advance(states, 0, run.rows)
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
        states = run.states(initial)
        if observer.reports:
            run.report()
        run.advance(states, 0, run.rows, observer=observer)
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
        states = run.states(initial)
        commands = np.zeros((run.rows, 2, run.lanes))
        pattern = run.pattern
        gains = np.zeros((2, 4))
        driven = [joint_index(site) for site in batch.model.plant.actuated]
        gains[np.ix_(driven, pattern)] = feedback.gains
        wide = np.zeros((run.rows, 4, inputs.windows))
        wide[:, pattern] = references
        noise_rows = np.zeros((run.rows, 4, run.lanes))
        if noise is not None:
            noise_rows[:, pattern] = noise.reshape(run.rows, len(pattern), run.lanes)
        smoothing = -1.0 if feedback.rate_filter is None else feedback.rate_filter
        settings = np.array([smoothing, feedback.limit])
        run.advance(states, 0, run.rows, commands, (gains, wide, noise_rows, settings))
        shaped = commands[:, driven].reshape(run.rows, len(driven), batch.size, inputs.windows)
        return run.rollouts(shaped)

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
        states = run.states(initial[:, None, None])
        commands = np.zeros((run.rows, 2, 1))
        driven = [joint_index(site) for site in model.plant.actuated]
        run.advance(states, 0, 0, commands)
        for k in range(run.rows):
            measured = run.out[k, run.pattern, 0]
            commands[k, driven, 0] = controller(float(inputs.t[k, 0]), measured)
            run.advance(states, k, k + 1, commands)
        return run.rollouts(commands[:, driven, :, None])


class _Run:
    """One call of the kernel: its arrays, in the kernel's layout."""

    def __init__(self, simulator: AnalyticSimulator, batch: ModelBatch, inputs: Inputs) -> None:
        self.plant: Plant = batch.model.plant
        self.inputs = inputs
        self.batch = batch
        self.simulator = simulator
        self.coefficients = coefficients(batch)
        for site, speed in zip(self.plant.joints, simulator.smoothing, strict=False):
            self.coefficients.rows[R.SMOOTHING + joint_index(site)] = speed
            self.coefficients.present[R.ON_SMOOTHING] = True
        self.rows = len(inputs.t) - 1
        self.lanes = batch.size * inputs.windows
        joints = [joint_index(site) for site in self.plant.joints]
        self.joints = joints
        self.pattern = [*joints, *(2 + j for j in joints)]
        self.substeps = inputs.substeps(simulator.step)
        self.row_steps = np.diff(inputs.t, axis=0) / np.maximum(self.substeps, 1)
        self.out = np.empty((self.rows + 1, 4, self.lanes))
        late = bool(self.coefficients.present[R.ON_SENSOR_DELAY])
        self.past = np.zeros((self.rows + 1, 4, self.lanes) if late else (1, 4, 1))
        self.delivered = np.zeros((1, 2, 1))

    def report(self) -> None:
        """Keep the forces of the drives too."""
        self.coefficients.present[R.ON_REPORT] = True
        self.delivered = np.zeros((self.rows, 2, self.lanes))

    def states(self, initial: np.ndarray) -> np.ndarray:
        states = np.zeros((R.STATES, self.lanes))
        states[self.pattern] = np.broadcast_to(
            initial, (len(self.pattern), self.batch.size, self.inputs.windows)
        ).reshape(len(self.pattern), self.lanes)
        return states

    def advance(self, states, first_row, last_row, commands=None, feedback=None, observer=None) -> None:
        """Simulate rows; `commands` (K, 2, lanes) are per lane, otherwise the inputs' own are replayed."""
        per_lane = commands is not None
        if commands is None:
            commands = np.zeros((self.rows, 2, self.inputs.windows))
            driven = [joint_index(site) for site in self.plant.actuated]
            commands[:, driven] = self.inputs.commands
        closed = feedback is not None
        gains, references, noise, settings = feedback or (np.zeros((2, 4)), NO_FEEDBACK, NO_FEEDBACK, np.zeros(2))
        measured, corrections, group = self._observed(observer)
        ramps = HELD
        if not per_lane and self.inputs.ramps is not None:
            ramps = np.zeros((self.rows, 2, self.inputs.windows))
            ramps[:, [joint_index(site) for site in self.plant.actuated]] = self.inputs.ramps
            self.coefficients.present[R.ON_RAMP] = True

        spread = np.zeros(self.batch.size) if observer is None else observer.spread

        def work(begin: int, end: int) -> None:
            rollout(
                self.coefficients.rows,
                self.coefficients.present,
                self.coefficients.actuated,
                states,
                self.inputs.t,
                commands,
                ramps,
                spread,
                self.row_steps,
                self.substeps,
                per_lane,
                closed,
                gains,
                references,
                noise,
                settings,
                observer is not None,
                measured,
                corrections,
                group,
                self.past,
                self.out,
                self.delivered,
                first_row,
                last_row,
                begin,
                end,
            )

        bounds = self._shares(first_row, last_row)
        if len(bounds) == 2:
            work(*bounds)
            return
        with ThreadPoolExecutor(len(bounds) - 1) as pool:
            list(pool.map(work, bounds[:-1], bounds[1:]))

    def _observed(self, observer: Observer | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Recorded signals, gains and groups in the kernel's layout."""
        if observer is None:
            return NO_FEEDBACK, NO_OBSERVER, np.zeros(1, dtype=np.int64)
        measured = np.zeros((self.rows + 1, 4, self.inputs.windows))
        measured[:, self.pattern] = observer.recorded
        if len(self.pattern) == 4:
            return measured, observer.gains, observer.group.astype(np.int64)
        gains = np.zeros((*observer.gains.shape[:3], 4, 4))
        gains[..., np.array(self.pattern)[:, None], self.pattern] = observer.gains
        return measured, gains, observer.group.astype(np.int64)

    def _shares(self, first_row: int, last_row: int) -> list[int]:
        """Lane bounds of the threads, in whole blocks."""
        threads = self.simulator.threads or os.cpu_count() or 1
        steps = self.lanes * int(self.substeps[first_row:last_row].max(axis=1, initial=0).sum())
        blocks = -(-self.lanes // W)
        shares = max(1, min(threads, blocks, steps // LEAST_WORK_PER_THREAD))
        return [min(self.lanes, W * (blocks * i // shares)) for i in range(shares)] + [self.lanes]

    def rollouts(self, commands: np.ndarray) -> Rollouts:
        shape = (self.rows + 1, len(self.joints), self.batch.size, self.inputs.windows)
        first, last = self.joints[0], self.joints[-1] + 1  # slices, not copies: the joints are neighbours
        coordinates = self.out[:, first:last].reshape(shape)
        rates = self.out[:, 2 + first : 2 + last].reshape(shape)
        if not self.coefficients.present[R.ON_REPORT]:
            return Rollouts(coordinates, rates, commands)
        driven = [joint_index(site) for site in self.plant.actuated]
        forces = self.delivered[:, driven].reshape(self.rows, len(driven), self.batch.size, self.inputs.windows)
        return Rollouts(coordinates, rates, commands, forces)
