"""What an identification leaves: the type that tasks write and reports read."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

HORIZON = 0.5  # [s] of predictions, contract section 4
NINETY_FIVE = 1.96  # standard deviations of a Gaussian, to either side, that hold 95 %


@dataclass(frozen=True)
class Estimate:
    """An identified number.

    Attributes:
        name: "site/kind.symbol" or a plant parameter.
        unit: SI unit.
        nominal: Value before the identification; the neutral value for an effect that was switched on.
        value: Identified value.
        low: Lower end of the 95 % interval.
        high: Upper end.
        at_bound: Whether the search stopped at its lower or upper bound.
        meaning: What it is, in words.
        from_run_to_run: Least and largest value that single recordings ask for; None where one value suits all.
    """

    name: str
    unit: str
    nominal: float
    value: float
    low: float
    high: float
    at_bound: bool
    meaning: str
    from_run_to_run: tuple[float, float] | None = None


@dataclass(frozen=True)
class FitErrors:
    """Prediction errors over windows, root mean square by recorded column.

    Attributes:
        horizon: Length of a window [s].
        windows: How many there were.
        nominal: Error of the nominal model [unit of the column].
        completed: Error of the completed model.
        noise_floor: Error that a perfect model would have, from the sensor noise.
    """

    horizon: float
    windows: int
    nominal: Mapping[str, float]
    completed: Mapping[str, float]
    noise_floor: Mapping[str, float]

    @property
    def explained_share(self) -> float:
        """Share of the explainable squared error that the completed model removes."""
        removed = total = 0.0
        for name, floor in self.noise_floor.items():
            scale = max(floor, 1e-12) ** 2
            total += max(self.nominal[name] ** 2 - floor**2, 0.0) / scale
            removed += max(self.nominal[name] ** 2 - max(self.completed[name] ** 2, floor**2), 0.0) / scale
        return removed / total if total > 0.0 else 0.0

    @property
    def times_the_floor(self) -> float:
        """The largest error of the completed model over its noise floor."""
        return max(self.completed[name] / max(floor, 1e-15) for name, floor in self.noise_floor.items())


@dataclass(frozen=True)
class Trace:
    """One recording beside its predictions; NaN where nothing was predicted.

    Attributes:
        name: Of the recording.
        held_out: Whether the identification never saw it.
        t: Time, shape (rows,) [s].
        command: Commands by column [SI].
        recorded: Recorded coordinates by column.
        nominal: Predicted by the nominal model, restarted at every window.
        completed: Predicted by the completed model, likewise.
        starts: Times at which the predictions were restarted [s].
    """

    name: str
    held_out: bool
    t: np.ndarray
    command: Mapping[str, np.ndarray]
    recorded: Mapping[str, np.ndarray]
    nominal: Mapping[str, np.ndarray]
    completed: Mapping[str, np.ndarray]
    starts: np.ndarray


@dataclass(frozen=True)
class SearchHistory:
    """How an optimizer came to its result, one entry per improvement or iteration.

    Attributes:
        optimizer: Its name.
        evaluations: Loss evaluations so far.
        seconds: Time so far [s].
        best_loss: Lowest loss so far.
        stopped: Why it stopped, e.g. "converged", "budget of 2000 evaluations", "interrupted".
    """

    optimizer: str
    evaluations: np.ndarray
    seconds: np.ndarray
    best_loss: np.ndarray
    stopped: str


@dataclass(frozen=True)
class IdentificationResult:
    """Everything a person wants to see of an identification.

    Attributes:
        title: Of the page, e.g. the dataset's name.
        plant: Kind of plant.
        source: Folder of the recordings.
        split: How recordings were divided into fit and held-out.
        objective: What was minimised, in words.
        units: SI unit by recorded column.
        nominal: Rows (name, value, unit) of the nominal model.
        effects: Rows (name, law, source) of the effects of the completed model.
        estimates: Identified numbers.
        fit: Errors on the recordings that were fitted.
        held_out: Errors on the others; None where there are none.
        history: Course of the search.
        traces: Recordings beside predictions.
        notes: Warnings a reader must know, one sentence each.
    """

    title: str
    plant: str
    source: str
    split: str
    objective: str
    units: Mapping[str, str]
    nominal: tuple[tuple[str, float, str], ...]
    effects: tuple[tuple[str, str, str], ...]
    estimates: tuple[Estimate, ...]
    fit: FitErrors
    held_out: FitErrors | None
    history: SearchHistory
    traces: tuple[Trace, ...]
    notes: tuple[str, ...] = ()
