"""The contract of every robot, emulated or real: trials under a control loop in, recordings out."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from wipx.control.loop import Loop
from wipx.core.load import Load
from wipx.core.model import Model
from wipx.core.recording import Recording

Reference = Callable[[float], np.ndarray]


@dataclass(frozen=True)
class LoadChange:
    """Somebody puts another load on the moving robot, at its speed, or takes it off.

    Attributes:
        t: When, since the release [s].
        load: What it carries from then on, a key of `Target.loads`; None for nothing.
    """

    t: float
    load: str | None


@dataclass(frozen=True)
class Push:
    """A blow to the body, so short that nothing moves meanwhile.

    Attributes:
        t: When, since the release [s].
        impulse: Along the rail [N s].
        height: Where it hits, above the wheel axis along the body [m].
    """

    t: float
    impulse: float
    height: float


@dataclass(frozen=True)
class Trial:
    """One run of a robot.

    Attributes:
        name: Of its recording.
        duration: From the release on [s].
        load: Name of the load on its body, a key of `Target.loads`; None for none.
        pitch: At which it is held until it is released, at rest and at x = 0 [rad].
        reference: Of coordinates and rates over time since the release, shape (2 joints,); None for zero.
        events: What happens to it meanwhile, in the order of time; real robots have none.
    """

    name: str
    duration: float
    load: str | None = None
    pitch: float = 0.0
    reference: Reference | None = None
    events: tuple[LoadChange | Push, ...] = ()


@runtime_checkable
class KeepsLogs(Protocol):
    """A target whose trials have more to tell than their recordings; it tells on the terminal how each trial went.

    Attributes:
        logs: Folder that takes the raw frames and the loop's quality of every trial; None for nothing.
    """

    logs: str | None


class Target(Protocol):
    """A robot that can be run."""

    @property
    def loads(self) -> Mapping[str, Load]:
        """Weights that can be put on it, by name, as its owner has measured them."""
        ...

    @property
    def emulated(self) -> bool:
        """Whether its recordings are emulated, not of a real robot."""
        ...

    @property
    def rail(self) -> float:
        """How far it may go from the release, to either side [m]."""
        ...

    def nominal(self) -> Model:
        """The robot without load as its owner believes it to be."""
        ...

    def run(self, trials: Sequence[Trial], loop: Loop, rng: np.random.Generator) -> Iterator[Recording]:
        """Run trials one after the other; a recording begins at the release and ends where the robot is stopped.

        Args:
            trials: What is done.
            loop: Drives the robot; reset before every trial.
            rng: Draws what differs between trials of an emulated robot.

        Yields:
            One recording for each trial: `t` from 0, coordinates and rates as the sensors show them, `u` as commanded,
            `u_measured` as the drive reports it.
        """
        ...
