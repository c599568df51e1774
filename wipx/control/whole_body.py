"""Linear quadratic regulator of a whole robot from a model file, about the posture in which it balances.

With an estimator of the payload it moves to the posture in which the loaded robot balances, by the paper's soft update
(Eq. 9), and its gains are those of the loaded robot from then on.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.control.cost import optimal_gains
from wipx.control.hand_payload import EstimatedPayload, HandPayload
from wipx.control.linearise import linearise_about
from wipx.control.posture_balance import Balance, balance
from wipx.control.soft_update import SoftUpdate
from wipx.core.errors import check_positive
from wipx.core.model import Model


@dataclass(frozen=True)
class WholeBodyLqr:
    """Settings; the cost weighs each state by the deviation that is tolerable in it (Bryson's rule).

    Attributes:
        slide: Tolerable deviation of a slide [m].
        hinge: Of a hinge [rad].
        slide_rate: Of the rate of a slide [m/s].
        hinge_rate: Of the rate of a hinge [rad/s].
        effort: Tolerable force of a drive, as a share of its largest; 1 N m or 1 N where the model file gives no limit.
        rate: Of the controller [Hz].
        rate_filter: Time constant of the low-pass on differenced positions [s].
        alpha: Of Eq. 9, by which the change of posture is smoothed, per 1/650 s.
        beta: Of Eq. 9, share of the change of posture per second [1/s].
    """

    slide: float = 0.3
    hinge: float = 0.1
    slide_rate: float = 1.0
    hinge_rate: float = 1.0
    effort: float = 0.2
    rate: float = 500.0
    rate_filter: float = 0.005
    alpha: float = 0.05
    beta: float = 1.0

    def __post_init__(self) -> None:
        check_positive(slide=self.slide, hinge=self.hinge, slide_rate=self.slide_rate, hinge_rate=self.hinge_rate)
        check_positive(effort=self.effort, rate=self.rate, rate_filter=self.rate_filter)
        SoftUpdate(self.alpha, self.beta)

    def gains(self, model: Model, about: Balance) -> np.ndarray:
        """Gains K of u = u_eq - K (y - y_eq), y = [positions, rates], shape (inputs, 2 joints).

        Raises:
            InputError: no gains stabilise the robot.
        """
        linear = linearise_about(model, about.positions)
        slides = [joint in model.plant.sliding for joint in model.plant.joints]
        tolerable = np.concatenate(
            [np.where(slides, self.slide, self.hinge), np.where(slides, self.slide_rate, self.hinge_rate)]
        )
        efforts = largest_commands(model)
        allowed = self.effort * np.where(np.isfinite(efforts), efforts, 1.0 / self.effort)
        return optimal_gains(linear.a, linear.b, np.diag(tolerable**-2.0), np.diag(allowed**-2.0))


def largest_commands(model: Model) -> np.ndarray:
    """Commands at which the drives give their largest force, shape (inputs,); infinite where there is no limit."""
    tree = model.plant.tree
    assert tree is not None
    efforts = {link.joint: np.inf if link.effort is None else link.effort for link in tree.links}
    return np.array([efforts[joint] / abs(model.parameters[f"{joint}.gain"]) for joint in model.plant.actuated])


class WholeBodyLoop:
    """u = u_eq - K (y - y_eq - y_ref), limited, on positions as measured and their filtered differences.

    Attributes:
        found: What the estimator found of the payload; None before, and where there is no estimator.
    """

    found: EstimatedPayload | None

    def __init__(
        self, settings: WholeBodyLqr, model: Model, posture: Mapping[str, float], estimator: HandPayload | None = None
    ) -> None:
        """A loop for a robot without payload.

        Args:
            settings: Cost and rate.
            model: The robot as its owner knows it.
            posture: Positions that driven joints hold [rad or m]; see `balance`.
            estimator: Of the payload; without one the loop keeps to the balance of `model`.

        Raises:
            InputError: the robot balances nowhere with the posture, or no gains stabilise it.
        """
        self._settings, self._model, self._posture, self._estimator = settings, model, posture, estimator
        self.nominal = balance(model, posture)
        self._gains = settings.gains(model, self.nominal)
        self._target, self._limits = self.nominal, largest_commands(model)
        self._soft = SoftUpdate(settings.alpha, settings.beta)
        self._seen: list[np.ndarray] = []
        self._rates = np.zeros(len(self.nominal.positions))
        self.found = None

    def step(self, positions: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Commands of one period, shape (inputs,).

        Args:
            positions: As measured, shape (joints,) [rad or m].
            reference: Added to the equilibrium: positions, then rates, shape (2 joints,).
        """
        period = 1.0 / self._settings.rate
        if self._seen:
            share = 1.0 - np.exp(-period / self._settings.rate_filter)
            self._rates = self._rates + share * ((positions - self._seen[-1]) / period - self._rates)
        self._seen.append(positions)
        if self._estimator is not None and self.found is None:
            self._estimate(self._estimator)
        self._soft.advance(0.0 if self.found is None else 1.0, period)
        share, begin, end = self._soft.smooth, self.nominal, self._target
        at = begin.positions + share * (end.positions - begin.positions)
        force = begin.commands + share * (end.commands - begin.commands)
        error = np.concatenate([positions - at, self._rates]) - reference
        return np.clip(force - self._gains @ error, -self._limits, self._limits)

    @property
    def rate(self) -> float:
        """Steps per second [Hz]."""
        return self._settings.rate

    @property
    def target(self) -> Balance:
        """The equilibrium to which it moves."""
        return self._target

    def _estimate(self, estimator: HandPayload) -> None:
        """Once the window is full, look for the payload and for the balance with it."""
        if len(self._seen) < round(estimator.window * self._settings.rate):
            return
        self.found = estimator.estimate(self._model, np.array(self._seen), 1.0 / self._settings.rate)
        loaded = estimator.loaded(self._model, self.found.mass)
        self._target = balance(loaded, self._posture)
        self._gains = self._settings.gains(loaded, self._target)
