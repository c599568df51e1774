"""The pitch at which a simulated robot really balances, found by letting it fall.

The paper measures it on the robot in the same way, as the angle at which the robot "can stabilize itself without
controller intervention". Nothing here reads where a model says that it balances.
"""

from dataclasses import dataclass

import numpy as np

from wipx.core.model import ModelBatch
from wipx.learn.loads import some_of
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Simulator

REACH = 0.8  # [rad] to either side of upright in which the balance is looked for
FALLING = 0.05  # [rad] of motion from which a robot has begun to fall; a bristle of dry friction yields far less
PATIENCE = 3.0  # [s]; a robot that is 1e-7 rad off its balance has fallen by FALLING after 2.7 s (at 5 1/s)
HALVINGS = 23  # of that interval: to 1e-7 rad on either side
RATE = 50.0  # [Hz] of the rows at which it is looked at


@dataclass(frozen=True)
class Balance:
    """Pitches from which robots that are released at rest, without command, do not fall.

    Attributes:
        low: Lowest of each, shape (N,) [rad]; below it the robot falls to negative pitch.
        high: Highest, shape (N,); without dry friction the same.
    """

    low: np.ndarray
    high: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Shape (N,) [rad]."""
        return 0.5 * (self.low + self.high)

    @property
    def dead_band(self) -> np.ndarray:
        """By how much friction lets a robot stay off its balance, shape (N,) [rad]."""
        return 0.5 * (self.high - self.low)

    def misses(self, pitch: np.ndarray) -> np.ndarray:
        """By how much pitches lie outside of these intervals, shape (N,) [rad]."""
        return np.maximum(0.0, np.maximum(self.low - pitch, pitch - self.high))


def balance_of(robots: ModelBatch, simulator: Simulator) -> Balance:
    """Where simulated robots balance, as the sensors show it, by bisection of where they fall to.

    Args:
        robots: N robots with a carriage and a pitch.
        simulator: The engine.
    """
    twice = some_of(robots, np.repeat(np.arange(robots.size), 2))
    wants_low = np.arange(2 * robots.size) % 2 == 0  # of each pair the first looks for the lower end
    below, above = np.full(len(wants_low), -REACH), np.full(len(wants_low), REACH)
    for _ in range(HALVINGS):
        tried = 0.5 * (below + above)
        fall = _fall(twice, tried, simulator)
        higher = np.where(wants_low, fall < 0, fall <= 0)  # than what was tried lies the end
        below, above = np.where(higher, tried, below), np.where(higher, above, tried)
    ends = 0.5 * (below + above)
    return Balance(ends[wants_low], ends[~wants_low])


def _fall(robots: ModelBatch, pitch: np.ndarray, simulator: Simulator) -> np.ndarray:
    """Direction in which each robot falls from rest at a pitch: -1, 1, or 0 where it stays, shape (N,)."""
    plant = robots.model.plant
    at = plant.coordinates.index("theta")
    initial = np.zeros((2 * len(plant.coordinates), len(pitch), 1))
    initial[at, :, 0] = pitch
    run = simulator.replay(robots, Inputs.regular(PATIENCE, RATE, len(plant.commands)), initial)
    moved = run.coordinates[:, at, :, 0] - run.coordinates[0, at, :, 0]
    falling = np.abs(moved) > FALLING
    first = falling.argmax(axis=0)
    return np.sign(np.take_along_axis(moved, first[None], axis=0)[0]) * falling.any(axis=0)
