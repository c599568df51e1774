"""Emulated hardware: `python -m wipx.hardware.emulator` is a robot behind a CAN adapter and a serial IMU.

It prints the overrides that `target=hardware` needs to reach it and runs until its input ends (Ctrl-D). Lines of its
input change the robot: `pitch 0.05` [rad] is where it is held, `load 0.8 0.45 0.03` puts a mass [kg] at a height and a
side [m] on it, `load 0 0 0` takes it off. It listens on this computer only.
"""

import argparse
import os
import select
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from wipx.core.errors import InputError
from wipx.core.load import Load
from wipx.core.model import Model
from wipx.core.plant import plant_of
from wipx.hardware.emulated_devices import EmulatedImu, EmulatedMotor, EmulatedRobot, Surroundings
from wipx.hardware.emulated_lines import CHUNK, CanProtocol, Line, SerialCan, SocketCan
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
LINES = ("slcan", "socketcand", "pty")


class Emulator:
    """Robot, motor, IMU and their lines.

    Args:
        model: Of the robot without load.
        surroundings: What its owner may not know.
        pitch: At which it is held [rad].
        rng: Draws the noise.
        lines: How it is reached: "slcan" or "socketcand" on TCP ports, "pty" for slcan on pseudo-terminals.
    """

    def __init__(
        self,
        model: Model,
        surroundings: Surroundings,
        pitch: float,
        rng: np.random.Generator,
        *,
        lines: str,
    ) -> None:
        now = time.perf_counter()
        self.model = model
        self.robot = EmulatedRobot(model, surroundings, pitch, now)
        frame = EmulatedMotor(self.robot, Ranges(), 1, 0, START_ANGLE).frame
        self.adapter: CanProtocol = SocketCan(frame) if lines == "socketcand" else SerialCan(frame)
        self.can = Line(pseudo_terminal=lines == "pty", greeting=self.adapter.greeting)
        self.serial = Line(pseudo_terminal=lines == "pty")
        self.imu = EmulatedImu(self.robot, surroundings, rng, now)

    def overrides(self) -> str:
        """What `python -m wipx` is given to reach it."""
        if isinstance(self.adapter, SocketCan):
            host, port = self.can.name.removeprefix("socket://").split(":")
            reached = f"+target.can.host={host} +target.can.port={port}"
            can = f"target.can.interface=socketcand target.can.channel=can0 {reached}"
        else:
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


def _numbers(given: list[str]) -> Mapping[str, float]:
    """Parameters of the command line, by name.

    Raises:
        InputError: one is no NAME=NUMBER.
    """
    numbers = {}
    for text in given:
        name, _, value = text.partition("=")
        try:
            numbers[name] = float(value)
        except ValueError as error:
            raise InputError(f"--parameter {text}, expected NAME=NUMBER") from error
    return numbers


def main() -> None:
    """Run the emulator that the command line describes."""
    parser = argparse.ArgumentParser(prog="python -m wipx.hardware.emulator", description=__doc__)
    said = "slcan and socketcand listen on TCP ports, pty is slcan on a pseudo-terminal, as a USB adapter shows"
    parser.add_argument("--lines", choices=LINES, default="slcan", help=said)
    parser.add_argument("--parameter", action="append", default=[], metavar="NAME=VALUE", help="of the robot [SI]")
    parser.add_argument("--pitch", type=float, default=0.0, help="at which the robot is held [rad]")
    parser.add_argument("--seed", type=int, help="of the noise")
    for name, default in asdict(DEFAULTS).items():
        parser.add_argument(f"--{name.replace('_', '-')}", type=float, default=default, help=f"default {default:g}")
    given = vars(parser.parse_args())
    surroundings = Surroundings(**{name: given[name] for name in asdict(DEFAULTS)})
    plant = plant_of("wip")
    try:
        model = Model(plant, plant.complete({**PARAMETERS, **_numbers(given["parameter"])}, "emulator"), {})
    except InputError as error:
        parser.error(str(error))
    rng = np.random.default_rng(given["seed"])
    emulator = Emulator(model, surroundings, given["pitch"], rng, lines=given["lines"])
    print(emulator.overrides(), flush=True)
    try:
        emulator.run()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
