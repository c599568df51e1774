"""Predictions of windows: estimate the state, then replay the recorded command.

The state at a window's first row is the least-squares fit of the model itself to the rows
that the window may see (a moving-horizon estimate without process noise; Rao, Rawlings and
Mayne 2003). It therefore belongs to each candidate model: friction, lag and delay are settled
by the time the prediction starts.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wipx.core.model import ModelBatch
from wipx.identify.sensors import true_states
from wipx.identify.windows import Windows
from wipx.sim.coefficients import coefficients
from wipx.sim.rows import ON_FRICTION
from wipx.sim.simulator import Simulator

# The estimate first sees this much of a window [s]: an unstable plant is linear in its first
# state only for a short time.
REACHES = (0.1, 0.2, 0.4)
STEPS = 8  # Levenberg-Marquardt steps on all known rows, at most
SETTLED = 1e-6  # relative fall of the squared residuals below which a window is through
GUESS_SPAN = 0.08  # [s] of rows through which the first parabola goes
FEWEST_ROWS = 4  # that a step sees in any case
DIVERGED = 5.0  # ranges of the recorded motion; what a prediction that fell over counts


@dataclass(frozen=True)
class Prediction:
    """What P models predict for R windows.

    Attributes:
        initial: Estimated state at each window's first row, shape (2 joints, P, R).
        coordinates: Predicted recorded coordinates, shape (K + 1, joints, P, R).
        floor: Standard deviation that sensor noise alone gives the prediction, through the
            estimated state, shape (K + 1, joints, P, R); None unless asked for.
    """

    initial: np.ndarray
    coordinates: np.ndarray
    floor: np.ndarray | None


@dataclass(frozen=True)
class Predictor:
    """Predicts windows with any model.

    Attributes:
        simulator: The engine.
        windows: What to predict.
        noise: Sensor noise of each coordinate, shape (joints,) [m or rad].
    """

    simulator: Simulator
    windows: Windows
    noise: np.ndarray

    @cached_property
    def _largest(self) -> np.ndarray:
        """Largest error that is counted, shape (joints,) [m or rad]."""
        rows = np.moveaxis(self.windows.recorded, 1, 0)[:, self.windows.known | self.windows.predicted]
        return DIVERGED * np.ptp(rows, axis=1) + 1e3 * self.noise

    @cached_property
    def _parabola(self) -> np.ndarray:
        """Recorded coordinates and rates at each window's first row, by a parabola, shape (2 joints, R)."""
        w = self.windows
        joints = w.recorded.shape[1]
        guess = np.zeros((2 * joints, w.count))
        for r in range(w.count):
            rows = np.flatnonzero(w.known[:, r])
            t = w.inputs.t[rows, r] - w.inputs.t[rows[0], r]
            count = max(FEWEST_ROWS, int(np.searchsorted(t, GUESS_SPAN)))
            degree = min(2, len(rows) - 1)
            fit = np.polynomial.polynomial.polyfit(t[:count], w.recorded[rows[:count], :, r], degree)
            guess[:joints, r], guess[joints:, r] = fit[0], fit[1]
        return guess

    def first_guess(self, batch: ModelBatch) -> np.ndarray:
        """States from a parabola through the first known rows, shape (2 joints, P, R)."""
        return true_states(batch, np.repeat(self._parabola[:, None, :], batch.size, axis=1))

    def predict(self, batch: ModelBatch, near: np.ndarray | None = None, *, floor: bool = False) -> Prediction:
        """Estimate the states of all windows and predict them.

        Args:
            batch: P models.
            near: States of a similar model, from which the estimate starts, shape (2 joints, P, R);
                without them it starts from a parabola and sees more and more of each window.
            floor: Whether to propagate the sensor noise too.
        """
        starts = self._approaches(batch) if near is None else [near]
        settled = [self._settle(batch, start) for start in starts]
        state, gain = settled[0].state, settled[0].gain
        if len(settled) == 2:  # each window takes the better of both
            first = settled[0].cost <= settled[1].cost
            state = np.where(first, state, settled[1].state)
            gain = gain.where(first, settled[1].gain)
        rollouts = self.simulator.replay(batch, self.windows.inputs, state)
        spread = self._floor(batch, state, gain) if floor else None
        return Prediction(state, rollouts.coordinates, spread)

    def _approaches(self, batch: ModelBatch) -> list[np.ndarray]:
        """States to start from, having seen more and more of each window.

        Where a joint can stick there are two: one as it is, one estimated with friction that
        does not stick yet.
        """
        soft = self._softened
        state = self.first_guess(batch)
        for reach in self._reaches():
            residuals, gain = soft.state_gain(batch, state, reach)
            state = state + soft.correction(gain, residuals)
        return [state, soft._settle(batch, state).state] if self._sticks(batch) else [state]

    def _sticks(self, batch: ModelBatch) -> bool:
        return not self.simulator.smoothing and bool(coefficients(batch).on[ON_FRICTION])

    @cached_property
    def _softened(self) -> "Predictor":
        """The same, with friction that builds up over the speed that noise alone suggests within ten milliseconds."""
        if self.simulator.smoothing:
            return self
        return replace(self, simulator=self.simulator.smoothed(tuple((100.0 * self.noise).tolist())))

    def residuals(self, coordinates: np.ndarray, rows: np.ndarray, begin: int = 0) -> np.ndarray:
        """Recorded minus predicted in standard deviations of the noise, zero outside of `rows`.

        Args:
            coordinates: Shape (K + 1, joints, P, R), or fewer rows.
            rows: Which rows count, shape (K + 1, R).
            begin: Row of the windows with which they begin.
        """
        n = len(coordinates)
        scaled = self.windows.recorded[begin : begin + n, :, None, :] - coordinates
        largest = self._largest[:, None, None]
        np.fmin(scaled, largest, out=scaled)  # also where it is not a number
        np.fmax(scaled, -largest, out=scaled)
        scaled /= self.noise[:, None, None]
        scaled *= rows[:n, None, None, :]
        return scaled

    def state_gain(self, batch: ModelBatch, state: np.ndarray, reach: float = np.inf) -> tuple[np.ndarray, "StateGain"]:
        """Residuals of the known rows at a state, and their dependence on it.

        Args:
            batch: P models.
            state: At each window's first row, shape (2 joints, P, R).
            reach: Known rows later than this after the first do not count [s].

        Returns:
            Residuals of the rows from the first known one on, shape (rows, joints, P, R), and the linearisation.
        """
        w = self.windows
        known = w.known & self._within(reach)
        inputs = w.inputs.until(_last_row(known))
        size, names = batch.size, batch.names
        steps = self._state_steps()
        n = len(steps)
        tiled = np.concatenate([state, *(state + _unit(steps, i) for i in range(n))], axis=1)
        values = None if batch.values is None else np.tile(batch.values, (n + 1, 1))
        wide = ModelBatch(batch.model, names, values if values is not None else np.zeros((n + 1, 0)))
        every = self._residuals_seen(self.simulator.replay(wide, inputs, tiled).coordinates, known)
        every = every.reshape(*every.shape[:2], n + 1, size, w.count)
        residuals = every[:, :, 0]
        slopes = every[:, :, 1:] - residuals[:, :, None]
        slopes /= steps[:, None, None]
        return residuals, StateGain(np.ascontiguousarray(np.transpose(slopes, (3, 4, 2, 0, 1))), steps)

    def _residuals_seen(self, coordinates: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """As `residuals`, of the rows from the first known one on."""
        return self.residuals(coordinates[self.known_from :], rows[self.known_from :], self.known_from)

    @cached_property
    def known_from(self) -> int:
        """The first row that any window knows."""
        return int(np.argmax(self.windows.known.any(axis=1)))

    def correction(self, gain: "StateGain", residuals: np.ndarray, damping: np.ndarray | float = 0.0) -> np.ndarray:
        """Change of the state that the residuals of the known rows ask for, shape (2 joints, P, R).

        Args:
            gain: Linearisation at the state, of P models or of one for all.
            residuals: Of the known rows there, shape (rows, joints, P, R).
            damping: Levenberg-Marquardt damping of each window, shape (P, R).
        """
        rows, joints, size, windows = residuals.shape
        models = len(gain.slopes)
        right = np.transpose(residuals.reshape(rows, joints, models, -1, windows), (2, 4, 0, 1, 3))
        right = gain.flat @ right.reshape(models, windows, rows * joints, -1)
        diagonal = np.einsum("praa->pra", gain.normal) * np.asarray(damping)[..., None]
        normal = gain.normal + diagonal[..., None] * np.eye(gain.normal.shape[-1])
        return -np.transpose(np.linalg.solve(normal, right), (2, 0, 3, 1)).reshape(-1, size, windows)

    def _settle(self, batch: ModelBatch, state: np.ndarray) -> "Settled":
        """Levenberg-Marquardt steps on all known rows; a window keeps the best state it had."""
        residuals, gain = self.state_gain(batch, state)
        cost = np.sum(residuals**2, axis=(0, 1))
        damping = np.zeros_like(cost)
        settled = np.zeros(cost.shape, dtype=bool)  # a window's steps do not depend on the others
        for _ in range(STEPS):
            trial = state + self.correction(gain, residuals, damping)
            trial_residuals, trial_gain = self.state_gain(batch, trial)
            trial_cost = np.sum(trial_residuals**2, axis=(0, 1))
            better = (trial_cost < cost) & ~settled
            settled |= np.abs(cost - trial_cost) <= SETTLED * cost
            state = np.where(better, trial, state)
            residuals = np.where(better, trial_residuals, residuals)
            gain = trial_gain.where(better, gain)
            cost = np.where(better, trial_cost, cost)
            damping = np.where(better, 0.1 * damping, np.maximum(10.0 * damping, 0.1))
            if np.all(settled):
                break
        return Settled(state, gain, cost)

    def known_residuals(self, batch: ModelBatch, state: np.ndarray) -> np.ndarray:
        """Residuals of the known rows at a state, shape (rows, joints, P, R)."""
        inputs = self.windows.inputs.until(_last_row(self.windows.known))
        return self._residuals_seen(self.simulator.replay(batch, inputs, state).coordinates, self.windows.known)

    def predicted_residuals(self, batch: ModelBatch, state: np.ndarray) -> np.ndarray:
        """Residuals of the predicted rows at a state, shape (K + 1, joints, P, R)."""
        out = self.simulator.replay(batch, self.windows.inputs, state)
        return self.residuals(out.coordinates, self.windows.predicted)

    def _reaches(self) -> tuple[float, ...]:
        """Reaches that see less than all known rows."""
        t = self.windows.inputs.t
        span = float(np.max((t - self._first_times()) * self.windows.known))
        return tuple(reach for reach in REACHES if reach < 0.8 * span)

    def _first_times(self) -> np.ndarray:
        t = self.windows.inputs.t
        return t[self.windows.inputs.first, np.arange(t.shape[1])]

    def _within(self, reach: float) -> np.ndarray:
        """Rows up to `reach` after each window's first known one, and the fewest, shape (K + 1, R)."""
        early = np.cumsum(self.windows.known, axis=0) <= FEWEST_ROWS
        return early | (self.windows.inputs.t <= self._first_times() + reach)

    def _state_steps(self) -> np.ndarray:
        """Finite-difference steps of the state: a fraction of the noise, and ten times that per second."""
        return np.concatenate([0.3 * self.noise, 3.0 * self.noise])

    def _floor(self, batch: ModelBatch, state: np.ndarray, gain: "StateGain") -> np.ndarray:
        """Spread of the prediction, by perturbing the estimated state along its covariance."""
        covariance = np.linalg.inv(gain.normal)
        base = self.simulator.replay(batch, self.windows.inputs, state).coordinates
        factor = np.linalg.cholesky(covariance)
        variance = np.zeros_like(base) + (self.noise**2)[None, :, None, None]
        for i in range(factor.shape[-1]):
            moved = state + np.moveaxis(factor[..., i], -1, 0)
            variance += (self.simulator.replay(batch, self.windows.inputs, moved).coordinates - base) ** 2
        return np.sqrt(variance)


@dataclass(frozen=True)
class StateGain:
    """How the residuals of the known rows depend on the state at the window's first row.

    Attributes:
        slopes: Of the rows from the first known one on, shape (P, R, 2 joints, rows, joints) [1 / unit of the state].
        steps: Size of each state's finite-difference step.
    """

    slopes: np.ndarray
    steps: np.ndarray

    @property
    def flat(self) -> np.ndarray:
        """Slopes of all rows and joints side by side, shape (P, R, 2 joints, rows joints)."""
        return self.slopes.reshape(*self.slopes.shape[:3], -1)

    @cached_property
    def normal(self) -> np.ndarray:
        """Normal matrix, shape (P, R, 2 joints, 2 joints).

        A joint that sticks gives no information about its rate; a weak prior of a hundred steps
        keeps the matrix regular.
        """
        return self.flat @ np.swapaxes(self.flat, 2, 3) + np.diag((1e-2 / self.steps) ** 2)

    def where(self, mine: np.ndarray, other: "StateGain") -> "StateGain":
        """This one where `mine` (P, R) is true, else the other."""
        return StateGain(np.where(mine[:, :, None, None, None], self.slopes, other.slopes), self.steps)


@dataclass(frozen=True)
class Settled:
    """Estimated states.

    Attributes:
        state: At each window's first row, shape (2 joints, P, R).
        gain: Linearisation there.
        cost: Squared residuals of the known rows, shape (P, R).
    """

    state: np.ndarray
    gain: StateGain
    cost: np.ndarray


def _last_row(rows: np.ndarray) -> np.ndarray:
    """Last row of each column that counts, shape (R,)."""
    return len(rows) - 1 - np.argmax(rows[::-1], axis=0)


def _unit(steps: np.ndarray, i: int) -> np.ndarray:
    step = np.zeros((len(steps), 1, 1))
    step[i] = steps[i]
    return step
