"""A linear plant as a digital controller sees it: commands are held, late and lagged (Franklin et al. 1998, ch. 4)."""

from dataclasses import dataclass
from itertools import pairwise
from math import floor

import numpy as np

from wipx.control.linear_law import LinearLaw
from wipx.control.linearise import linearise_completed
from wipx.core.errors import InputError
from wipx.core.model import Model

SAME = 1e-9  # of a period: a delay of 1.999999999 periods is one of two
SHOWN = 4  # poles that a message names
GONE = 1e-3  # a pole of the sampled loop below this is a command under way, which says nothing of stability


@dataclass(frozen=True)
class SampledPlant:
    """s[k+1] = F s[k] + G u[k], y[k] = the first `states` of s[k].

    s holds the plant's state, the lagged forces of its drives, and the commands that are still under way.

    Attributes:
        f: F, shape (S, S).
        g: G, shape (S, inputs).
        states: Coordinates and rates, 2 joints.
        period: Of the controller [s].
    """

    f: np.ndarray
    g: np.ndarray
    states: int
    period: float

    @classmethod
    def of(cls, model: Model, rate: float) -> "SampledPlant":
        """A completed model, linear as in `linearise_completed`, with the lag and the delay of its actuator.

        Args:
            model: The robot.
            rate: Of the controller [Hz].
        """
        linear, period = linearise_completed(model), 1.0 / rate
        states, inputs = linear.b.shape
        a, b = linear.a, linear.b
        lag = model.effects.get("actuator/lag", {}).get("tau", 0.0)
        if lag > 0.0:
            a = np.block([[a, b], [np.zeros((inputs, states)), -np.eye(inputs) / lag]])
            b = np.vstack([np.zeros_like(b), np.eye(inputs) / lag])
        periods = model.effects.get("actuator/delay", {}).get("tau", 0.0) / period
        whole = floor(periods + SAME)
        late = max(0.0, periods - whole) * period
        # Until a command arrives within a period, the one before it acts.
        before, after = _held(a, b, late), _held(a, b, period - late)
        size = len(a)
        f = np.zeros((size + (whole + 1) * inputs,) * 2)
        g = np.zeros((len(f), inputs))
        f[:size, :size] = after[0] @ before[0]
        queue = [slice(size + i * inputs, size + (i + 1) * inputs) for i in range(whole + 1)]
        f[:size, queue[whole]] = after[0] @ before[1]
        if whole:
            f[:size, queue[whole - 1]] = after[1]
        else:
            g[:size] = after[1]
        g[queue[0]] = np.eye(inputs)
        for newer, older in pairwise(queue):
            f[older, newer] = np.eye(inputs)
        return cls(f, g, states, period)

    def closed(self, law: LinearLaw) -> np.ndarray:
        """Matrix of the closed loop; its memory is summed once per period, shape (S + memories, S + memories)."""
        size, memories = len(self.f), len(law.intake)
        gains = np.zeros((len(law.gains), size))
        gains[:, : self.states] = law.gains
        intake = np.zeros((memories, size))
        intake[:, : self.states] = self.period * law.intake
        return np.block([[self.f - self.g @ gains, -self.g @ law.memory_gains], [intake, np.eye(memories)]])

    def poles(self, law: LinearLaw) -> np.ndarray:
        """Poles of the closed loop as rates, the least damped first, shape (poles,) [1/s]; stable ones are negative."""
        sampled = np.linalg.eigvals(self.closed(law))
        poles = np.log(sampled[np.abs(sampled) > GONE].astype(complex)) / self.period
        return poles[np.argsort(-poles.real, kind="stable")]

    def loop_transfer(self, law: LinearLaw, frequencies: np.ndarray) -> np.ndarray:
        """What returns of a command, with the loop broken there, shape (frequencies,); one command.

        Args:
            law: The controller.
            frequencies: Shape (frequencies,) [rad/s].
        """
        z = np.exp(1j * frequencies * self.period)[:, None, None]
        shown = np.linalg.solve(z * np.eye(len(self.f)) - self.f, self.g)[:, : self.states, 0]
        returned = shown @ law.gains[0]
        if len(law.intake):
            returned += (shown @ law.intake.T) @ law.memory_gains[0] * self.period / (z[:, 0, 0] - 1.0)
        return returned


def check_stabilises(law: LinearLaw, model: Model, rate: float) -> None:
    """Refuse a law that does not stabilise a completed model.

    The state is taken as known: the filter that estimates it has stable poles of its own.

    Raises:
        InputError: it does not; the message names the poles.
    """
    poles = SampledPlant.of(model, rate).poles(law)
    if poles[0].real < 0.0:
        return
    named = ", ".join(f"{p.real:.3g}{p.imag:+.3g}j" if p.imag else f"{p.real:.3g}" for p in poles[:SHOWN])
    raise InputError(
        f"controller: its gains do not stabilise the model: closed-loop poles at {named} 1/s, expected negative real "
        "parts; choose other weights or a faster loop"
    )


def _held(a: np.ndarray, b: np.ndarray, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """How the state, and a held input, change the state over a duration [s]."""
    from scipy.linalg import expm

    states = len(a)
    both = np.zeros((states + b.shape[1],) * 2)
    both[:states, :states], both[:states, states:] = a, b
    moved = expm(duration * both)
    return moved[:states, :states], moved[:states, states:]
