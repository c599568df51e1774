"""Smooth motions of logs, and how well the forces that they need fit the recorded commands.

With the right joint, sign, zero and unit of every position, the command of each drive is

    u = k tau(q, v, a) + F_c sign(v) + sigma v + J a + u_0,        k, F_c, sigma, J >= 0

up to physics that the nominal model lacks. tau is what the rigid robot needs. The lag of a position drive, target minus
position, is such a command too, with k = 1 / k_p.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wipx.core.tree import Tree
from wipx.sim.tree.inverse import needed_forces

WINDOW, FEWEST = 0.12, 9  # [s], rows: over which a motion is smoothed by cubics (Savitzky, Golay 1964)
MOST_ROWS = 500  # of all logs together, that are fitted
AGAINST = 0.5  # share left above which a command may be counted against the motion
CORRELATED = 0.5  # [s] over which errors of a rough model resemble each other; one independent row each


@dataclass(frozen=True)
class Motion:
    """Positions with their derivatives, and commands, smoothed alike.

    Attributes:
        q: Shape (rows, C) [as logged].
        v: Likewise [per s].
        a: Likewise [per s^2].
        u: Shape (rows, D) [as logged].
        seconds: Of all logs together.
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    u: np.ndarray
    seconds: float

    @property
    def independent(self) -> float:
        """Number of independent rows that a comparison counts."""
        return self.seconds / CORRELATED


@dataclass(frozen=True)
class Placed:
    """How columns of a log stand for the joints of a robot: q = scale * column + offset.

    Attributes:
        columns: Number of the position's column, by joint.
        scale: Sign and unit, shape (N,) [rad or m per unit].
        offset: Shape (N,) [rad or m].
        commands: Number of the command's column, by joint; -1 for a joint without one.
    """

    columns: tuple[int, ...]
    scale: np.ndarray
    offset: np.ndarray
    commands: tuple[int, ...]


@dataclass(frozen=True)
class Fit:
    """How well a placing explains the commands.

    Attributes:
        left: Share of each command's variance that stays unexplained, shape (N,); NaN without a command.
        sign: -1 where the command is counted against the motion, else 1, shape (N,).
        coefficients: k, F_c, sigma, J of each joint [units of the command], shape (N, 4).
        error: Standard error of k, shape (N,).
    """

    left: np.ndarray
    sign: np.ndarray
    coefficients: np.ndarray
    error: np.ndarray

    @property
    def misfit(self) -> float:
        """Sum of the logarithms of what is left; differences of it compare placings."""
        known = self.left[np.isfinite(self.left)]
        return float(np.sum(np.log(known + 1e-6)))


def motion_of(t: Sequence[np.ndarray], q: Sequence[np.ndarray], u: Sequence[np.ndarray]) -> Motion:
    """The motion of several logs.

    Args:
        t: Times of each log, shape (rows,) [s].
        q: Positions, shape (rows, C).
        u: Commands, shape (rows, D).
    """
    stride_of = max(1.0, sum(len(each) for each in t) / MOST_ROWS)
    parts = [_smoothed(*each, stride_of) for each in zip(t, q, u, strict=True)]
    joined = [np.concatenate(columns) for columns in zip(*parts, strict=True)]
    return Motion(*joined, seconds=float(sum(each[-1] - each[0] for each in t)))


def _smoothed(t: np.ndarray, q: np.ndarray, u: np.ndarray, stride: float) -> tuple[np.ndarray, ...]:
    """Positions, rates, accelerations and commands of one log."""
    from scipy.signal import savgol_filter

    step = float(np.median(np.diff(t)))
    even = np.arange(t[0], t[-1], step)
    rows = max(FEWEST, round(WINDOW / step)) | 1
    if len(even) <= rows:
        empty = np.zeros((0, q.shape[1]))
        return empty, empty, empty, np.zeros((0, u.shape[1]))

    def at(values: np.ndarray, derivative: int) -> np.ndarray:
        sampled = np.stack([np.interp(even, t, column) for column in values.T], axis=1)
        return np.asarray(savgol_filter(sampled, rows, 3, deriv=derivative, delta=step, axis=0))

    kept = np.arange(rows // 2, len(even) - rows // 2, max(1, round(stride)))
    commands = at(u, 0) if u.shape[1] else np.zeros((len(even), 0))
    return at(q, 0)[kept], at(q, 1)[kept], at(q, 2)[kept], commands[kept]


def fit(tree: Tree, motion: Motion, placed: Placed) -> Fit:
    """How well a placing explains the commands."""
    columns = list(placed.columns)
    q = placed.scale * motion.q[:, columns] + placed.offset
    v, a = placed.scale * motion.v[:, columns], placed.scale * motion.a[:, columns]
    tau = needed_forces(tree, q, v, a)
    count = len(columns)
    left, error, signs = np.full(count, np.nan), np.full(count, np.inf), np.ones(count)
    coefficients = np.full((count, 4), np.nan)
    for j, command in enumerate(placed.commands):
        if command < 0:
            continue
        u = motion.u[:, command]
        turning = np.sign(v[:, j]) * (np.abs(v[:, j]) > 0.02 * np.abs(v[:, j]).max(initial=0.0))
        causes = np.stack([tau[:, j], turning, v[:, j], a[:, j]], axis=1)
        found, sign = _regression(causes, u, motion.independent), 1.0
        if found[0] > AGAINST:
            other = _regression(causes, -u, motion.independent)
            found, sign = (other, -1.0) if other[0] < found[0] else (found, sign)
        left[j], coefficients[j], error[j] = found
        signs[j] = sign
    return Fit(left, signs, coefficients, error)


def _regression(causes: np.ndarray, u: np.ndarray, independent: float) -> tuple[float, np.ndarray, float]:
    """Share left of the variance, non-negative coefficients, and the standard error of the first."""
    from scipy.optimize import nnls

    x, y = causes - causes.mean(axis=0), u - u.mean()
    size = np.sqrt(np.mean(x**2, axis=0))
    spread = float(np.mean(y**2))
    if spread == 0.0 or not np.any(size > 0.0):
        return 1.0, np.zeros(4), np.inf
    size = np.where(size > 0.0, size, np.inf)
    gram = (x / size).T @ (x / size) / len(x) + 1e-9 * np.eye(4)
    factor = np.linalg.cholesky(gram)
    right = (x / size).T @ y / len(x)
    scaled = nnls(factor.T, np.linalg.solve(factor, right))[0]
    residual = float(np.mean((y - (x / size) @ scaled) ** 2))
    error = np.sqrt(np.linalg.inv(gram)[0, 0] * residual / independent) / size[0] if np.isfinite(size[0]) else np.inf
    return residual / spread, scaled / size, float(error)
