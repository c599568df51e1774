"""From which loads a controller recovers: simulated releases of the loaded robot, one after the other."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise, product
from math import cos, sin, tan

import numpy as np

from wipx.control.balance_watch import check_carriage
from wipx.control.loop import Loop
from wipx.core.errors import InputError, check_positive
from wipx.core.load import BODY, Load, with_lean
from wipx.core.margins import Recovery, RecoveryRegion
from wipx.core.model import Model
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Simulator

LoopFor = Callable[[float], Loop]
Watcher = Callable[[str, float], None]


@dataclass(frozen=True)
class Releases:
    """A grid of loads, and what counts as recovered.

    Attributes:
        masses: Of the loads, ascending [kg].
        pitches: At which the loaded robot balances, ascending [rad]; a load's side follows from it.
        height: Of the loads above the wheel axis [m].
        rail: Half its length [m].
        fallen: Pitch at which the robot is stopped [rad].
        duration: After the release from upright, at rest [s].
        end: Part of that time, at its end, over which the robot is judged [s].
        sway: Largest distance of the pitch from its mean in that part [rad]; dry friction lets a robot hunt a little.
    """

    masses: tuple[float, ...] = (0.4, 0.8, 1.2, 1.6, 2.0)
    pitches: tuple[float, ...] = field(default_factory=lambda: tuple(np.linspace(-0.2, 0.2, 9).round(3).tolist()))
    height: float = 0.5
    rail: float = 1.8
    fallen: float = 1.0
    duration: float = 8.0
    end: float = 2.0
    sway: float = 0.1

    def __post_init__(self) -> None:
        check_positive(rail=self.rail, fallen=self.fallen, duration=self.duration, end=self.end, sway=self.sway)
        if not (self.masses and self.pitches and min(self.masses) > 0.0):
            raise InputError("releases: expected at least one mass above zero and one pitch")
        for name, values in {"masses": self.masses, "pitches": self.pitches}.items():
            if any(later <= earlier for earlier, later in pairwise(values)):
                raise InputError(f"releases.{name} is {list(values)}, expected ascending numbers; sort them")

    def load(self, model: Model, mass: float, pitch: float) -> Load:
        """The load of that mass with which the robot balances at that pitch."""
        leaning = with_lean(model)
        body_mass, com_height, _, lean = (leaning.value(name) for name in BODY)
        up = body_mass * com_height * cos(lean) + mass * self.height
        return Load(mass, self.height, (up * tan(pitch) - body_mass * com_height * sin(lean)) / mass)


class _StoppedError(Exception):
    """The robot is at the end of its rail, or has fallen."""


def recovery_region(
    loops: Mapping[str, LoopFor],
    model: Model,
    simulator: Simulator,
    releases: Releases,
    watcher: Watcher = lambda controller, share: None,
) -> RecoveryRegion:
    """Release the robot with every load under every controller.

    Sensors are exact but for what the model says of them; loops run with all they have, filter and limits included.

    Args:
        loops: Gives the loop of each controller, by name; called with the pitch at which the robot balances, of which
            only the estimator of a reference case may know.
        model: The robot without load.
        simulator: The engine.
        releases: What is done.
        watcher: Told the controller and the share of all releases that is done.

    Raises:
        InputError: the model is no body on a carriage.
    """
    check_carriage(model)
    loads = list(product(releases.masses, releases.pitches))
    grid = (len(releases.masses), len(releases.pitches))
    found = {}
    for i, (name, loop_for) in enumerate(loops.items()):
        ends = np.empty((len(loads), 3))
        for k, (mass, pitch) in enumerate(loads):
            watcher(name, (i + k / len(loads)) / len(loops))
            robot = releases.load(model, mass, pitch).on(model)
            ends[k] = _released(loop_for(pitch), robot, simulator, releases)
        recovered, farthest, standing = ends.T.reshape(3, *grid)
        found[name] = Recovery(recovered > 0.0, farthest, standing)
    return RecoveryRegion(
        np.array(releases.masses), np.array(releases.pitches), releases.height, releases.rail, releases.duration, found
    )


def _released(loop: Loop, robot: Model, simulator: Simulator, releases: Releases) -> tuple[bool, float, float]:
    """Whether the robot recovered, its largest distance from x = 0 and its mean distance in the end [m]."""
    shown: list[np.ndarray] = []

    def controller(t: float, measured: np.ndarray) -> np.ndarray:
        if not shown:
            loop.reset(t, measured)
        shown.append(measured.copy())
        if not (abs(measured[0]) < releases.rail and abs(measured[1]) < releases.fallen):
            raise _StoppedError
        return loop.step(t, measured, np.zeros(4))

    inputs = Inputs.regular(releases.duration, loop.rate, len(robot.plant.commands))
    stopped = False
    try:
        simulator.drive(robot, inputs, np.zeros(4), controller)
    except _StoppedError:
        stopped = True
    motion = np.array(shown)
    farthest = float(np.abs(motion[:, 0]).max())
    x, pitch = motion[-max(1, round(releases.end * loop.rate)) :, :2].T
    if stopped or np.abs(pitch - pitch.mean()).max() > releases.sway:
        return False, farthest, float("nan")
    return True, farthest, float(abs(x.mean()))
