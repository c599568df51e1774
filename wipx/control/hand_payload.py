"""Mass of a payload in a robot's hand, from its motion while it balances.

No drive acts on the joint about which a robot balances, so the equation of motion of that joint needs no measured
force, and no friction of a gear disturbs it. With h the inverse dynamics of the robot, h_1 those with 1 kg in the hand,
and d the joint's damping,

    0 = h(q, q', q'') + d q' + m (h_1 - h)(q, q', q''),

which is linear in the mass m: least squares over the rows of a window, positions being smoothed and differentiated by
local polynomials (Savitzky, Golay 1964). It is the dynamic parameter identification of arms (Atkeson, An, Hollerbach
1986, IJRR 5(3)) for one number and the joints without drives.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.core.model import Model
from wipx.sim.tree.inverse import forces_of

ORDER = 3  # of the polynomials


@dataclass(frozen=True)
class EstimatedPayload:
    """A mass with its standard error [kg]."""

    mass: float
    deviation: float


@dataclass(frozen=True)
class HandPayload:
    """Settings of the estimator.

    Attributes:
        body: Body that carries the payload.
        place: Of the payload in the body's frame, a point mass [m].
        window: Time from the release on that is looked at [s].
        smoothing: Length of the polynomials [s].
    """

    body: str
    place: tuple[float, ...]
    window: float = 1.0
    smoothing: float = 0.1

    def __post_init__(self) -> None:
        check_positive(window=self.window, smoothing=self.smoothing)
        if self.window < 2.0 * self.smoothing:
            raise InputError(f"window is {self.window:g} s, expected at least two lengths of smoothing")
        if len(self.place) != len("xyz"):
            raise InputError(f"place has {len(self.place)} numbers, expected x, y and z in the body's frame [m]")

    def loaded(self, model: Model, mass: float) -> Model:
        """The robot with a point mass in its hand.

        Raises:
            InputError: the robot has no such body.
        """
        tree = model.plant.tree
        bodies = [link.body for link in tree.links if link.mass] if tree is not None else []
        if self.body not in bodies:
            raise unknown_name("body", self.body, bodies, "payload")
        effect: Mapping[str, float] = {"mass": mass, **dict(zip("xyz", self.place, strict=True))}
        return model.with_effects({f"link_{self.body}/payload": effect})

    def estimate(self, model: Model, positions: np.ndarray, period: float) -> EstimatedPayload:
        """The mass that explains the motion of the joints without drives.

        Args:
            model: The robot without payload.
            positions: As measured, shape (rows, joints) [rad or m].
            period: Between rows [s].

        Raises:
            InputError: every joint has a drive, or the rows are too few to smooth.
        """
        from scipy.signal import savgol_filter

        free = [i for i, joint in enumerate(model.plant.joints) if joint not in model.plant.actuated]
        if not free:
            raise InputError("payload: every joint has a drive; expected one about which the robot balances")
        length = 2 * round(self.smoothing / period / 2.0) + 1
        if not ORDER < length < len(positions):
            raise InputError(f"payload: {length} rows to smooth over, expected {ORDER + 1} to {len(positions) - 1}")
        inside = slice(length // 2, -(length // 2))  # where a polynomial has rows on both sides
        smooth = [savgol_filter(positions, length, ORDER, deriv=n, delta=period, axis=0) for n in range(3)]
        motion = [np.asarray(each)[inside] for each in smooth]
        empty, one = (forces_of(m, *motion)[:, free] for m in (model, self.loaded(model, 1.0)))
        damping = np.array([model.parameters[f"{model.plant.joints[i]}.damping"] for i in free])
        needed = -(empty + damping * motion[1][:, free]).ravel()
        slope = (one - empty).ravel()
        mass = float(slope @ needed / (slope @ slope))
        # Rows that one polynomial covers err together: one independent error for each polynomial.
        spread = np.mean((needed - mass * slope) ** 2) * length * len(free)
        return EstimatedPayload(mass, float(np.sqrt(spread / (slope @ slope))))
