"""Where a robot balances, read off its own motion: no mass of a load has to be known, and nothing is learned.

With y = [x, theta] small, contract section 2 gives for the pitch about its balance

    m_b g L (theta - theta_eq) = (m_b L^2 + I_b) theta'' - m_b L x'',

whose mean over a time T is an exact difference of rates: theta_eq = mean(theta) + (x' - x'_T) / (g T)
- (L + I_b / (m_b L)) (theta' - theta'_T) / (g T). The last term is small where the robot does not fall, so a load
that changes its factor does little. Commands and friction of the wheels are not part of it; friction of the pitch is
neglected. It is the disturbance observer of the generalised momentum (De Luca and Mattone 2003) over a finite time.
"""

from collections import deque

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model


class BalanceWatch:
    """Mean balance over the last moments.

    Args:
        model: The robot as it is known: gravity, and the body whose pitch has inertia.
        horizon: Over which the mean is taken [s].

    Raises:
        InputError: the model is no body on a carriage.
    """

    def __init__(self, model: Model, horizon: float) -> None:
        check_carriage(model)
        p = model.parameters
        self._gravity = p["gravity"]
        self._arm = p["com_height"] + p["body_inertia"] / (p["body_mass"] * p["com_height"])
        self._horizon = horizon
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self._seen: deque[tuple[float, float, float]] = deque()
        self._sum = self._last = 0.0

    def see(self, t: float, state: np.ndarray) -> None:
        """Take note of a state [x, theta, x', theta'] at a time [s], later than the last one."""
        pitch, momentum = float(state[1]), float(state[2] - self._arm * state[3])
        if self._seen:
            self._sum += 0.5 * (t - self._seen[-1][0]) * (pitch + self._last)
        self._last = pitch
        self._seen.append((t, self._sum, momentum))
        while len(self._seen) > 2 and t - self._seen[1][0] >= self._horizon:
            self._seen.popleft()

    @property
    def pitch(self) -> float | None:
        """Of balance [rad]; None before a whole horizon was seen."""
        if not self._seen:
            return None
        (begin, first, before), (end, last, after) = self._seen[0], self._seen[-1]
        if end - begin < self._horizon:
            return None
        return ((last - first) + (after - before) / self._gravity) / (end - begin)


def check_carriage(model: Model) -> None:
    """Refuse plants without a body that balances on a driven carriage.

    Raises:
        InputError: the model is one.
    """
    if model.plant.kind not in ("wip", "cartpole"):
        raise InputError(
            f"controller: it needs a body that balances on wheels or on a cart, got a {model.plant.kind}; "
            "take controller=lqr"
        )
