"""The paper's problem: recorded closed-loop trajectories against simulated ones (Eq. 7).

The controller runs in the simulation, the recorded command is not used. One trajectory per
class of recordings: the mean over its recordings.
"""

from dataclasses import dataclass, replace

import numpy as np

from wipx.core.errors import InputError
from wipx.core.recording import Recording
from wipx.identify.parameter_space import ParameterSpace
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Simulator, StateFeedback

FELL_OVER = 1e3  # [m, rad]; what a trajectory that diverged counts
SLOPE_STEP = 1e-4  # of the search interval


@dataclass(frozen=True)
class ClosedLoopProblem:
    """Squared distance of mean trajectories.

    Attributes:
        space: The numbers that vary.
        simulator: The engine.
        feedback: The controller.
        inputs: Rows at the controller's rate, one window per recording.
        initial: Recorded start, shape (2 joints, 1, R).
        references: Of the controller, shape (K, 2 joints, R).
        rows: Row of each sample, shape (L,).
        target: Mean trajectory of each class, shape (L, joints, classes).
        weights: Share of each recording in each class, shape (R, classes).
        speeds: What each joint reaches, shape (joints,).
    """

    space: ParameterSpace
    simulator: Simulator
    feedback: StateFeedback
    inputs: Inputs
    initial: np.ndarray
    references: np.ndarray
    rows: np.ndarray
    target: np.ndarray
    weights: np.ndarray
    speeds: tuple[float, ...]

    @classmethod
    def of(
        cls,
        recordings: tuple[Recording, ...],
        space: ParameterSpace,
        simulator: Simulator,
        feedback: StateFeedback,
        rate: float,
        *,
        times: np.ndarray,
        classes: list[str],
        speeds: tuple[float, ...],
    ) -> "ClosedLoopProblem":
        """Read starts, references and mean trajectories off the recordings.

        Args:
            recordings: R recordings.
            space: The numbers that vary.
            simulator: The engine.
            feedback: The controller.
            rate: At which it runs [Hz].
            times: Of the samples after a recording's first row, shape (L,) [s].
            classes: Class of each recording.
            speeds: What each joint reaches.

        Raises:
            InputError: a recording is shorter than the trajectory.
        """
        plant = space.model.plant
        for r in recordings:
            if r.duration < times[-1]:
                raise InputError(
                    f"{r.source or r.name}: {r.duration:.3g} s long, expected {times[-1]:g} s; leave it out"
                )
        inputs = Inputs.regular(float(times[-1]) + 1.0 / rate, rate, len(plant.commands), len(recordings))
        at = inputs.t[:-1, 0]
        names = [*plant.coordinates, *plant.rates]
        references = np.stack([[_reference(r, n, at) for n in names] for r in recordings], axis=-1).transpose(1, 0, 2)
        recorded = np.stack(
            [[np.interp(times, r.t - r.t[0], r[c]) for c in plant.coordinates] for r in recordings], axis=-1
        )
        labels = sorted(set(classes))
        weights = np.array([[float(c == label) for label in labels] for c in classes])
        weights /= weights.sum(axis=0)
        return cls(
            space,
            simulator,
            feedback,
            inputs,
            np.stack([_start(r, plant.coordinates) for r in recordings], axis=-1)[:, None, :],
            references,
            np.round(times * rate).astype(int),
            recorded.transpose(1, 0, 2) @ weights,
            weights,
            speeds,
        )

    def smoothed(self, level: float) -> "ClosedLoopProblem":
        """The same problem with dry friction that builds up over a share `level` of the joints' speeds."""
        smoothing = tuple(level * speed for speed in self.speeds)
        return replace(self, simulator=self.simulator.smoothed(smoothing))

    def losses(self, cube: np.ndarray) -> np.ndarray:
        """Eq. 7 with the mean square for d: shape (P,) [m^2 and rad^2 added]."""
        cube = np.atleast_2d(cube)
        priors = np.sum(self.space.prior_residuals(cube) ** 2, axis=1) / self.target.size
        return np.sum(self._errors(cube) ** 2, axis=(0, 1, 3)) / self.target.shape[2] + priors

    def residuals(self, cube: np.ndarray) -> np.ndarray:
        """Errors of all samples, then of the priors, shape (N,)."""
        return self._flat(np.atleast_2d(cube))[0]

    def jacobian(self, cube: np.ndarray, size: np.ndarray | float = 0.0) -> np.ndarray:
        """Slopes of `residuals` by differences over `size`, shape (N, D)."""
        reach = np.maximum(np.broadcast_to(size, cube.shape), SLOPE_STEP)
        steps = np.where(cube + reach <= 1.0, reach, -reach)
        rows = self._flat(np.concatenate([cube[None], cube + np.diag(steps)]))
        return ((rows[1:] - rows[0]) / steps[:, None]).T

    def trajectories(self, cube: np.ndarray) -> np.ndarray:
        """Mean simulated trajectories, shape (L, joints, P, classes) [m, rad]."""
        batch = self.space.batch(cube)
        out = self.simulator.close_loop(batch, self.inputs, self.initial, self.feedback, self.references)
        return out.coordinates[self.rows] @ self.weights

    def _errors(self, cube: np.ndarray) -> np.ndarray:
        errors = self.trajectories(cube) - self.target[:, :, None, :]
        return np.clip(np.nan_to_num(errors, nan=FELL_OVER), -FELL_OVER, FELL_OVER)

    def _flat(self, cube: np.ndarray) -> np.ndarray:
        errors = np.moveaxis(self._errors(cube), 2, 0).reshape(len(cube), -1)
        return np.concatenate([errors, self.space.prior_residuals(cube)], axis=1)


def _reference(recording: Recording, column: str, at: np.ndarray) -> np.ndarray:
    name = f"{column}_ref"
    if name not in recording:
        return np.zeros_like(at)
    return np.interp(at, recording.t - recording.t[0], recording[name])


def _start(recording: Recording, coordinates: tuple[str, ...]) -> np.ndarray:
    """Coordinates and rates at the first row, by a straight line through the first 50 ms."""
    count = max(3, int(np.searchsorted(recording.t - recording.t[0], 0.05)))
    t = recording.t[:count] - recording.t[0]
    lines = [np.polynomial.polynomial.polyfit(t, recording[c][:count], 1) for c in coordinates]
    return np.array([line[0] for line in lines] + [line[1] for line in lines])
