"""Emulated hardware: `python -m wipx.hardware.emulator` is a robot behind a CAN adapter and a serial IMU.

It prints the overrides that `target=hardware` needs to reach it and runs until its input ends (Ctrl-D). Lines of its
input change the robot: `pitch 0.05` [rad] is where it is held, `load 0.8 0.45 0.03` puts a mass [kg] at a height and a
side [m] on it, `load 0 0 0` takes it off. It listens on this computer only.
"""

import argparse
import os
import select
import socket
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict

import numpy as np

from wipx.core.load import Load
from wipx.core.model import Model
from wipx.core.plant import plant_of
from wipx.hardware.emulated_devices import EmulatedImu, EmulatedMotor, EmulatedRobot, Surroundings
from wipx.hardware.mit_protocol import Ranges

# Of conf/target/hardware.yaml.
PARAMETERS = {
    "body_mass": 5.0,
    "wheel_mass": 1.2,
    "com_height": 0.35,
    "body_inertia": 0.15,
    "wheel_inertia": 0.0023,
    "wheel_radius": 0.0625,
}
START_ANGLE = 12.4  # [rad] of the wheel: it soon crosses the end of its range
DEFAULTS = Surroundings(friction=1.0, damping=1.0, pitch_damping=0.02, angle_noise=4e-4, rate_noise=3e-3)
CHUNK = 4096


class Line:
    """One end of a line: a TCP port that takes one caller at a time, or a pseudo-terminal."""

    def __init__(self, *, pseudo_terminal: bool) -> None:
        self._listening: socket.socket | None = None
        self._caller: socket.socket | None = None
        self._terminal: tuple[int, int] | None = None
        if pseudo_terminal:
            self._terminal = _open_pseudo_terminal()
            self.name = os.ttyname(self._terminal[1])
        else:
            self._listening = socket.create_server(("127.0.0.1", 0))
            self.name = f"socket://127.0.0.1:{self._listening.getsockname()[1]}"

    @property
    def waits_for(self) -> list[int]:
        """File numbers that become readable when something comes."""
        ends = (self._listening, self._caller)
        return [self._terminal[0]] if self._terminal else [end.fileno() for end in ends if end is not None]

    def read(self, ready: Sequence[int]) -> bytes:
        """What has come; a new caller takes the place of the old one."""
        if self._listening is not None and self._listening.fileno() in ready:
            self._caller = self._listening.accept()[0]
            self._caller.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._caller.setblocking(False)
            return b""
        if self._terminal and self._terminal[0] in ready:
            return os.read(self._terminal[0], CHUNK)
        if self._caller is not None and self._caller.fileno() in ready:
            try:
                data = self._caller.recv(CHUNK)
            except OSError:
                data = b""
            if not data:
                self._caller.close()
                self._caller = None
            return data
        return b""

    def write(self, data: bytes) -> None:
        """Send; without a reader the data are lost, as on a serial line."""
        try:
            if self._terminal:
                os.write(self._terminal[0], data)
            elif self._caller is not None:
                self._caller.send(data)
        except OSError:
            return


def _open_pseudo_terminal() -> tuple[int, int]:
    import pty  # not on every platform
    import tty

    master, slave = pty.openpty()  # the slave stays open, so that the master survives a caller that leaves
    tty.setraw(master)
    tty.setraw(slave)
    os.set_blocking(master, False)
    return master, slave


class SerialCan:
    """The slcan protocol (Lawicel) of a CAN adapter, over the frames of one motor."""

    def __init__(self, frame: Callable[[int, bytes, float], tuple[int, bytes] | None]) -> None:
        self._frame = frame
        self._pending = b""

    def receive(self, data: bytes, now: float) -> bytes:
        """The adapter's answers, and the frames that come from the bus."""
        *lines, self._pending = (self._pending + data).split(b"\r")
        return b"".join(self._answer(line, now) for line in lines)

    def _answer(self, line: bytes, now: float) -> bytes:
        if line[:1] != b"t":
            return {b"V": b"V1013\r", b"N": b"NA123\r", b"F": b"F00\r"}.get(line[:1], b"\r")
        try:
            frame_id, length = int(line[1:4], 16), int(line[4:5])
            data = bytes.fromhex(line[5 : 5 + 2 * length].decode())
        except ValueError:
            return b"\a"
        reply = self._frame(frame_id, data, now)
        return b"z\r" + (b"" if reply is None else f"t{reply[0]:03X}{len(reply[1])}{reply[1].hex()}\r".encode())


class Emulator:
    """Robot, motor, IMU and their lines.

    Args:
        model: Of the robot without load.
        surroundings: What its owner may not know.
        pitch: At which it is held [rad].
        rng: Draws the noise.
        pseudo_terminal: Whether the lines are pseudo-terminals, not TCP ports.
    """

    def __init__(
        self,
        model: Model,
        surroundings: Surroundings,
        pitch: float,
        rng: np.random.Generator,
        *,
        pseudo_terminal: bool,
    ) -> None:
        now = time.perf_counter()
        self.model = model
        self.robot = EmulatedRobot(model, surroundings, pitch, now)
        self.can = Line(pseudo_terminal=pseudo_terminal)
        self.serial = Line(pseudo_terminal=pseudo_terminal)
        self.adapter = SerialCan(EmulatedMotor(self.robot, Ranges(), 1, 0, START_ANGLE).frame)
        self.imu = EmulatedImu(self.robot, surroundings, rng, now)

    def overrides(self) -> str:
        """What `python -m wipx` is given to reach it."""
        can = f"target.can.interface=slcan target.can.channel={self.can.name} +target.can.sleep_after_open=0.0"
        return f"target=hardware target.emulated=true {can} target.imu.port={self.serial.name}"

    def run(self) -> None:
        """Until the input ends."""
        commands = b""
        due = time.perf_counter()
        while True:
            now = time.perf_counter()
            if now >= due:
                self.serial.write(self.imu.message(now))
                due = max(due + self.imu.period, now)
            waiting = [0, *self.can.waits_for, *self.serial.waits_for]
            ready = select.select(waiting, [], [], max(0.0, due - time.perf_counter()))[0]
            if 0 in ready:
                data = os.read(0, CHUNK)
                if not data:
                    return
                *lines, commands = (commands + data).split(b"\n")
                for line in lines:
                    print(self._obey(line.decode(errors="replace").split()), flush=True)
            data = self.can.read(ready)
            if data:
                self.can.write(self.adapter.receive(data, time.perf_counter()))
            data = self.serial.read(ready)
            if data:
                self.serial.write(self.imu.receive(data))

    def _obey(self, words: list[str]) -> str:
        """Change the robot as a line of the input says; the answer."""
        try:
            numbers = [float(word) for word in words[1:]]
            if words[:1] == ["pitch"]:
                (self.robot.pitch,) = numbers
            elif words[:1] == ["load"]:
                self.robot.carry(Load(*numbers).on(self.model))
            else:
                raise ValueError
        except (ValueError, TypeError):
            return "expected: pitch RADIANS, or load MASS HEIGHT SIDE"
        if self.robot.held:
            self.robot.hold()
        return "done"


def main() -> None:
    """Run the emulator that the command line describes."""
    parser = argparse.ArgumentParser(prog="python -m wipx.hardware.emulator", description=__doc__)
    parser.add_argument("--pty", action="store_true", help="pseudo-terminals, as a USB adapter shows, in place of TCP")
    parser.add_argument("--pitch", type=float, default=0.0, help="at which the robot is held [rad]")
    parser.add_argument("--seed", type=int, help="of the noise")
    for name, default in asdict(DEFAULTS).items():
        parser.add_argument(f"--{name.replace('_', '-')}", type=float, default=default, help=f"default {default:g}")
    given = vars(parser.parse_args())
    surroundings = Surroundings(**{name: given[name] for name in asdict(DEFAULTS)})
    plant = plant_of("wip")
    model = Model(plant, plant.complete(PARAMETERS, "emulator"), {})
    rng = np.random.default_rng(given["seed"])
    emulator = Emulator(model, surroundings, given["pitch"], rng, pseudo_terminal=given["pty"])
    print(emulator.overrides(), flush=True)
    try:
        emulator.run()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
