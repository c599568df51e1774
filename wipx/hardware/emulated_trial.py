"""One trial of an emulated robot: when its loop runs, what it is shown and commands, and the log."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.control.loop import Loop
from wipx.core.errors import InputError
from wipx.core.recording import Recording
from wipx.hardware.hidden import HiddenPhysics
from wipx.hardware.sensors import Motor, Sensors
from wipx.hardware.target import Trial
from wipx.sim.inputs import Inputs

SOONEST = 2e-4  # [s] a command takes; a frame of 8 bytes takes 0.13 ms at 1 Mbit/s
LATEST = 0.4  # periods by which a tick is late at most
CLOCK = 6  # decimals of all times [s], so that no two instants are closer than a microsecond
FEWEST_ROWS = 3


class RobotStoppedError(Exception):
    """The robot is at the end of its rail, or has fallen."""


@dataclass(frozen=True)
class Schedule:
    """When the loop runs and when its commands arrive; nothing of it depends on the robot's motion.

    Attributes:
        ticks: Of the loop; the end of the trial is the last, shape (K + 1,) [s].
        rows: Ticks and arrivals of commands at the drive, shape (N + 1,) [s].
        tick_of: Number of the tick at each row, -1 where there is none, shape (N + 1,).
        acting: Number of the command that acts from each row on, -1 before the first, shape (N + 1,).
    """

    ticks: np.ndarray
    rows: np.ndarray
    tick_of: np.ndarray
    acting: np.ndarray

    @classmethod
    def drawn(
        cls, duration: float, rate: float, jitter: float, hidden: HiddenPhysics, rng: np.random.Generator
    ) -> "Schedule":
        """Absolute deadlines, from which a tick is late by chance; a command never overtakes the one before.

        Args:
            duration: Of the trial [s].
            rate: Of the loop [Hz].
            jitter: Mean lateness of a tick [s].
            hidden: Has the latency of commands.
            rng: Draws lateness and latencies.
        """
        count = max(FEWEST_ROWS, round(duration * rate))
        late = np.minimum(jitter * rng.exponential(size=count + 1), LATEST / rate)
        late[0] = 0.0
        ticks = np.round(np.arange(count + 1) / rate + late, CLOCK)
        arrivals = ticks[:-1]
        if hidden.latency > 0.0:
            taken = hidden.latency + hidden.latency_jitter * rng.normal(size=count)
            arrivals = np.round(np.maximum.accumulate(arrivals + np.maximum(taken, SOONEST)), CLOCK)
        rows = np.union1d(ticks, arrivals[arrivals < ticks[-1]])
        tick_of = np.full(len(rows), -1)
        tick_of[np.searchsorted(rows, ticks)] = np.arange(count + 1)
        return cls(ticks, rows, tick_of, np.searchsorted(arrivals, rows, side="right") - 1)

    def row_at(self, t: float) -> int:
        """The first row from a time [s] on; the last one where there is none."""
        return min(int(np.searchsorted(self.rows, t)), len(self.rows) - 1)

    def inputs(self, commands: int, first: int, last: int) -> Inputs:
        """The rows `first` to `last` as an engine takes them."""
        rows, zero = last - first, np.zeros(1, dtype=np.int64)
        return Inputs(self.rows[first : last + 1, None], np.zeros((rows, commands, 1)), zero, zero + rows)


class EmulatedTrial:
    """A trial under way.

    Args:
        trial: What is done; kept as the attribute `trial`.
        loop: Drives the robot.
        hidden: The robot without load.
        schedule: When the loop runs.
        ends: Coordinates at which the robot is stopped, by column [m, rad].
        rng: Draws the noise.
    """

    def __init__(
        self,
        trial: Trial,
        loop: Loop,
        hidden: HiddenPhysics,
        schedule: Schedule,
        ends: Mapping[str, float],
        rng: np.random.Generator,
    ) -> None:
        self._plant = plant = hidden.model.plant
        self.trial, self._loop, self._schedule = trial, loop, schedule
        self._motors = tuple(Motor.of(hidden.model, site, in_steps=hidden.in_steps) for site in plant.actuated)
        self._sensors = Sensors(hidden, self._motors, schedule.ticks, rng)
        self._torque_noise = hidden.torque_noise * rng.normal(size=(len(schedule.ticks), len(self._motors)))
        self._ends = np.array([ends.get(column, np.inf) for column in plant.coordinates])
        self._row = 0
        self._shown: list[np.ndarray] = []
        self._commands: list[np.ndarray] = []
        self._forces: list[np.ndarray] = []

    def instant(self, t: float, true: np.ndarray) -> np.ndarray:
        """Forces that the drives are asked for from a row of the schedule on, shape (inputs,) [N or N m].

        Args:
            t: Time of the row [s].
            true: Coordinates, then rates, shape (2 joints,).

        Raises:
            RobotStoppedError: the robot has reached an end.
        """
        if not np.all(np.abs(true[: len(self._ends)]) < self._ends):
            raise RobotStoppedError
        k, acting = self._schedule.tick_of[self._row], self._schedule.acting[self._row]
        self._row += 1
        if k >= 0:
            self._tick(t, self._sensors.show(k, true))
        return self._forces[acting] if acting >= 0 else np.zeros(len(self._motors))

    def _tick(self, t: float, shown: np.ndarray) -> None:
        """Run the loop once; its command is on its way."""
        if not self._shown:
            self._loop.reset(t, shown)
        commands = np.array(self._loop.step(t, shown, self._reference(t)), dtype=float)
        self._shown.append(shown)
        self._commands.append(commands)
        self._forces.append(np.array([m.force.limited(u) for m, u in zip(self._motors, commands, strict=True)]))

    def _reference(self, t: float) -> np.ndarray:
        reference = self.trial.reference
        return np.zeros(2 * len(self._ends)) if reference is None else reference(t)

    def recording(self) -> Recording:
        """The log up to where the robot was stopped: one row per tick.

        Raises:
            InputError: the robot was stopped at once.
        """
        rows = len(self._shown)
        if rows < FEWEST_ROWS:
            raise InputError(
                f"target=emulated: {self.trial.name}: the robot is at the end of its rail or has fallen when it is "
                "released; hold it at another pitch"
            )
        plant, t = self._plant, self._schedule.ticks[:rows]
        columns = {"t": t}
        columns |= dict(zip((*plant.coordinates, *plant.rates), np.array(self._shown).T, strict=True))
        columns |= dict(zip(plant.commands, np.array(self._commands).T, strict=True))
        if plant.commands == ("u",):
            columns["u_measured"] = self._reported(rows)
        if self.trial.reference is not None:
            followed = np.array([self._reference(time) for time in t]).T
            names = [f"{column}_ref" for column in (*plant.coordinates, *plant.rates)]
            columns |= {n: v for n, v in zip(names, followed, strict=True) if n in ("x_ref", "theta_ref", "x_dot_ref")}
        return Recording(self.trial.name, columns, f"emulated testbed, {self.trial.name}")

    def _reported(self, rows: int) -> np.ndarray:
        """What the drive reports: its mean force from each tick to the next, shape (rows,) [N or N m]."""
        schedule, motor = self._schedule, self._motors[0]
        times = schedule.rows[: self._row + 1]
        forces = np.array([force[0] for force in self._forces])
        acting = schedule.acting[: self._row]
        held = np.where(acting >= 0, forces[np.maximum(acting, 0)], 0.0)
        impulse = np.concatenate([[0.0], np.cumsum(held * np.diff(times))])
        ends = np.minimum(schedule.ticks[: rows + 1], times[-1])
        means = np.diff(np.interp(ends, times, impulse)) / np.diff(ends)
        return motor.force.limited(means + self._torque_noise[:rows, 0] / motor.lever)
