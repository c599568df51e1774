"""What faults of devices, lines and program come to; the table of docs/hardware.md is made here.

`python -m pytest tests/hardware/test_faults.py --update-docs` writes it.
"""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path

import can
import numpy as np
import pytest
from hardware.fake_lines import BALANCING, Bench, FakeClock, Feedback

from wipx.hardware.can_motor import CanMotor, MotorSettings
from wipx.hardware.devices import Devices, Drivetrain
from wipx.hardware.mit_protocol import EXIT, MitProtocol, Ranges
from wipx.hardware.run import TrialRun, run_trial
from wipx.hardware.safety import Limits
from wipx.hardware.target import Trial
from wipx.hardware.trial_logs import LoggedBus
from wipx.tasks.files.results import BEGIN, END, replace_table

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "hardware.md"
LIMITS = Limits(force=30.0, pitch=0.5, rail=0.4, speed=2.0, silence=0.1)
DURATION, PERIOD = 0.5, 0.005  # [s]
FIRST = 42  # frame from which lasting faults are there: two switch the motor on, then 0.2 s of the loop
ERROR_FRAME = can.Message(is_error_frame=True, is_extended_id=False)
Change = Callable[[int, can.Message], list[can.Message]]


@dataclass(frozen=True)
class Outcome:
    """What became of a trial: how it ended, whether the motor confirmed that it is off, and what is there of it."""

    end: str
    motor: str
    left: str

    @classmethod
    def of(cls, run: TrialRun) -> "Outcome":
        assert run.quality is not None
        assert run.recording is not None
        assert all(np.isfinite(values).all() for values in run.recording.columns.values())
        left = [f"recording of {run.recording.duration:.2f} s"]
        if run.quality.lost_replies:
            left.append(f"rows of the motor interpolated: {len(run.quality.lost_replies)}")
        if run.quality.damaged_messages:
            left.append(f"messages of the IMU refused: {run.quality.damaged_messages}")
        if run.quality.overruns:
            left.append(f"steps skipped: {run.quality.skipped}")
        motor = "off, confirmed" if run.switched_off else "not confirmed: the operator is told to cut its power"
        return cls(run.end, motor, ", ".join(left))


def replies(bench: Bench, change: Change) -> None:
    """Put others in the place of the replies to each frame that is sent."""
    send, number = bench.bus.send, count()

    def changed(msg: can.Message, timeout: float | None = None) -> None:
        send(msg, timeout)
        k = next(number)
        bench.bus.waiting = [frame for reply in bench.bus.waiting for frame in change(k, reply)]

    bench.bus.send = changed


def before_frame(bench: Bench, act: Callable[[int], None]) -> None:
    """Do something before each frame that is sent."""
    send, number = bench.bus.send, count()

    def acted(msg: can.Message, timeout: float | None = None) -> None:
        act(next(number))
        send(msg, timeout)

    bench.bus.send = acted


def altered(reply: can.Message, data: bytearray) -> can.Message:
    return can.Message(arbitration_id=reply.arbitration_id, data=data, is_extended_id=False)


def silent_motor(bench: Bench) -> None:
    replies(bench, lambda k, reply: [reply] if k < FIRST else [])


def silent_for_a_while(bench: Bench) -> None:
    replies(bench, lambda k, reply: [] if FIRST <= k < FIRST + 4 else [reply])


def dropped_replies(bench: Bench) -> None:
    replies(bench, lambda k, reply: [] if k % 10 == 9 else [reply])


def truncated_replies(bench: Bench) -> None:
    replies(bench, lambda k, reply: [altered(reply, reply.data[:3])] if k % 10 == 9 else [reply])


def error_frames(bench: Bench) -> None:
    replies(bench, lambda k, reply: [ERROR_FRAME, reply])


def late_replies(bench: Bench) -> None:
    def stall(k: int) -> None:
        bench.bus.stalled = FIRST <= k < FIRST + 4

    before_frame(bench, stall)


def motor_error(bench: Bench) -> None:
    replies(bench, lambda k, reply: [altered(reply, reply.data[:7] + b"\x02")] if k == FIRST else [reply])


def bus_off(bench: Bench) -> None:
    def lose(k: int) -> None:
        if k == FIRST:
            bench.bus.broken = can.CanOperationError("bus off")

    before_frame(bench, lose)


def stale_imu(bench: Bench) -> None:
    def silence(k: int) -> None:
        bench.port.silent = k >= FIRST

    before_frame(bench, silence)


def damaged_imu(bench: Bench) -> None:
    read, number = bench.port.read, count()

    def damaged(size: int) -> bytes:
        message = bytearray(read(size))
        if message and next(number) % 10 == 9:
            message[20] ^= 0x10
        return bytes(message)

    bench.port.read = damaged


def late_step(bench: Bench) -> None:
    def stall(k: int) -> None:
        if k == FIRST:
            time.sleep(4.2 * PERIOD)

    before_frame(bench, stall)


def beyond_the_rail(bench: Bench) -> None:
    def shove(k: int) -> None:
        if k == FIRST:
            bench.robot._x += 0.5

    before_frame(bench, shove)


def interrupted(bench: Bench) -> None:
    def interrupt(k: int) -> None:
        if k == FIRST:
            os.kill(os.getpid(), signal.SIGINT)

    before_frame(bench, interrupt)


FAULTS: dict[str, Callable[[Bench], None]] = {
    "the motor falls silent": silent_motor,
    "the motor is silent for 4 steps": silent_for_a_while,
    "one reply in ten is dropped": dropped_replies,
    "one reply in ten is cut off": truncated_replies,
    "an error frame before every reply": error_frames,
    "four replies come late, all at once": late_replies,
    "the motor reports an error": motor_error,
    "the bus is off": bus_off,
    "the IMU falls silent": stale_imu,
    "one message of the IMU in ten is damaged": damaged_imu,
    "the computer stalls for four periods": late_step,
    "the robot leaves the rail": beyond_the_rail,
    "Ctrl-C": interrupted,
}
GOES_ON = {
    "the motor is silent for 4 steps",
    "one reply in ten is dropped",
    "one reply in ten is cut off",
    "an error frame before every reply",
    "four replies come late, all at once",
    "one message of the IMU in ten is damaged",
    "the computer stalls for four periods",
}
KILLED = "the program is killed (SIGKILL)"
KILLED_TRIAL = f"""
import os, signal, sys, time
from pathlib import Path
from hardware.test_faults import before_frame, logged
from hardware.fake_lines import Bench, FakeClock

fake = FakeClock()
time.perf_counter, time.sleep = fake.perf_counter, fake.sleep
bench = Bench(pitch=0.02)
before_frame(bench, lambda k: os.kill(os.getpid(), signal.SIGKILL) if k == {FIRST} else None)
logged(bench, Path(sys.argv[1]))
"""


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    fake = FakeClock()
    monkeypatch.setattr("time.perf_counter", fake.perf_counter)
    monkeypatch.setattr("time.sleep", fake.sleep)


def ran(bench: Bench) -> TrialRun:
    loop = Feedback(BALANCING, rate=1.0 / PERIOD)
    return run_trial(bench.devices, Trial("r", DURATION), loop, LIMITS, priority=0, source="fake")


def logged(bench: Bench, path: Path) -> TrialRun:
    """A trial whose frames are logged."""
    settings = MotorSettings(reply_within=0.002)
    bus = LoggedBus(bench.bus)
    bench.devices = Devices(CanMotor(bus, settings, Ranges()), bench.imu, Drivetrain(0.0625, 1, on_body=False))
    with bus.logging_to(path):
        return ran(bench)


def faulty(name: str) -> tuple[Bench, TrialRun]:
    bench = Bench(pitch=0.02)
    FAULTS[name](bench)
    return bench, ran(bench)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_ends_the_trial_or_is_survived_and_leaves_a_valid_recording(clock: None, name: str):
    bench, run = faulty(name)
    assert (run.cut_short is None) == (name in GOES_ON)
    assert Outcome.of(run).end == run.end
    assert run.recording is not None
    assert run.recording.duration == pytest.approx(DURATION if name in GOES_ON else 0.2, abs=0.11)
    assert EXIT in bench.bus.sent  # the motor was told to switch off, whatever happened
    if name != "the bus is off":
        protocol = MitProtocol(Ranges(), 1, 0)
        assert abs(protocol.torque_of(bench.bus.sent[-2])) < 0.01


def killed(path: Path) -> Outcome:
    """A killed program leaves a CAN log that ends where it was killed."""
    there = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "tests"), str(ROOT)])}
    status = subprocess.run([sys.executable, "-c", KILLED_TRIAL, str(path)], env=there, check=False).returncode
    assert status == -signal.SIGKILL
    with can.LogReader(path) as reader:
        frames = [frame for frame in reader if not frame.is_rx]
    assert len(frames) == FIRST
    assert bytes(frames[-1].data) != EXIT
    return Outcome(
        "it is over", "not told: it does what its firmware does without commands", f"CAN log, {FIRST} commands"
    )


def outcomes(folder: Path) -> Iterator[tuple[str, Outcome]]:
    for name in FAULTS:
        yield name, Outcome.of(faulty(name)[1])
    yield KILLED, killed(folder / "killed.asc")


@pytest.mark.slow
def test_the_table_of_the_documentation_is_what_happens(clock: None, request: pytest.FixtureRequest, tmp_path: Path):
    head = ("| fault | the trial | the motor | what is left |", "| --- | --- | --- | --- |")
    rows = [f"| {name} | {one.end} | {one.motor} | {one.left} |" for name, one in outcomes(tmp_path)]
    table = "\n".join((*head, *rows))
    if request.config.getoption("--update-docs"):
        replace_table(PAGE, table)
    written = PAGE.read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0].strip()
    assert written == table, "write it with python -m pytest tests/hardware/test_faults.py --update-docs"


def test_a_log_holds_every_frame_in_both_directions_and_is_read_by_the_import(clock: None, tmp_path: Path):
    bench = Bench(pitch=0.02)
    run = logged(bench, tmp_path / "r.asc")
    assert run.recording is not None
    with can.LogReader(tmp_path / "r.asc") as reader:
        frames = list(reader)
    assert [bytes(frame.data) for frame in frames if not frame.is_rx] == bench.bus.sent
    protocol = MitProtocol(Ranges(), 1, 0)
    forces = [protocol.torque_of(bytes(frame.data)) / 0.0625 for frame in frames if not frame.is_rx][2:-2]
    np.testing.assert_allclose(forces[:-1], run.recording["u"], atol=1e-9)
