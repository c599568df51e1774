"""A real wheeled inverted pendulum: a motor of the MIT Mini Cheetah protocol on CAN, a VN-100 on a serial line.

It asks its operator for every trial, checks the sensors, and runs. How to bring a robot up is in docs/hardware.md.
"""

import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from wipx.control.loop import Loop
from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.core.load import Load
from wipx.core.loop_quality import LoopQuality, quality_words
from wipx.core.model import Model
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.hardware.can_motor import BUS_LOST, CanMotor, MotorSettings, open_bus
from wipx.hardware.devices import Devices, Drivetrain
from wipx.hardware.imu import ImuSettings, open_imu
from wipx.hardware.mit_protocol import Ranges
from wipx.hardware.run import TrialRun, run_trial
from wipx.hardware.safety import DeviceError, Limits
from wipx.hardware.settings import settings_from
from wipx.hardware.target import Trial
from wipx.hardware.trial_logs import LoggedBus, TrialLogs

LOOK = 0.3  # [s] for which the sensors are watched before a trial
LEAST_MESSAGES = 5  # of the IMU in that time
SHOWN = 5  # overruns that are told


class Operator(Protocol):
    """Who sets a robot up."""

    def set_up(self, request: str, trial: Trial, load: Load | None) -> None:
        """Put a load on the robot, or none, and hold it still at the trial's pitch until the wheels take over.

        Args:
            request: The same for a person, one line.
            trial: What is done.
            load: What the robot carries.

        Raises:
            KeyboardInterrupt: nobody is there any more.
        """
        ...


class Person:
    """An operator at the terminal, who presses Enter when the robot is set up."""

    def set_up(self, request: str, trial: Trial, load: Load | None) -> None:
        """See `Operator`."""
        try:
            input(request)
        except EOFError as error:
            raise KeyboardInterrupt from error


@dataclass(frozen=True)
class HardwareTarget:
    """A robot that a person sets up for every trial.

    Attributes:
        parameters: Of the unloaded robot, as its owner has measured them (plant wip) [SI].
        can: Arguments of `can.Bus`.
        imu: See `ImuSettings`.
        limits: See `Limits`.
        motor: See `MotorSettings`.
        ranges: See `Ranges`.
        weights: Loads by name: mass [kg], height [m], side [m], see `Load`.
        pitch_tolerance: Largest difference between the requested pitch and the one at which the robot is held [rad].
        rest_rate: Largest pitch rate of a robot at rest [rad/s].
        priority: Of SCHED_FIFO, 1 to 99; 0 to go without.
        emulated: Whether the lines lead to `wipx.hardware.emulator`; recordings then say so.
        logs: Folder that takes what `TrialLogs` leaves; None for nothing.
    """

    parameters: Mapping[str, float]
    can: Mapping[str, Any]
    imu: Mapping[str, object]
    limits: Mapping[str, object]
    motor: Mapping[str, object] = field(default_factory=dict)
    ranges: Mapping[str, object] = field(default_factory=dict)
    weights: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    pitch_tolerance: float = 0.02
    rest_rate: float = 0.1
    priority: int = 0
    emulated: bool = False
    logs: str | None = None

    def __post_init__(self) -> None:
        check_positive(pitch_tolerance=self.pitch_tolerance, rest_rate=self.rest_rate)
        if not 0 <= self.priority <= 99:
            raise InputError(f"target.priority is {self.priority}, expected 1 to 99, or 0 to go without")
        needed = self._limits().force * self.nominal().parameters["wheel_radius"]
        strongest = self._ranges().torque
        if needed > strongest:
            remedy = f"the motor's range ends at {strongest:g} N m; lower it"
            raise InputError(f"target.limits.force needs a torque of {needed:.3g} N m, {remedy}")
        for part in (self._imu, self._motor, lambda: self.loads):  # what is wrong is said before anything moves
            part()

    @property
    def loads(self) -> Mapping[str, Load]:
        """See `Target`."""
        return {name: settings_from(Load, given, f"target.weights.{name}") for name, given in self.weights.items()}

    @property
    def rail(self) -> float:
        """See `Target`."""
        return self._limits().rail

    def nominal(self) -> Model:
        """See `Target`."""
        plant = plant_of("wip")
        return Model(plant, plant.complete(self.parameters, "target.parameters"), {})

    def run(self, trials: Sequence[Trial], loop: Loop, rng: np.random.Generator) -> Iterator[Recording]:
        """See `Target`; nothing is drawn.

        Raises:
            InputError: no operator is there, a device is missing or lost, or a trial ended as soon as it began.
        """
        if not sys.stdin.isatty():
            raise InputError(
                "target=hardware: there is no operator (the input is not a terminal); run it from a terminal"
            )
        yield from self.run_by(Person(), trials, loop)

    def run_by(self, operator: Operator, trials: Sequence[Trial], loop: Loop) -> Iterator[Recording]:
        """Run trials for which an operator sets the robot up; see `run`.

        Raises:
            InputError: as in `run`.
            KeyboardInterrupt: a trial was interrupted; its recording has been yielded.
        """
        for trial in trials:
            if trial.load is not None and trial.load not in self.loads:
                raise unknown_name("load", trial.load, self.loads, "target.weights")
        with self._connected() as (devices, bus):
            for trial in trials:
                yield from self._trial(devices, bus, trial, loop, operator)

    def _trial(
        self, devices: Devices, bus: LoggedBus, trial: Trial, loop: Loop, operator: Operator
    ) -> Iterator[Recording]:
        try:
            self._wait_for_operator(devices, trial, operator)
        except DeviceError as error:
            raise InputError(f"trial {trial.name}: {error}") from error
        kind = "emulated hardware" if self.emulated else "hardware"
        source = f"{kind}: {self.can.get('interface')} {self.can.get('channel')}, IMU on {self.imu['port']}"
        logs = TrialLogs(None if self.logs is None else Path(self.logs))
        with logs.trial(bus, trial.name):
            run = run_trial(devices, trial, loop, self._limits(), priority=self.priority, source=source)
        _tell(trial, run)
        if run.recording is not None:
            yield run.recording
        if run.quality is not None:
            logs.leave(trial.name, run.quality, run.end)
        if run.interrupted:
            raise KeyboardInterrupt
        if run.device_lost or run.recording is None:
            raise InputError(f"trial {trial.name}: stopped: {run.cut_short or 'it was too short to leave a recording'}")

    def _wait_for_operator(self, devices: Devices, trial: Trial, operator: Operator) -> None:
        """Have the robot set up and held; ask again until its IMU agrees.

        Raises:
            DeviceError: the line of the IMU is lost, or it sends nothing.
        """
        load = self.loads[trial.load] if trial.load else None
        carried = f"load {trial.load} ({load.mass:g} kg, {load.height:g} m high)" if load else "no load"
        place = f"hold it still at pitch {trial.pitch:+.3f} rad with room to both sides"
        request = f"trial {trial.name}: {carried} on the robot; {place}, press Enter and let go: "
        while True:
            operator.set_up(request, trial, load)
            doubt = self._doubt(devices, trial)
            if doubt is None:
                return
            request = f"trial {trial.name}: {doubt}; {place}, press Enter and let go: "

    def _doubt(self, devices: Devices, trial: Trial) -> str | None:
        """What is wrong with how the robot is held; None for nothing."""
        imu = devices.imu
        imu.begin()
        until = time.perf_counter() + LOOK
        while time.perf_counter() < until:
            imu.read()
            time.sleep(0.002)
        if len(imu.samples) < LEAST_MESSAGES:
            found = f"{len(imu.samples)} good and {imu.damaged} damaged messages"
            raise DeviceError(f"{found} from the IMU in {LOOK:g} s; check target.imu (message, baud) and its supply")
        pitch = float(np.median([sample.theta for sample in imu.samples]))
        fastest = max(abs(sample.theta_dot) for sample in imu.samples)
        if fastest > self.rest_rate:
            return f"the body moves at {fastest:.2g} rad/s"
        if abs(pitch - trial.pitch) > self.pitch_tolerance:
            return f"its pitch is {pitch:+.3f} rad"
        return None

    @contextmanager
    def _connected(self) -> Iterator[tuple[Devices, LoggedBus]]:
        """The devices and their bus, opened; closed at the end."""
        motor, imu_settings = self._motor(), self._imu()
        imu = open_imu(imu_settings)
        try:
            bus = LoggedBus(open_bus(self.can, motor.master_id))
            try:
                radius = self.nominal().parameters["wheel_radius"]
                drivetrain = Drivetrain(radius, motor.direction, motor.on_body)
                yield Devices(CanMotor(bus, motor, self._ranges()), imu, drivetrain), bus
            finally:
                with suppress(*BUS_LOST):
                    bus.shutdown()
        finally:
            imu.close()

    def _limits(self) -> Limits:
        return settings_from(Limits, self.limits, "target.limits")

    def _motor(self) -> MotorSettings:
        return settings_from(MotorSettings, self.motor, "target.motor")

    def _ranges(self) -> Ranges:
        return settings_from(Ranges, self.ranges, "target.ranges")

    def _imu(self) -> ImuSettings:
        return settings_from(ImuSettings, self.imu, "target.imu")


def _tell(trial: Trial, run: TrialRun) -> None:
    """One line about a trial, and a warning where the motor may still be on."""
    words = [run.end]
    if run.recording is not None:
        shown = ((name, run.recording[name]) for name in ("x", "theta", "u"))
        ranges = (f"{name} {values.min():.3g} to {values.max():.3g}" for name, values in shown)
        words.append(f"{len(run.recording)} rows in {run.recording.duration:.2f} s ({', '.join(ranges)})")
    print(f"trial {trial.name}: {'; '.join(words + _loop_words(run.quality))}", file=sys.stderr)
    if not run.switched_off:
        print(
            "WARNING: the motor has not confirmed that it is off; cut its power before you touch the robot",
            file=sys.stderr,
        )


def _loop_words(quality: LoopQuality | None) -> list[str]:
    """How well the loop kept time, and what was missed."""
    if quality is None:
        return []
    words = [quality_words(quality.summary())]
    if quality.overruns:
        at = ", ".join(f"{overrun.t:.2f}" for overrun in quality.overruns[:SHOWN])
        more = ", ..." if len(quality.overruns) > SHOWN else ""
        words.append(f"{quality.skipped} steps skipped (at {at}{more} s)")
    if quality.lost_replies:
        words.append(f"{len(quality.lost_replies)} replies of the motor lost (interpolated)")
    if quality.damaged_messages:
        words.append(f"{quality.damaged_messages} messages of the IMU damaged")
    return words
