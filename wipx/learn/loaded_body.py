"""Equations of motion of a balancing robot under its controller, for many estimates at once.

Contract section 2, with a balance and a mass of the load of each estimate's own, and the smooth part of the model's
friction. Where on the body the load sits, beside moving the balance, is the same for all: at a typical place.
"""

from dataclasses import dataclass

import numpy as np

from wipx.control.ekf import EASE_SLIDING, EASE_TURNING
from wipx.core.model import Model, ModelBatch
from wipx.learn.loads import carrying
from wipx.sim import body as B
from wipx.sim import rows as R
from wipx.sim.coefficients import coefficients
from wipx.sim.simulator import StateFeedback

LONGEST = 8e-3  # [s] of a step; friction of 10 N that builds up over 1 cm/s slows 7 kg with a rate of 140 1/s


@dataclass(frozen=True)
class LoadedBody:
    """A wip or cartpole with a load at a typical place, and its controller; pairs are (without load, per kg of it).

    Attributes:
        mass: That moves along the rail, shape (2,) [kg, 1].
        coupling: Body's mass times height of its centre, shape (2,) [kg m, m].
        inertia: Of the body about the axle, shape (2,) [kg m^2, m^2].
        gravity: Weight times height, shape (2,) [N m/rad, N m/(rad kg)].
        gains: From the state to the force, shape (4,).
        limit: Of the force [N].
        viscous: Friction of both joints, shape (2,) [N s/m, N m s/rad].
        dry: Its level while they move, shape (2,) [N, N m].
    """

    mass: np.ndarray
    coupling: np.ndarray
    inertia: np.ndarray
    gravity: np.ndarray
    gains: np.ndarray
    limit: float
    viscous: np.ndarray
    dry: np.ndarray

    @classmethod
    def of(cls, model: Model, loads: np.ndarray, feedback: StateFeedback) -> "LoadedBody":
        """The robot with loads at the mean height of loads (N, 3) [kg, m, m], to a side by their root mean square.

        Raises:
            InputError: the model cannot carry a load.
        """
        place = [loads[:, 1].mean(), np.sqrt(np.mean(loads[:, 2] ** 2))]
        masses = np.array([0.5, 1.5]) * loads[:, 0].mean()
        # All but the distance of the centre of mass is in proportion to the load's mass, and that almost is.
        known = coefficients(carrying(ModelBatch(model), np.array([[mass, *place] for mass in masses])))
        both = known.body
        per_mass = (both[:, 1] - both[:, 0]) / (masses[1] - masses[0])
        pairs = np.stack([both[:, 0] - per_mass * masses[0], per_mass], axis=1)
        c = known.joints[:, :, 0].T
        drive = float(c[R.INPUT_GAIN, 0] * c[R.GAIN, 0])
        level = 0.5 * (c[R.LEVEL_PLUS] + c[R.LEVEL_MINUS])
        return cls(
            pairs[B.MASS],
            pairs[B.COUPLING],
            pairs[B.INERTIA],
            pairs[B.GRAVITY],
            drive * feedback.gains[0],
            min(abs(drive) * feedback.limit, float(c[R.FORCE_MAX, 0])),
            c[R.VISCOUS] + c[R.PAPER_VISCOUS],
            level + c[R.SLIDING] + c[R.PAPER_COULOMB],
        )

    def moved(self, states: np.ndarray, duration: float) -> np.ndarray:
        """States after a duration [s], by the classical Runge-Kutta method.

        Args:
            states: x, theta, their rates, pitch of balance, mass of the load, shape (6, ...) [m, rad, ..., kg].
            duration: [s].
        """
        count = int(np.ceil(duration / LONGEST - 1e-9))
        step = duration / count
        for _ in range(count):
            first = self._slopes(states)
            second = self._slopes(states + 0.5 * step * first)
            third = self._slopes(states + 0.5 * step * second)
            fourth = self._slopes(states + step * third)
            states = states + step / 6.0 * (first + 2.0 * (second + third) + fourth)
        return states

    def _slopes(self, states: np.ndarray) -> np.ndarray:
        _, theta, velocity, rate, balance, load = states
        mass, coupling, inertia, gravity = (
            pair[0] + pair[1] * load for pair in (self.mass, self.coupling, self.inertia, self.gravity)
        )
        sine, cross = np.sin(theta - balance), coupling * np.cos(theta - balance)
        force = -np.tensordot(self.gains, states[:4], axes=1)
        force = np.clip(force, -self.limit, self.limit) - self.viscous[0] * velocity
        force -= self.dry[0] * np.tanh(velocity / EASE_SLIDING) + coupling * sine * rate**2
        torque = gravity * sine - self.viscous[1] * rate - self.dry[1] * np.tanh(rate / EASE_TURNING)
        determinant = mass * inertia - cross**2
        slopes = np.zeros_like(states)
        slopes[0], slopes[1] = velocity, rate
        slopes[2] = (inertia * force + cross * torque) / determinant
        slopes[3] = (cross * force + mass * torque) / determinant
        return slopes
