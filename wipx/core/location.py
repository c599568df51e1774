"""Where the mismatch between a nominal model and recordings is."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Region:
    """An interval of a signal that holds much of the mismatch.

    Attributes:
        signal: Column, rate or command.
        low: Lower end [SI].
        high: Upper end.
        share: Of the excess error that lies inside.
    """

    signal: str
    low: float
    high: float
    share: float


@dataclass(frozen=True)
class Period:
    """A stretch of time that holds much of the mismatch of a recording.

    Attributes:
        recording: Its name.
        low: Begin [s].
        high: End [s].
        share: Of that recording's excess error that lies inside.
    """

    recording: str
    low: float
    high: float
    share: float


@dataclass(frozen=True)
class ErrorMap:
    """Where the nominal model is wrong: excess of its squared innovations over what the completed model leaves.

    Attributes:
        signals: Names of abscissa and ordinate.
        units: Their units.
        edges: Bin edges of both, shapes (A + 1,) and (B + 1,).
        excess: Mean excess per row and bin, shape (A, B) [nats]; NaN where the robot never was.
        runs: Names of the recordings.
        times: Middle of the time bins of each recording [s].
        along: Mean excess per row in these bins, one array per recording [nats].
    """

    signals: tuple[str, str]
    units: tuple[str, str]
    edges: tuple[np.ndarray, np.ndarray]
    excess: np.ndarray
    runs: tuple[str, ...]
    times: tuple[np.ndarray, ...]
    along: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class Location:
    """Where the mismatch is.

    Attributes:
        sites: Share by site; they sum to one, empty where nothing is missing.
        regions: Intervals of the state space.
        times: Stretches of time.
        map: For the picture; None where nothing is missing.
    """

    sites: Mapping[str, float]
    regions: tuple[Region, ...]
    times: tuple[Period, ...]
    map: ErrorMap | None
