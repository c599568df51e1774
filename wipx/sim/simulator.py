"""The contract of every simulator: models and inputs in, rollouts out.

A rollout is one model on one window of inputs. `wipx.sim.analytic` takes thousands at once;
engines that are stepped one world at a time keep the same contract (`wipx.sim.stepped`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.sim.inputs import Inputs


@dataclass(frozen=True)
class Rollouts:
    """What P models did on R windows.

    Attributes:
        coordinates: As the sensors show them, shape (K + 1, joints, P, R) [m, rad].
        rates: True rates, shape (K + 1, joints, P, R) [m/s, rad/s].
        commands: Commands of each row, shape (K, inputs, P, R) (R only open loop: (K, inputs, 1, R)).
        delivered: Mean force of the drives over each row, before what they cannot know (ripple, backlash, elasticity),
            shape (K, inputs, P, R) [N or N m]; None where it was not asked for.
        carried: What joints carry from step to step at some rows (`wipx.sim.rows`), shape (N, STATES, P, W), each an
            observer's row; None where none was asked for.
    """

    coordinates: np.ndarray
    rates: np.ndarray
    commands: np.ndarray
    delivered: np.ndarray | None = None
    carried: np.ndarray | None = None


@dataclass(frozen=True)
class StateFeedback:
    """u = -K (y - y_ref), y = [coordinates, rates] as measured, limited to +-`limit`.

    Attributes:
        gains: Shape (inputs, 2 joints) [N or N m per unit].
        rate_filter: Time constant of the low-pass on differenced coordinates [s]; None where
            the rates themselves are measured.
        limit: Largest command [N or N m].
    """

    gains: np.ndarray
    rate_filter: float | None = None
    limit: float = np.inf


@dataclass(frozen=True)
class Path:
    """What rollouts have gone through before they are left to themselves: friction, lags and delays have settled.

    Attributes:
        states: True coordinates, then rates, shape (rows, 2 joints, P or 1, R) [m, rad, m/s, rad/s]; no rows where
            rollouts are left to themselves from the start.
        until: Last row of each window at which its state is put on the path, shape (R,).
        carried: What joints carry from earlier steps to the first integrated row, shape (N, STATES, P, R); None where
            they begin there.
    """

    states: np.ndarray
    until: np.ndarray
    carried: np.ndarray | None = None

    @classmethod
    def behind(cls, carried: np.ndarray) -> "Path":
        """That of rollouts which are left to themselves from the start, by what joints carry to there."""
        joints, _, _, windows = carried.shape
        return cls(np.zeros((0, 2 * joints, 1, windows)), np.full(windows, -1), carried)


class Simulator(Protocol):
    """An engine with the effects of `wipx.effects` around it."""

    @property
    def step(self) -> float:
        """Longest step of the integrator [s]; rows further apart are divided evenly."""
        ...

    @property
    def smoothing(self) -> tuple[float, ...]:
        """Speed over which the dry friction of each joint builds up [m/s, rad/s]; empty for true sticking."""
        ...

    def replay(self, batch: ModelBatch, inputs: Inputs, initial: np.ndarray, path: Path | None = None) -> Rollouts:
        """Open loop: the recorded commands act on every model.

        Args:
            batch: P models.
            inputs: R windows.
            initial: True coordinates, then rates, at each window's first integrated row,
                shape (2 joints, P, R) [m, rad, m/s, rad/s].
            path: Where the rollouts are led at first; None where they are left to themselves from the start.

        Raises:
            InputError: the engine cannot do an effect of the models.
        """
        ...

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

        Raises:
            InputError: as in `replay`.
        """
        ...

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

        Raises:
            InputError: as in `replay`.
        """
        ...

    def smoothed(self, speeds: tuple[float, ...]) -> "Simulator":
        """The same engine with dry friction that builds up over these `speeds` of the joints [m/s, rad/s].

        Only searches use it, on their way to true sticking.
        """
        ...
