"""The paper's controller: a regulator whose pitch reference moves to where the robot balances (Eq. 9).

Where that is tells an estimator that watches the robot from its release on. At the new balance the wheels carry no
force: the command that belongs to the reference is zero, and the position is held at its own reference.
"""

import logging
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from wipx.control.balance_watch import BalanceWatch, check_carriage
from wipx.control.controller import PitchEstimator, needed
from wipx.control.ekf import Ekf
from wipx.control.lqr import LqrDesign
from wipx.control.regulator import Regulator
from wipx.control.release_window import ReleaseWindow
from wipx.control.sampled import check_stabilises
from wipx.control.soft_update import SoftUpdate
from wipx.core.errors import check_positive
from wipx.core.model import Model
from wipx.sim.simulator import StateFeedback

LOG = logging.getLogger(__name__)
SLACK = 1e-9  # [s] by which a reading may come before the time it stands for


@dataclass(frozen=True)
class EquilibriumLqr(LqrDesign):
    """Linear quadratic regulator about the balance that an estimator finds.

    Attributes:
        alpha: Of Eq. 9, by which the reference is smoothed, per 1/650 s.
        beta: Of Eq. 9, speed of the reference [rad/s].
        widest: Interval beyond which an estimate is not trusted and the reference is held [rad].
        adaptive: Time over which the balance is estimated anew, continuously, once there is a first estimate [s]; by
            `BalanceWatch`, since estimators know windows from the release on only. None: the first estimate stays.
    """

    asks_estimator: ClassVar[bool] = True

    alpha: float = 0.05
    beta: float = 0.1
    widest: float = 0.1
    adaptive: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_positive(widest=self.widest)
        SoftUpdate(self.alpha, self.beta)
        if self.adaptive is not None:
            check_positive(adaptive=self.adaptive)

    @property
    def moves_balance(self) -> bool:
        """It moves its pitch reference."""
        return True

    def loop(self, model: Model, estimator: PitchEstimator | None = None) -> "EquilibriumRegulator":
        """The gains for a model's rigid body, on a state estimated with the whole model.

        Args:
            model: The robot without load.
            estimator: Of the equilibrium pitch; asked once per trial, when its window is full.

        Raises:
            InputError: the robot is no body on a carriage, its gains do not stabilise it, or there is no estimator.
        """
        check_carriage(model)
        check_stabilises(self.law(model), model, self.rate)
        return EquilibriumRegulator(self.estimator(model), self.feedback(model), self, needed(estimator))


class EquilibriumRegulator(Regulator):
    """u = -K (y - y_ref - [0, theta_sm, 0, 0]); theta_sm is that of Eq. 9.

    Attributes:
        balance: Pitch towards which the reference moves [rad].
        notes: What was decided during this trial, one line each.
    """

    balance: float

    def __init__(
        self, estimator: Ekf, feedback: StateFeedback, settings: EquilibriumLqr, balance_estimator: PitchEstimator
    ) -> None:
        super().__init__(estimator, feedback, settings.rate)
        self._settings = settings
        self._balance_estimator = balance_estimator
        self._window = ReleaseWindow(balance_estimator.length, balance_estimator.period)
        self._soft = SoftUpdate(settings.alpha, settings.beta)
        self._watch = None if settings.adaptive is None else BalanceWatch(estimator.model, settings.adaptive)
        self._forget(0.0)

    def reset(self, t: float, measured: np.ndarray) -> None:
        """Forget the past; the robot is released now. See `Loop.reset`."""
        super().reset(t, measured)
        self._forget(t)

    @property
    def pitch_reference(self) -> float:
        """The smoothed reference theta_sm [rad]."""
        return self._soft.smooth

    def wanted(self, t: float, state: np.ndarray, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        """Commands before their limit; see `FilteredLoop.wanted`."""
        if not self._asked:
            self._collect(t, measured)
        if self._watch is not None:
            self._watch.see(t, state)
            if self._trusted and self._watch.pitch is not None:
                self.balance = self._watch.pitch
        self._soft.advance(self.balance, t - self._t)
        self._t = t
        about = reference + np.array([0.0, self._soft.smooth, 0.0, 0.0])
        return super().wanted(t, state, measured, about)

    def _collect(self, t: float, measured: np.ndarray) -> None:
        """Keep what the sensors show; the training of estimators shows them the same, and no filter's state."""
        self._window.see(t, measured)
        window = self._balance_estimator
        if t - self._released >= (window.length - 1) * window.period - SLACK:
            self._asked = True
            self._ask(t)

    def _ask(self, t: float) -> None:
        """Ask the estimator, and say what came of it."""
        samples = self._window.samples()
        if samples is None:
            self._hold(f"t = {t:.3f} s: a sensor showed nothing yet")
            return
        found = self._balance_estimator.estimate(samples[None])
        pitch, low, high = (float(values[0]) for values in (found.pitch, found.low, found.high))
        said = f"t = {t:.3f} s: equilibrium pitch {pitch:+.4f} rad, 90 % interval {low:+.4f} to {high:+.4f}"
        # Comparisons with NaN are false: an estimate that is none is not trusted.
        self._trusted = bool(high - low <= self._settings.widest and low <= pitch <= high)
        if self._trusted:
            self.balance = pitch
            self.notes += (said,)
        else:
            self._hold(f"{said}: wider than {self._settings.widest:g} rad")

    def _hold(self, reason: str) -> None:
        self.notes += (f"{reason}; the reference is held",)
        LOG.warning(self.notes[-1])

    def _forget(self, t: float) -> None:
        self._released = self._t = t
        self._window.reset(t)
        self._asked = self._trusted = False
        self.balance = 0.0
        self.notes = ()
        self._soft.reset()
        if self._watch is not None:
            self._watch.reset()
