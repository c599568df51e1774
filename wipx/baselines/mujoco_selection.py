"""Which of the fitted effects the predictions need, the others fitted anew without each.

Two numbers that make up for each other (a scale and a bias of a sensor that hardly moves) look indispensable as long
as one is removed and the other kept; Gauss-Newton steps of the others tell.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.baselines.mujoco_problem import ToolboxProblem
from wipx.baselines.prediction_search import LOSS_WITHOUT

TRIED = 2  # removals that should cost the least, of which the one that does is made
STEPS = 2  # of the others, after a removal


@dataclass(frozen=True)
class MujocoSelection:
    """What is left of a fit.

    Attributes:
        cube: Position at which the effects that are not needed are neutral, shape (D,).
        growth: Share by which the loss grows without each of the others.
    """

    cube: np.ndarray
    growth: Mapping[str, float]

    @classmethod
    def of(cls, problem: ToolboxProblem, cube: np.ndarray, effects: tuple[str, ...]) -> "MujocoSelection":
        """Remove what matters least, again and again, while the loss stays within `LOSS_WITHOUT` of that of the fit."""
        names = problem.space.names
        own = {e: np.array([name.rpartition(".")[0] == e for name in names]) for e in effects}
        removal = _Removal(problem, cube, problem.residuals(cube), problem.jacobian(cube))
        now = _Removed(cube, float(problem.losses(cube)[0]))
        allowed = (1.0 + LOSS_WITHOUT) * now.loss
        gone, left = np.zeros(len(names), dtype=bool), list(effects)
        for group in _groups(effects):
            without = gone | np.any([own[e] for e in group], axis=0)
            removed = removal.of(without)
            if removed.loss <= allowed:
                now, gone, left = removed, without, [e for e in left if e not in group]
        while left:
            costs = [removal.expected(gone | own[e]) for e in left]
            tried = {left[i]: removal.of(gone | own[left[i]]) for i in np.argsort(costs)[:TRIED]}
            least = min(tried, key=lambda e: tried[e].loss)
            if tried[least].loss > allowed:
                break
            now = tried[least]
            gone |= own[least]
            left.remove(least)
        return cls(now.cube, {e: removal.of(gone | own[e]).loss / now.loss - 1.0 for e in left})


def _groups(effects: tuple[str, ...]) -> list[list[str]]:
    """Effects that are tried together first: all of them, and errors of one kind in all sensors.

    What the drive explains as well is one fault of the drive, not one of each sensor.
    """
    kinds = sorted({effect.partition("/")[2] for effect in effects})
    sensors = [[e for e in effects if e.startswith("sensor_") and e.endswith(f"/{kind}")] for kind in kinds]
    return [list(effects), *(group for group in sensors if len(group) > 1)]


@dataclass(frozen=True)
class _Removed:
    """A fit without some of its effects.

    Attributes:
        cube: Position, shape (D,).
        loss: There.
    """

    cube: np.ndarray
    loss: float


@dataclass(frozen=True)
class _Removal:
    """What a fit loses with some of its numbers neutral.

    Attributes:
        problem: The loss.
        cube: The fit, shape (D,).
        residuals: There, shape (N,).
        jacobian: Their slopes, shape (N, D).
    """

    problem: ToolboxProblem
    cube: np.ndarray
    residuals: np.ndarray
    jacobian: np.ndarray

    def refitted(self, gone: np.ndarray, cube: np.ndarray, residuals: np.ndarray) -> np.ndarray:
        """The others after a Gauss-Newton step from a position (D,) with residuals (N,), shape (D,)."""
        moved = np.where(gone, self.problem.space.neutral, cube)
        after = residuals + self.jacobian @ (moved - cube)
        step, *_ = np.linalg.lstsq(self.jacobian[:, ~gone], after, rcond=1e-6)
        moved[~gone] = np.clip(moved[~gone] - step, 0.0, 1.0)
        return moved

    def expected(self, gone: np.ndarray) -> float:
        """Squared residuals after one step, if everything were linear."""
        moved = self.refitted(gone, self.cube, self.residuals)
        return float(np.sum((self.residuals + self.jacobian @ (moved - self.cube)) ** 2))

    def of(self, gone: np.ndarray) -> _Removed:
        """The best of the others as they were and after each of `STEPS` steps along the fit's slopes."""
        cubes = [np.where(gone, self.problem.space.neutral, self.cube), self.refitted(gone, self.cube, self.residuals)]
        while len(cubes) <= STEPS:
            cubes.append(self.refitted(gone, cubes[-1], self.problem.residuals(cubes[-1])))
        losses = self.problem.losses(np.stack(cubes))
        best = int(np.argmin(losses))
        return _Removed(cubes[best], float(losses[best]))
