"""What the named effects of a diagnosis leave over, and what it looks like."""

from collections.abc import Mapping
from dataclasses import dataclass

from wipx.core.curve import Curve


@dataclass(frozen=True)
class Unexplained:
    """What the named effects leave over.

    Attributes:
        significant: Whether something is.
        p_value: Of the strongest residual force if nothing were left, corrected for the number of tests.
        site: Joint at which it acts; None where nothing is significant.
        shape: What it looks like, in words, e.g. "a force over x_dot"; empty where nothing is significant.
        resembles: Effects beyond the vocabulary that would explain it.
        curve: The nonparametric force that was fitted in its place; None without one.
    """

    significant: bool
    p_value: float
    site: str | None
    shape: str
    resembles: tuple[str, ...]
    curve: Curve | None


@dataclass(frozen=True)
class LeftForce:
    """The force on a joint that the completed model lacks.

    Attributes:
        site: The joint.
        size: Root mean square [unit].
        unit: "N" or "N m".
        lasting: Time in which its correlation with itself falls to 1/e [s].
        kind: What it is like: "law" over a signal, "periodic" in a coordinate, "swing" at a frequency, "gain" of a
            command that drifts, or "random".
        signal: Of which; None for a random force.
        period: In the signal's unit, of a periodic force or a swing; None for others.
        share: Of its variance that goes with the signal, on stretches of time that it was not fitted to.
    """

    site: str
    size: float
    unit: str
    lasting: float
    kind: str
    signal: str | None
    period: float | None
    share: float


@dataclass(frozen=True)
class HorizonErrors:
    """Errors of predictions some time after their start, on held-out recordings.

    Attributes:
        horizon: That time [s].
        nominal: Root mean square errors of the nominal model by column.
        completed: Those of the completed model.
    """

    horizon: float
    nominal: Mapping[str, float]
    completed: Mapping[str, float]


@dataclass(frozen=True)
class Remainder:
    """How much of the mismatch the completed model leaves, and what it looks like.

    Attributes:
        share_gone: Share of the squared prediction error above the sensors' floor that is gone, on held-out recordings.
        times_floor: Error that stays as a multiple of the sensors' floor, by column.
        matters: Whether it matters for predictions of half a second.
        horizons: Errors by time since the start of a prediction.
        forces: On each joint.
    """

    share_gone: float
    times_floor: Mapping[str, float]
    matters: bool
    horizons: tuple[HorizonErrors, ...]
    forces: tuple[LeftForce, ...]
