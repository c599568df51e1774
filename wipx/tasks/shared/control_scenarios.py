"""What a robot has to do under loads that its controller does not know: tasks of the paper, Sec. V-C, and others."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, pi, sin
from types import MappingProxyType
from typing import Literal

import numpy as np

from wipx.hardware.target import LoadChange, Push, Trial

ScenarioName = Literal["balancing", "tracking", "load_comes", "load_goes", "push", "other_side"]

SPEED, FREQUENCY = 0.3, 0.4  # [m/s], [Hz]; paper: x_dot_des = 0.3 sin(2 pi 0.4 t)
SETTLING = 5.0  # [s] before tracking; a loaded robot has come back to within its stick-slip by then
JUDGED = 10.0  # [s] in which errors count
AT_REST = 3.0  # [s] of balancing without load, before one comes
IMPULSE, HEIGHT = 2.0, 0.5  # [N s], [m]; an 8 kg robot gains 0.25 m/s


@dataclass(frozen=True)
class Scenario:
    """One kind of trial.

    Attributes:
        name: Its name.
        begin: Time from which errors count [s].
        needs_room: Whether the robot must reach that time to be judged at all: the baseline wanders by metres
            until then, so the rail is a longer one.
        follows: Whether it tracks the paper's velocity from `begin` on.
        happening: What happens at `begin`.
        mirrored: Whether loads are on the other side of the body's axis.
    """

    name: str
    begin: float = 0.0
    needs_room: bool = False
    follows: bool = False
    happening: Literal["nothing", "load comes", "load goes", "push"] = "nothing"
    mirrored: bool = False

    @property
    def duration(self) -> float:
        """Of a trial [s]."""
        return self.begin + JUDGED

    @property
    def has_events(self) -> bool:
        """Whether something happens to the moving robot, which only an emulated one can be asked for."""
        return self.happening != "nothing"

    def trial(self, name: str, load: str) -> Trial:
        """The trial with one load."""
        happenings: dict[str, tuple[LoadChange | Push, ...]] = {
            "nothing": (),
            "load comes": (LoadChange(self.begin, load),),
            "load goes": (LoadChange(self.begin, None),),
            "push": (Push(self.begin, IMPULSE, HEIGHT),),
        }
        return Trial(
            name,
            self.duration,
            load=None if self.happening == "load comes" else load,
            reference=self.reference if self.follows else None,
            events=happenings[self.happening],
        )

    def reference(self, t: float) -> np.ndarray:
        """Coordinates and rates that are asked for at a time [s], shape (4,)."""
        if not self.follows or t < self.begin:
            return np.zeros(4)
        angle = 2.0 * pi * FREQUENCY
        phase = angle * (t - self.begin)
        return np.array([SPEED / angle * (1.0 - cos(phase)), 0.0, SPEED * sin(phase), 0.0])

    def balance(self, t: np.ndarray, pitch: float) -> np.ndarray:
        """Pitch at which the robot balances at times (K,), where the load of the trial makes it balance at `pitch`."""
        after = t >= self.begin
        if self.happening == "load comes":
            return np.where(after, pitch, 0.0)
        if self.happening == "load goes":
            return np.where(after, 0.0, pitch)
        return np.full(len(t), pitch)


SCENARIOS: Mapping[str, Scenario] = MappingProxyType(
    {
        scenario.name: scenario
        for scenario in (
            Scenario("balancing"),
            Scenario("tracking", SETTLING, needs_room=True, follows=True),
            Scenario("load_comes", AT_REST, happening="load comes"),
            Scenario("load_goes", SETTLING, needs_room=True, happening="load goes"),
            Scenario("push", SETTLING, needs_room=True, happening="push"),
            Scenario("other_side", mirrored=True),
        )
    }
)
