"""What the whole chain leaves: from recordings that disagree with a simulation to a robot that balances its load."""

from collections.abc import Mapping
from dataclasses import dataclass

from wipx.core.control_result import ControlResult
from wipx.core.estimation import EstimationResult
from wipx.core.model import Model


@dataclass(frozen=True)
class NamedEffect:
    """An effect that a diagnosis named.

    Attributes:
        name: As "site/kind".
        values: Parameters with the ends of their 95 % intervals, by name [SI].
        units: Of the parameters.
    """

    name: str
    values: Mapping[str, tuple[float, float, float]]
    units: Mapping[str, str]


@dataclass(frozen=True)
class SignalError:
    """Root mean square prediction error of a signal on recordings that no fit saw, in the column's unit.

    Attributes:
        column: The signal.
        nominal: Of the nominal model.
        completed: Of the completed one.
        noise_floor: That a perfect model would have.
    """

    column: str
    nominal: float
    completed: float
    noise_floor: float


@dataclass(frozen=True)
class Story:
    """The chain on one robot.

    Attributes:
        target: Kind of robot: emulated or real hardware.
        plant: Its kind of mechanism.
        recordings: Of the robot without load.
        held_out: How many of them no fit saw.
        duration: Of each [s].
        verdict: Of the diagnosis; see contract section 5.
        effects: That the diagnosis named.
        horizon: Of the predictions [s].
        errors: One for each signal.
        hidden: The robot as it really is, where it is emulated; opened when all was done.
        hidden_signals: Errors of its sensors and its loop, by name.
        before: The estimator that was trained in the nominal simulation.
        after: The one that was trained in the completed simulation.
        control: Baseline and ours, by scenario.
    """

    target: str
    plant: str
    recordings: int
    held_out: int
    duration: float
    verdict: str
    effects: tuple[NamedEffect, ...]
    horizon: float
    errors: tuple[SignalError, ...]
    hidden: Model | None
    hidden_signals: Mapping[str, object]
    before: EstimationResult
    after: EstimationResult
    control: Mapping[str, tuple[ControlResult, ControlResult]]
