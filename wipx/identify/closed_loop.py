"""The paper's problem: recorded closed-loop trajectories against simulated ones (Eq. 7).

The controller runs in the simulation, at its own constant rate; the recorded command is not used. One trajectory
per class of recordings: the mean over its trials. Recordings of a robot that carried known loads are
simulated with the load of their class on the candidate's body.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from wipx.core.errors import InputError
from wipx.core.load import BODY, Load, with_lean
from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.identify.parameter_space import ParameterSpace
from wipx.identify.problem import LARGEST_CALL, SLOPE_STEP, chunks
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Simulator, StateFeedback

FELL_OVER = 1e3  # [m, rad]; what a trajectory that diverged counts
LINE = 0.05  # [s] of rows through which the line goes that gives coordinates and rates of a moving start
STILL = 0.01  # [s] of rows whose mean is the place of a start at rest


@dataclass(frozen=True)
class Trials:
    """Recordings with the same references of the controller; all are simulated in one call.

    Attributes:
        model: The robot.
        names: Numbers of its body that a load changes; none where there is no load.
        bodies: Their values in each recording, shape (R, len(names)) [SI].
        inputs: Rows at the controller's rate, one window.
        initial: Recorded starts, shape (2 joints, R) [m, rad, m/s, rad/s].
        references: Of the controller, shape (K, 2 joints, 1).
        recorded: Trajectories, shape (L, joints, R) [m, rad].
        classes: Index of the class of each recording, shape (R,).
        weights: Share of each recording in the mean of each class, shape (R, classes).
    """

    model: Model
    names: tuple[str, ...]
    bodies: np.ndarray
    inputs: Inputs
    initial: np.ndarray
    references: np.ndarray
    recorded: np.ndarray
    classes: np.ndarray
    weights: np.ndarray


@dataclass(frozen=True)
class ClosedLoopProblem:
    """Squared distance of mean trajectories.

    Attributes:
        space: The numbers that vary.
        simulator: The engine.
        feedback: The controller.
        trials: The recordings, by the controller's references.
        rows: Row of the controller at each sample, shape (L,).
        labels: Names of the classes.
        target: Mean trajectory of each class, shape (L, joints, classes) [m, rad].
        noise: Of the samples, root mean square over the signals; weighs the priors.
        speeds: What each joint reaches, shape (joints,); measures the smoothing.
    """

    space: ParameterSpace
    simulator: Simulator
    feedback: StateFeedback
    trials: tuple[Trials, ...]
    rows: np.ndarray
    labels: tuple[str, ...]
    target: np.ndarray
    noise: float
    speeds: tuple[float, ...]
    _last: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list, compare=False, repr=False)

    @property
    def valleys(self) -> int:
        """Many: a trajectory is long, and the feedback hides one friction behind another."""
        return 16

    @property
    def near(self) -> bool:
        """Nobody knows."""
        return False

    @property
    def short(self) -> None:
        """None: a trajectory is one window."""
        return None

    @property
    def differences(self) -> int:
        """One: they are forward."""
        return 1

    def smoothed(self, level: float) -> "ClosedLoopProblem":
        """The same problem with dry friction that builds up over a share `level` of the joints' speeds."""
        smoothing = tuple(level * speed for speed in self.speeds)
        return replace(self, simulator=self.simulator.smoothed(smoothing), _last=[])

    def losses(self, cube: np.ndarray) -> np.ndarray:
        """Eq. 7 and the priors, shape (P,): the sums of the squares of `residuals` [m^2 and rad^2]."""
        cube = np.atleast_2d(cube)
        return np.mean(self.class_losses(cube), axis=1) + np.sum(self._priors(cube) ** 2, axis=1)

    def class_losses(self, cube: np.ndarray) -> np.ndarray:
        """What each class adds to the mean of Eq. 7, shape (P, classes) [m^2 and rad^2].

        The sum over the samples of d, the mean square over the signals.
        """
        return np.sum(np.mean(self._errors(np.atleast_2d(cube)) ** 2, axis=1), axis=0)

    def residuals(self, cube: np.ndarray) -> np.ndarray:
        """Errors of all samples, then of the priors, shape (N,); their squares add up to the loss."""
        if not (self._last and np.array_equal(self._last[0][0], cube)):
            self._last[:] = [(cube.copy(), self._flat(cube[None])[0])]
        return self._last[0][1]

    def jacobian(self, cube: np.ndarray, size: np.ndarray | float = 0.0) -> np.ndarray:
        """Slopes of `residuals` by differences over `size`, shape (N, D)."""
        reach = np.maximum(np.broadcast_to(size, cube.shape), SLOPE_STEP)
        steps = np.where(cube + reach <= 1.0, reach, -reach)
        return ((self._flat(cube + np.diag(steps)) - self.residuals(cube)) / steps[:, None]).T

    def scores(self, cube: np.ndarray, slopes: np.ndarray) -> np.ndarray:
        """What each trial, and each prior, adds to half the slope of the loss at a position (D,), shape (pieces, D).

        Args:
            cube: Position.
            slopes: Of `residuals` there, shape (N, D).
        """
        samples, joints, classes = self.target.shape
        of_samples = slopes[: self.target.size].reshape(samples, joints, classes, -1)
        values = self.space.to_values(cube[None])
        pieces = []
        for trials in self.trials:
            errors = _counted(self._simulated(trials, values))[:, :, 0] - trials.recorded
            shares = trials.weights[np.arange(len(trials.classes)), trials.classes] / np.sqrt(joints * classes)
            pieces.append(np.einsum("ljr,ljrd->rd", errors * shares, of_samples[:, :, trials.classes]))
        priors = self._priors(cube[None])[0]
        return np.concatenate([*pieces, slopes[self.target.size :] * priors[:, None]])

    def trajectories(self, cube: np.ndarray) -> np.ndarray:
        """Mean simulated trajectories, shape (L, joints, P, classes) [m, rad]."""
        values = self.space.to_values(np.atleast_2d(cube))
        shape = (*self.target.shape[:2], len(values), len(self.labels))
        means = np.zeros(shape)
        for trials in self.trials:
            for part in self._parts(trials, len(values)):
                means[:, :, part] += self._simulated(trials, values[part]) @ trials.weights
        return means

    def noise_floor(self, cube: np.ndarray | None = None) -> float:
        """The loss that a perfect model would have, estimated from the scatter of the trials of a class.

        The variance of a mean of n trials is 1/n of theirs. What a model explains of the scatter, the places from which
        the trials started, is subtracted.

        Args:
            cube: Position of the model that is subtracted, shape (D,); None for where a search begins.

        Returns:
            In the units of the loss; NaN where no class has two trials.
        """
        values = self.space.to_values(np.atleast_2d(self.space.start if cube is None else cube))
        floors = []
        for trials in self.trials:
            errors = trials.recorded - _counted(self._simulated(trials, values))[:, :, 0]
            for c in np.unique(trials.classes):
                of_class = errors[:, :, trials.classes == c]
                if of_class.shape[2] > 1:
                    variance = np.var(of_class, axis=2, ddof=1) / of_class.shape[2]
                    floors.append(np.sum(np.mean(variance, axis=1)))
        return float(np.mean(floors)) if floors else float("nan")

    def _simulated(self, trials: Trials, values: np.ndarray) -> np.ndarray:
        """Samples of every trial, shape (L, joints, P, R)."""
        count, robots = len(values), len(trials.bodies)
        lanes = np.concatenate([np.repeat(values, robots, axis=0), np.tile(trials.bodies, (count, 1))], axis=1)
        batch = ModelBatch(trials.model, (*self.space.names, *trials.names), lanes)
        initial = np.tile(trials.initial, (1, count))[..., None]
        run = self.simulator.close_loop(batch, trials.inputs, initial, self.feedback, trials.references)
        return run.coordinates[self.rows, :, :, 0].reshape(len(self.rows), -1, count, robots)

    def _parts(self, trials: Trials, candidates: int):
        """Slices of the candidates that keep a call's memory small."""
        return chunks(candidates, max(1, LARGEST_CALL // (trials.references.size * len(trials.bodies))))

    def _errors(self, cube: np.ndarray) -> np.ndarray:
        return _counted(self.trajectories(cube)) - self.target[:, :, None, :]

    def _flat(self, cube: np.ndarray) -> np.ndarray:
        _, joints, classes = self.target.shape
        errors = np.moveaxis(self._errors(cube), 2, 0).reshape(len(cube), -1) / np.sqrt(joints * classes)
        return np.concatenate([errors, self._priors(cube)], axis=1)

    def _priors(self, cube: np.ndarray) -> np.ndarray:
        """A distance of one standard deviation counts as much as one sample that is off by the noise."""
        _, joints, classes = self.target.shape
        return self.space.prior_residuals(cube) * (self.noise / np.sqrt(joints * classes))


@dataclass(frozen=True)
class Sampling:
    """How trajectories are read off recordings.

    Attributes:
        times: Of the samples after a recording's first row, shape (L,) [s].
        rate: Of the controller, whose rows next to these times are taken [Hz].
        at_rest: Whether the robot was released from rest at the first row. Rates then start at zero and coordinates
            at the mean of the first 10 ms, in which a robot that starts to fall moves by far less than
            the noise. Otherwise they are those of a straight line through the first 50 ms: its slope is the
            rate in their middle, which for a robot released from rest is not that of its start.
    """

    times: np.ndarray
    rate: float
    at_rest: bool = False

    @property
    def rows(self) -> np.ndarray:
        """Row of the controller at each sample, shape (L,)."""
        return np.round(self.times * self.rate).astype(int)

    def trajectory(self, recording: Recording, coordinates: tuple[str, ...]) -> np.ndarray:
        """Recorded coordinates at the times of these rows, shape (L, joints)."""
        after = recording.t - recording.t[0]
        return np.column_stack([np.interp(self.rows / self.rate, after, recording[c]) for c in coordinates])

    def start(self, recording: Recording, coordinates: tuple[str, ...]) -> np.ndarray:
        """Coordinates and rates at the first row, shape (2 joints,)."""
        after = recording.t - recording.t[0]
        shown = recording.stack(coordinates)
        if self.at_rest:
            place = shown[after <= STILL].mean(axis=0)
            return np.concatenate([place, np.zeros_like(place)])
        count = max(3, int(np.searchsorted(after, LINE)))
        return np.polynomial.polynomial.polyfit(after[:count], shown[:count], 1).ravel()


def closed_loop_problem(
    recordings: tuple[Recording, ...],
    classes: Sequence[str],
    loads: Sequence[Load | None],
    space: ParameterSpace,
    simulator: Simulator,
    feedback: StateFeedback,
    sampling: Sampling,
    *,
    noise: np.ndarray,
    speeds: tuple[float, ...],
) -> ClosedLoopProblem:
    """Read starts, references and mean trajectories off the recordings.

    Args:
        recordings: R recordings.
        classes: Class of each.
        loads: Known load on the body in each.
        space: The numbers that vary.
        simulator: The engine.
        feedback: The controller.
        sampling: How trajectories are read.
        noise: Of the sensors, shape (joints,) [m or rad].
        speeds: What each joint reaches, shape (joints,).

    Raises:
        InputError: a recording is shorter than the trajectory, the recordings of a class had different
            loads, or a number is free that a load changes.
    """
    plant = space.model.plant
    for r in recordings:
        if r.duration < sampling.times[-1]:
            raise InputError(
                f"{r.source or r.name}: {r.duration:.3g} s long, expected {sampling.times[-1]:g} s; leave it out"
            )
    _check_loads(classes, loads, space)
    labels = tuple(sorted(set(classes)))
    index = np.array([labels.index(c) for c in classes])
    weights = (index[:, None] == np.arange(len(labels))).astype(float)
    weights /= weights.sum(axis=0)
    recorded = np.stack([sampling.trajectory(r, plant.coordinates) for r in recordings], axis=-1)
    initial = np.stack([sampling.start(r, plant.coordinates) for r in recordings], axis=-1)
    rows = sampling.rows
    at = np.arange(rows[-1] + 1) / sampling.rate
    names = (*plant.coordinates, *plant.rates)
    references = np.stack([np.column_stack([_reference(r, n, at) for n in names]) for r in recordings], axis=-1)
    inputs = Inputs.regular(len(at) / sampling.rate, sampling.rate, len(plant.commands))
    model, changed, bodies = _loaded_bodies(space.model, loads)
    courses = [references[..., r].tobytes() for r in range(len(recordings))]
    trials = []
    for course in dict.fromkeys(courses):
        own = np.array([other == course for other in courses])
        parts = (initial[:, own], references[..., own][..., :1], recorded[..., own])
        trials.append(Trials(model, changed, bodies[own], inputs, *parts, index[own], weights[own]))
    size = float(np.sqrt(np.mean(noise**2)))
    return ClosedLoopProblem(space, simulator, feedback, tuple(trials), rows, labels, recorded @ weights, size, speeds)


def _loaded_bodies(model: Model, loads: Sequence[Load | None]) -> tuple[Model, tuple[str, ...], np.ndarray]:
    """A model that can carry every load, the numbers of its body that loads change, and their values (R, 4)."""
    if not any(loads):
        return model, (), np.zeros((len(loads), 0))
    leaning = with_lean(model)
    loaded = [leaning if load is None else load.on(leaning) for load in loads]
    return leaning, BODY, np.array([[m.value(name) for name in BODY] for m in loaded])


def _check_loads(classes: Sequence[str], loads: Sequence[Load | None], space: ParameterSpace) -> None:
    known: dict[str, Load | None] = {}
    for label, load in zip(classes, loads, strict=True):
        if known.setdefault(label, load) != load:
            raise InputError(
                f"objective.classes: the recordings of class {label} had different loads; tell them apart by name"
            )
    freed = [name for name in space.names if name in (*BODY, "geometry/inertia.scale")]
    if freed and any(load is not None for load in loads):
        raise InputError(f"{freed[0]} is free or uncertain, but known loads change it; give the unloaded body as exact")


def _counted(coordinates: np.ndarray) -> np.ndarray:
    """Trajectories of which those that diverged are finite."""
    return np.clip(np.nan_to_num(coordinates, nan=FELL_OVER), -FELL_OVER, FELL_OVER)


def _reference(recording: Recording, column: str, at: np.ndarray) -> np.ndarray:
    name = f"{column}_ref"
    if name not in recording:
        return np.zeros_like(at)
    return np.interp(at, recording.t - recording.t[0], recording[name])
