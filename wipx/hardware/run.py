"""One trial of a real robot: sense, step the loop, keep to the limits, push; and switch the motor off, always."""

from dataclasses import dataclass

import numpy as np

from wipx.control.loop import Loop
from wipx.core.loop_quality import LoopQuality
from wipx.core.recording import Recording
from wipx.hardware.devices import Devices
from wipx.hardware.pace import Pace, undisturbed
from wipx.hardware.safety import DeviceError, LimitError, Limits, interruptible
from wipx.hardware.target import Trial


@dataclass(frozen=True)
class TrialRun:
    """What a trial left.

    Attributes:
        recording: Until the end, or until it was cut short; None where that was at once.
        cut_short: Why it was; None where it was not.
        device_lost: Whether that was for a device, so that no trial can follow.
        interrupted: Whether it was for Ctrl-C or another signal to stop.
        switched_off: Whether the motor has confirmed that it is off.
        quality: How well the loop kept time; None where it was cut short at once.
    """

    recording: Recording | None
    cut_short: str | None
    device_lost: bool
    interrupted: bool
    switched_off: bool
    quality: LoopQuality | None

    @property
    def end(self) -> str:
        """How it ended, in words."""
        return f"stopped early: {self.cut_short}" if self.cut_short else "done"


def run_trial(devices: Devices, trial: Trial, loop: Loop, limits: Limits, *, priority: int, source: str) -> TrialRun:
    """Run the robot from its release to the end of the trial, to a limit, to a fault or to an interruption.

    Args:
        devices: Of the robot; the IMU has been read.
        trial: What is done.
        loop: Drives the robot.
        limits: Stop it.
        priority: Of the scheduler, see `undisturbed`.
        source: Origin of the recording.
    """
    pace = Pace(loop.rate)
    cut_short, device_lost, interrupted, switched_off = None, False, False, False
    try:
        with interruptible() as interruptions, undisturbed(priority):
            try:
                _drive(devices, trial, loop, limits, pace)
            except (LimitError, DeviceError) as stop:
                cut_short, device_lost = str(stop), isinstance(stop, DeviceError)
            finally:
                interruptions.hold()
                switched_off = devices.end()
    except KeyboardInterrupt:
        cut_short, interrupted = cut_short or "interrupted", True
    note = f"{source}; stopped early: {cut_short}" if cut_short else source
    recording, quality = devices.recording(trial.name, note), devices.quality(loop.rate, pace.overruns)
    return TrialRun(recording, cut_short, device_lost, interrupted, switched_off, quality)


def _drive(devices: Devices, trial: Trial, loop: Loop, limits: Limits, pace: Pace) -> None:
    """Step until the trial is over.

    While a reply is missing the loop is not stepped and the last force is held, until `Limits.silence` is over.

    Raises:
        LimitError: the robot left the limits.
        DeviceError: a device is silent, broken or gone.
    """
    known = devices.begin()
    loop.reset(0.0, known)
    rest = np.zeros(4)
    force = 0.0
    silent_since: float | None = None
    begin = now = pace.begin()
    while now - begin < trial.duration:
        t = now - begin
        measured = devices.sense()
        known = np.where(np.isnan(measured), known, measured)
        _check_silence(devices.imu.age(now), "message from the IMU", limits.silence)
        if silent_since is not None:
            _check_silence(now - silent_since, "reply from the motor", limits.silence)
        limits.check(x=known[0], theta=known[1], x_dot=known[2])
        if silent_since is None:
            force = limits.cut(loop.step(t, measured, rest if trial.reference is None else trial.reference(t)))
        if devices.push(force):
            silent_since = None
        elif silent_since is None:
            silent_since = now
        now = pace.wait()
    devices.sense()  # the pitch after the last command


def _check_silence(age: float, what: str, longest: float) -> None:
    if age > longest:
        raise DeviceError(f"no {what} for {1e3 * age:.0f} ms; check its supply and cable")
