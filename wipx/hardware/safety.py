"""What stops a robot: limits on its state, devices that fall silent, and signals to the process."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

import numpy as np

from wipx.core.errors import check_positive


class LimitError(Exception):
    """The robot left its limits: the trial is over, the next may follow."""


class DeviceError(Exception):
    """A device is silent, broken or gone: no trial can follow."""


@dataclass(frozen=True)
class Limits:
    """Beyond these the robot is stopped; the force is cut.

    Attributes:
        force: Largest commanded force, beyond which commands are cut [N].
        pitch: Largest pitch to either side [rad].
        rail: Largest distance from the release [m].
        speed: Largest speed [m/s].
        silence: Longest time without a reply of the motor, or a message of the IMU [s].
    """

    force: float
    pitch: float
    rail: float
    speed: float
    silence: float

    def __post_init__(self) -> None:
        check_positive(force=self.force, pitch=self.pitch, rail=self.rail, speed=self.speed, silence=self.silence)

    def check(self, x: float, theta: float, x_dot: float) -> None:
        """Refuse a state beyond the limits.

        Args:
            x: [m].
            theta: [rad].
            x_dot: [m/s].

        Raises:
            LimitError: which one, and by how much.
        """
        for name, value, limit, unit in (
            ("pitch", theta, self.pitch, "rad"),
            ("x", x, self.rail, "m"),
            ("speed", x_dot, self.speed, "m/s"),
        ):
            if not abs(value) <= limit:  # also where it is no number
                raise LimitError(f"{name} {value:.3g} {unit} is beyond +-{limit:g} {unit}")

    def cut(self, command: np.ndarray) -> float:
        """The force of a command, within +-`force` [N].

        Args:
            command: Of the loop, shape (1,) [N].

        Raises:
            LimitError: it is no number.
        """
        force = float(command[0])
        if not np.isfinite(force):
            raise LimitError(f"the controller's command is {force}")
        return min(max(force, -self.force), self.force)


class Interruptions:
    """Turns the first signal to stop into `KeyboardInterrupt`, and keeps back those that come while it is held."""

    def __init__(self) -> None:
        self._held = False
        self._kept_back = False
        self._raised = False

    def hold(self) -> None:
        """Keep signals back from here on: what follows must not be interrupted."""
        self._held = True

    def arrive(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        if self._held or self._raised:
            self._kept_back = not self._raised
            return
        self._raised = True
        raise KeyboardInterrupt

    def release(self) -> None:
        """Let go of what was kept back.

        Raises:
            KeyboardInterrupt: a signal was.
        """
        if self._kept_back:
            raise KeyboardInterrupt


@contextmanager
def interruptible() -> Iterator[Interruptions]:
    """Let Ctrl-C, SIGTERM and a closed terminal alike raise `KeyboardInterrupt`, once.

    Otherwise SIGTERM would end the process before the motor is switched off, and a second Ctrl-C could interrupt the
    switching off. Outside the main thread, where signals do not arrive, nothing is changed.
    """
    interruptions = Interruptions()
    if threading.current_thread() is not threading.main_thread():
        yield interruptions
        return
    names = [name for name in ("SIGINT", "SIGTERM", "SIGHUP") if name in signal.Signals.__members__]
    before = {name: signal.signal(signal.Signals[name], interruptions.arrive) for name in names}
    try:
        yield interruptions
    finally:
        for name, handler in before.items():
            signal.signal(signal.Signals[name], handler)
    interruptions.release()
