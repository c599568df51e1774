"""How far closed loops are from instability, and which loads they recover from: types that reports read."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Margins:
    """Of a loop that is broken at its command.

    Attributes:
        gain_low: Factor on the command below which the loop is not stable; 0 where there is none.
        gain_high: Factor above which it is not stable; infinite where there is none.
        phase: Phase lag or lead that the loop bears [rad].
        delay: Further delay of the command that it bears [s]; infinite where it bears any.
        inner: Whether the loop is an inner one, about a balance that is held, of a controller that moves it.
    """

    gain_low: float
    gain_high: float
    phase: float
    delay: float
    inner: bool = False


@dataclass(frozen=True)
class Recovery:
    """Releases of one controller's robot under a grid of loads.

    Attributes:
        recovered: Whether it stayed on its rail, did not fall and was calm in the end, shape (masses, pitches).
        farthest: Largest distance from the reference position, up to where it was stopped, shape alike [m].
        standing: Mean distance from it in the end; NaN where the robot did not recover, shape alike [m].
    """

    recovered: np.ndarray
    farthest: np.ndarray
    standing: np.ndarray

    @property
    def share(self) -> float:
        """Share of the grid's loads from which it recovered."""
        return float(np.mean(self.recovered))


@dataclass(frozen=True)
class RecoveryRegion:
    """Loads from which the robot recovers, for each controller.

    Attributes:
        masses: Of the loads, shape (masses,) [kg].
        pitches: At which the loaded robot balances, shape (pitches,) [rad].
        height: Of the loads above the wheel axis [m].
        rail: Half its length [m].
        duration: After the release [s].
        controllers: What each did, by name.
    """

    masses: np.ndarray
    pitches: np.ndarray
    height: float
    rail: float
    duration: float
    controllers: Mapping[str, Recovery]

    @property
    def loads(self) -> int:
        """How many loads there are."""
        return len(self.masses) * len(self.pitches)
