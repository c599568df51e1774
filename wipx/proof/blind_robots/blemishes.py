"""What the log alone does to the readings of a run: late rates, repeated rows, outliers."""

from dataclasses import dataclass, replace

import numpy as np

from wipx.core.plant import PLANTS
from wipx.proof.blind_robots.logging import PLACES, Run


@dataclass(frozen=True)
class Blemishes:
    """Faults of a log.

    Attributes:
        smoothing: Time constant of the filter of recorded rates [s]; 0 for none.
        late: Delay of recorded rates [s].
        repeated: Share of rows whose readings are those of the row before.
        outliers: Share of readings of a coordinate that are far off.
        outlier_size: Typical size of an outlier, in standard deviations of the coordinate.
    """

    smoothing: float = 0.0
    late: float = 0.0
    repeated: float = 0.0
    outliers: float = 0.0
    outlier_size: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """What there is, in words."""
        there = {
            "late rates": self.smoothing > 0.0,
            "repeated rows": self.repeated > 0.0,
            "glitches": self.outliers > 0.0,
        }
        return tuple(name for name, has in there.items() if has)


def draw_blemishes(rng: np.random.Generator) -> Blemishes:
    """Faults of a log, each of them in some logs only."""
    late, repeated, outliers = rng.random(3)
    return Blemishes(
        smoothing=rng.uniform(0.005, 0.02) if late < 0.7 else 0.0,
        late=rng.uniform(0.0, 0.02) if late < 0.7 else 0.0,
        repeated=rng.uniform(0.002, 0.03) if repeated < 0.3 else 0.0,
        outliers=rng.uniform(2e-4, 2e-3) if outliers < 0.3 else 0.0,
        outlier_size=rng.uniform(0.1, 1.0),
    )


def blemished(run: Run, kind: str, blemishes: Blemishes, rng: np.random.Generator) -> Run:
    """The run as a log with faults has it; time and commands are right."""
    columns = dict(run.columns)
    t, names = columns["t"], PLANTS[kind].coordinates
    readings = [name for name in (*names, *(f"{name}_dot" for name in names)) if name in columns]
    for name in names:
        rate = f"{name}_dot"
        if rate in columns and blemishes.smoothing > 0.0:
            smooth = _low_pass(columns[rate], t, blemishes.smoothing)
            columns[rate] = np.round(np.interp(t - blemishes.late, t, smooth), PLACES)
    for name in names:
        hit = rng.random(len(t)) < blemishes.outliers
        far = blemishes.outlier_size * np.std(columns[name]) * rng.uniform(0.5, 1.5, len(t))
        columns[name] = np.round(columns[name] + hit * far * rng.choice([-1.0, 1.0], len(t)), PLACES)
    again = rng.random(len(t)) < blemishes.repeated
    source = np.maximum.accumulate(np.where(again, 0, np.arange(len(t))))
    for name in readings:
        columns[name] = columns[name][source]
    return replace(run, columns=columns)


def _low_pass(values: np.ndarray, t: np.ndarray, time: float) -> np.ndarray:
    """First-order filter with a time constant [s] over uneven rows."""
    smooth = values.copy()
    keep = np.exp(-np.diff(t) / time)
    for row in range(1, len(values)):
        middle = 0.5 * (values[row - 1] + values[row])
        smooth[row] = keep[row - 1] * smooth[row - 1] + (1.0 - keep[row - 1]) * middle
    return smooth
