"""What the classical estimators see: robots to learn from, windows that are checked, and the samples that count."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.errors import InputError
from wipx.learn.conformal import rank
from wipx.learn.dataset import FALLEN
from wipx.learn.estimator import COVERAGE, check_windows
from wipx.learn.training_set import TrainingSet

PLACED = 1e-3  # [m, rad] to which a robot is placed at least
FEWEST = 10  # robots, whose loads give a mean and a covariance of three numbers


@dataclass(frozen=True)
class Viewing:
    """How robots are watched.

    Attributes:
        length: Samples of a window, L.
        period: Time between them [s].
        limits: Position and pitch at which a robot stops; a window holds its last place from then on [m, rad].
        release: Standard deviations of position and pitch at which it was released, at rest [m, rad].
    """

    length: int
    period: float
    limits: tuple[float, float]
    release: tuple[float, float]

    @classmethod
    def of(cls, training: TrainingSet) -> "Viewing":
        """How the robots of a training set were watched.

        Raises:
            InputError: its card does not say where the rail ends and how robots were released, or a window is not
                finite.
        """
        rail, lean = _size(training.card, "rail", "m"), _size(training.card, "lean", "rad")
        release = (PLACED, max(lean / np.sqrt(3.0), PLACED))  # a lean is drawn uniformly
        viewing = cls(training.windows.shape[1], training.period, (rail, FALLEN), release)
        check_windows(training.windows, viewing.length, viewing.period)
        return viewing

    def moving(self, windows: np.ndarray) -> np.ndarray:
        """Which samples show a moving robot, not the last place of one that was stopped, shape (N, L).

        Where a robot was stopped is not in the window: its last place lies within the limits, by up to the way of one
        sample. A robot may have been stopped once twice the longest way of one sample so far would take it beyond
        them; twice, since it may be accelerating.
        """
        places = np.abs(windows)
        ways = np.abs(np.diff(windows, axis=1, prepend=windows[:, :1]))
        near = np.any(places + 2.0 * np.maximum.accumulate(ways, axis=1) >= self.limits, axis=2)
        before = np.concatenate([np.zeros((len(windows), 1), dtype=bool), near[:, :-1]], axis=1)
        return ~np.logical_or.accumulate(before, axis=1)


@dataclass(frozen=True)
class Parts:
    """Robots to learn from, and others on which the interval is calibrated.

    Attributes:
        train: The training part.
        validation: The whole validation part: nothing else is decided on it.
    """

    train: TrainingSet
    validation: TrainingSet

    @classmethod
    def of(cls, training: TrainingSet) -> "Parts":
        """The two parts of a training set.

        Raises:
            InputError: either has too few robots.
        """
        parts = cls(training.of("train"), training.of("validation"))
        if len(parts.train.pitch) < FEWEST:
            raise InputError(
                f"estimator: the training set has {len(parts.train.pitch)} robots to learn from, "
                f"expected {FEWEST} or more; make a larger one"
            )
        rank(len(parts.validation.pitch), COVERAGE)  # refuses now what would fail in the end
        return parts


def _size(card: Mapping[str, object], name: str, unit: str) -> float:
    size = card.get(name)
    if not isinstance(size, int | float):
        raise InputError(f"estimator: the card of the training set has no {name} [{unit}]; make the training set again")
    return float(size)
