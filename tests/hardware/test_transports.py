"""One suite over all ways to a CAN bus that need no CAN hardware, with the same motor at their ends.

In `virtual` the motor is a thread of this process, else a process of its own (`wipx.hardware.emulator`).
"""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
import yaml
from hardware.fake_lines import BALANCING, QUIET, WIP, Feedback

from wipx.app import configuration_folder
from wipx.config import build
from wipx.hardware.can_motor import BUS_LOST, CanMotor, MotorSettings, open_bus
from wipx.hardware.emulated_devices import EmulatedMotor, EmulatedRobot
from wipx.hardware.emulated_hardware import EmulatedHardware, emulator
from wipx.hardware.mit_protocol import Ranges
from wipx.hardware.safety import DeviceError
from wipx.hardware.target import Trial
from wipx.hardware.trial_logs import LoggedBus

TRANSPORTS = ("virtual", "slcan", "pty", "socketcand")  # slcan on TCP, pty: slcan on a pseudo-terminal
SETTINGS = MotorSettings(reply_within=0.5)  # [s] the machine that runs the tests may be busy
TORQUE = 0.3  # [N m]
real_time = pytest.mark.flaky(reruns=5, reruns_delay=2)


@dataclass(frozen=True)
class End:
    """The motor's end of a line: how to reach it, and how to make it die."""

    can: dict[str, Any]
    die: Callable[[], None]


def _virtual() -> Iterator[End]:
    settings: dict[str, Any] = {"interface": "virtual", "channel": f"motor {time.perf_counter()}"}
    bus, over = can.Bus(**settings), threading.Event()
    motor = EmulatedMotor(EmulatedRobot(WIP, QUIET, 0.0, time.perf_counter()), Ranges(), 1, 0, 12.4)

    def answer() -> None:
        while not over.is_set():
            frame = bus.recv(0.02)
            if frame is None:
                continue
            reply = motor.frame(frame.arbitration_id, bytes(frame.data), time.perf_counter())
            if reply is not None:
                bus.send(can.Message(arbitration_id=reply[0], data=reply[1], is_extended_id=False))

    thread = threading.Thread(target=answer)
    thread.start()

    def die() -> None:
        over.set()
        thread.join()

    yield End(settings, die)
    die()
    bus.shutdown()


def _process(lines: str) -> Iterator[End]:
    if lines == "pty":
        pytest.importorskip("pty", reason="this platform has no pseudo-terminals")
    with emulator([f"--lines={lines}"]) as hands:
        yield End(hands.can, hands.kill)


@pytest.fixture(params=TRANSPORTS)
def end(request: pytest.FixtureRequest) -> Iterator[End]:
    yield from _virtual() if request.param == "virtual" else _process(request.param)


@pytest.fixture
def bus(end: End) -> Iterator[LoggedBus]:
    opened = LoggedBus(open_bus(end.can, SETTINGS.master_id))
    yield opened
    with suppress(*BUS_LOST):
        opened.shutdown()


@real_time
def test_a_motor_is_switched_on_turned_logged_and_lost_in_the_same_way(
    end: End, bus: LoggedBus, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("wipx.hardware.can_motor.PATIENCE", 0.5)
    motor = CanMotor(bus, SETTINGS, Ranges())
    with bus.logging_to(tmp_path / "r.asc"):
        motor.enter()
        begin = motor.angle
        bus.send(can.Message(arbitration_id=7, data=bytes(8), is_extended_id=False))  # for somebody else
        asked, reported = [], []
        for _ in range(20):
            asked.append(motor.command(TORQUE).torque)
            reply = motor.reply()
            assert reply is not None
            reported.append(reply.torque)
            time.sleep(0.002)
        assert motor.exit()
    # A reply shows the torque of the command before.
    np.testing.assert_allclose(reported[1:], asked[:-1], atol=24.0 / 4095.0)
    assert motor.angle > begin
    with can.LogReader(tmp_path / "r.asc") as reader:
        frames = list(reader)
    sent = [frame.data for frame in frames if not frame.is_rx and frame.arbitration_id == SETTINGS.id]
    assert len([frame for frame in frames if frame.is_rx]) == len(sent) == 24  # two to switch on, two to switch off
    assert np.all(np.diff([frame.timestamp for frame in frames]) >= 0.0)
    monkeypatch.setattr("wipx.hardware.can_motor.PATIENCE", 0.01)
    end.die()
    with pytest.raises(DeviceError, match=r"no reply from motor 1|the CAN bus is lost"):
        motor.enter()
    assert not motor.exit()


@real_time
@pytest.mark.parametrize(
    "lines", ["socketcand", pytest.param("slcan", marks=pytest.mark.slow), pytest.param("pty", marks=pytest.mark.slow)]
)
def test_a_robot_behind_the_emulator_is_set_up_by_its_hands_and_leaves_frames_and_quality(lines: str, tmp_path: Path):
    node = yaml.safe_load((configuration_folder() / "target" / "emulated_hardware.yaml").read_text())
    target: EmulatedHardware = build({**node, "lines": lines, "logs": str(tmp_path)}, "target")
    trial = Trial("heavy.csv", 0.4, load="a1", pitch=-0.02)
    (recording,) = target.run([trial], Feedback(BALANCING), np.random.default_rng(0))
    assert recording.source.startswith("emulated hardware")
    assert recording["theta"][0] == pytest.approx(-0.02, abs=0.01)
    quality = json.loads((tmp_path / "heavy_loop.json").read_text())
    assert quality["steps"] == len(recording) + 1
    assert quality["period_error"].keys() == {"p50", "p99", "p100"}
    assert (tmp_path / "heavy_loop.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "heavy.asc").stat().st_size > 0


def test_an_emulator_that_cannot_start_is_one_line():
    command = [sys.executable, "-m", "wipx.hardware.emulator", "--parameter=body_mass=heavy"]
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    assert done.returncode == 2
    assert "body_mass=heavy" in done.stderr
    assert "Traceback" not in done.stderr
