"""Emulated testbed: a robot whose physics its owner does not know entirely, in another engine than the fitted model.

It stands in for hardware where there is none. Its recordings are emulated, not real. What is hidden is drawn from a
seed (`wipx.hardware.hidden`); a command acts when it arrives at the drive, and a robot that reaches the end of its
rail, or falls, is stopped there. Where something happens to it in a trial, the engine begins anew from the robot's
coordinates and rates; bristles of its friction and the play of its drive begin relaxed.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Literal, cast

import numpy as np

from wipx.control.loop import Loop
from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.core.load import Load
from wipx.core.model import Model
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.hardware.emulated_trial import EmulatedTrial, RobotStoppedError, Schedule
from wipx.hardware.hidden import HiddenPhysics, paper_physics, rich_physics
from wipx.hardware.push import pushed
from wipx.hardware.settings import settings_from
from wipx.hardware.target import LoadChange, Push, Trial
from wipx.sim.simulator import Simulator

FALLEN = 1.0  # [rad]


@dataclass(frozen=True)
class EmulatedTestbed:
    """A simulated robot with hidden physics, its drive and its sensors; a `wipx.hardware.target.Target`.

    Attributes:
        kind: Its plant.
        parameters: Its rigid body without load, which its owner knows exactly [SI]. The wheel radius is what turns
            the motor's turns into the position x, of a cart or an axis too.
        engine: Simulator that moves it; another than the one that is fitted, unless a test asks for it.
        weights: Loads that can be put on it, each with mass [kg], height and side [m], by name.
        physics: "rich": friction with memory, backlash, dead zone, latency, CAN steps, coloured IMU noise and bias;
            "paper": exactly the paper's joint model and white noise.
        seed: Draws what is hidden.
        rail: Half its length; a plant with a position is stopped there [m].
        period_jitter: By how much a tick of the loop is late, mean of an exponential distribution [s].
        release_error: A hand releases the robot up to this angle beside the trial's pitch [rad].
    """

    kind: str
    parameters: Mapping[str, float]
    engine: Simulator
    weights: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    physics: Literal["rich", "paper"] = "rich"
    seed: int = 0
    rail: float = 1.8
    period_jitter: float = 5e-5
    release_error: float = 2e-3

    def __post_init__(self) -> None:
        check_positive(rail=self.rail)
        for name in ("period_jitter", "release_error"):
            if not getattr(self, name) >= 0.0:
                raise InputError(f"target.{name} is {getattr(self, name):g}, expected zero or a positive number")
        if self.seed < 0:
            raise InputError(f"target.seed is {self.seed}, expected a whole number from 0 on")

    @property
    def emulated(self) -> bool:
        """It is."""
        return True

    @property
    def loads(self) -> Mapping[str, Load]:
        """Weights that can be put on it, by name, as its owner has measured them."""
        return {name: settings_from(Load, place, f"target.weights.{name}") for name, place in self.weights.items()}

    def stepping(self, step: float) -> "EmulatedTestbed":
        """The testbed with an engine of another step [s]."""
        return replace(self, engine=replace(cast(Any, self.engine), step=step))

    def nominal(self) -> Model:
        """The robot without load as its owner believes it to be."""
        plant = plant_of(self.kind, "target.kind")
        return Model(plant, plant.complete(self.parameters, "target.parameters"), {})

    def hidden(self) -> HiddenPhysics:
        """The robot without load as it really is; for the record only, no identification may read it."""
        draw = {"rich": rich_physics, "paper": paper_physics}[self.physics]
        return draw(self.nominal(), np.random.default_rng(self.seed))

    def run(self, trials: Sequence[Trial], loop: Loop, rng: np.random.Generator) -> Iterator[Recording]:
        """Run trials one after the other; see `Target.run`.

        Raises:
            InputError: a trial names a load that there is none of, its events are out of order, or the robot falls
                at once.
        """
        hidden = self.hidden()
        for trial in trials:
            self._check(trial)
        for trial in trials:
            schedule = Schedule.drawn(trial.duration, loop.rate, self.period_jitter, hidden, rng)
            run = EmulatedTrial(trial, loop, hidden, schedule, {"x": self.rail, "theta": FALLEN}, rng)
            with suppress(RobotStoppedError):  # the log ends there
                self._move(hidden.model, schedule, run, self._released(trial, rng))
            yield run.recording()

    def _move(self, unloaded: Model, schedule: Schedule, run: EmulatedTrial, state: np.ndarray) -> None:
        """Move the robot from event to event.

        Args:
            unloaded: The robot without load.
            schedule: When its loop runs.
            run: What its loop is shown and commands.
            state: True coordinates and rates at the release, shape (2 joints,).

        Raises:
            RobotStoppedError: the robot has reached an end.
        """
        model, first = self._carrying(unloaded, run.trial.load), 0
        for event in run.trial.events:
            last = schedule.row_at(event.t)
            state = _driven(self.engine, model, schedule, run, state, first, last)
            first = last
            if isinstance(event, Push):
                state = pushed(model, state, event)
            else:
                model = self._carrying(unloaded, event.load)
        _driven(self.engine, model, schedule, run, state, first, len(schedule.rows) - 1)

    def _carrying(self, unloaded: Model, load: str | None) -> Model:
        return unloaded if load is None else self.loads[load].on(unloaded)

    def _check(self, trial: Trial) -> None:
        """Refuse what cannot be done before anything moves."""
        where, loads = f"target=emulated: {trial.name}", self.loads
        for load in (trial.load, *(event.load for event in trial.events if isinstance(event, LoadChange))):
            if load is not None and load not in loads:
                raise unknown_name("load", load, loads, where)
        times = [0.0, *(event.t for event in trial.events), trial.duration]
        if any(after <= before for before, after in pairwise(times)):
            raise InputError(
                f"{where}: events at {times[1:-1]} s, expected times in order and within 0 to {trial.duration:g} s"
            )

    def _released(self, trial: Trial, rng: np.random.Generator) -> np.ndarray:
        """True coordinates and rates at the release, shape (2 joints,)."""
        coordinates = plant_of(self.kind).coordinates
        state = np.zeros(2 * len(coordinates))
        if "theta" in coordinates:
            error = rng.uniform(-self.release_error, self.release_error)
            state[coordinates.index("theta")] = trial.pitch + error
        return state


def _driven(
    engine: Simulator,
    model: Model,
    schedule: Schedule,
    run: EmulatedTrial,
    state: np.ndarray,
    first: int,
    last: int,
) -> np.ndarray:
    """True coordinates and rates at row `last` of the schedule, shape (2 joints,), from those at row `first`."""
    if first == last:  # two events between two rows
        return state
    moved = engine.drive(model, schedule.inputs(len(model.plant.commands), first, last), state, run.instant)
    return np.concatenate([moved.coordinates[-1, :, 0, 0], moved.rates[-1, :, 0, 0]])
