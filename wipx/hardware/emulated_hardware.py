"""`target=emulated_hardware`: the emulator of `wipx.hardware.emulator` as a robot, with hands that set it up.

It goes through what a real one does: lines, drivers, loop and limits, in real time, with a process of its own.
Its recordings are emulated, not real.
"""

import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

from wipx.control.loop import Loop
from wipx.core.errors import InputError
from wipx.core.load import Load
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.hardware.emulated_devices import Surroundings
from wipx.hardware.robot import HardwareTarget
from wipx.hardware.settings import settings_from
from wipx.hardware.target import Trial

ATTEMPTS = 5  # at setting the robot up
PATIENCE = 5.0  # [s] for the emulator to end
REPLY_WITHIN = 0.02  # [s] an emulator that shares the computer stalls for some 10 ms now and then


@dataclass(frozen=True)
class EmulatedHardware:
    """An emulator that is started for every run; a `wipx.hardware.target.Target`.

    Attributes:
        parameters: Of the unloaded robot, which its owner knows exactly (plant wip) [SI].
        limits: See `wipx.hardware.safety.Limits`.
        weights: Loads by name: mass [kg], height [m], side [m].
        concealed: What the owner's model lacks, see `Surroundings`.
        lines: What leads to it: "slcan" or "socketcand" on TCP ports, or "pty" for slcan on a pseudo-terminal.
        seed: Of the sensors' noise.
        priority: Of SCHED_FIFO, 1 to 99; 0 to go without.
        logs: Folder that takes the raw CAN log and the quality of the loop of every trial; None for nothing.
    """

    parameters: Mapping[str, float]
    limits: Mapping[str, object]
    weights: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    concealed: Mapping[str, object] = field(default_factory=dict)
    lines: Literal["slcan", "socketcand", "pty"] = "slcan"
    seed: int = 0
    priority: int = 0
    logs: str | None = None

    def __post_init__(self) -> None:
        self.surroundings()
        self._hardware({}, "nowhere")

    @property
    def emulated(self) -> bool:
        """It is."""
        return True

    @property
    def loads(self) -> Mapping[str, Load]:
        """See `Target`."""
        return self._hardware({}, "nowhere").loads

    @property
    def rail(self) -> float:
        """See `Target`."""
        return self._hardware({}, "nowhere").rail

    def nominal(self) -> Model:
        """See `Target`."""
        return self._hardware({}, "nowhere").nominal()

    def surroundings(self) -> Surroundings:
        """What the robot has that its owner's model lacks; for the record only, no identification may read it."""
        return settings_from(Surroundings, self.concealed, "target.concealed")

    def hidden(self) -> Mapping[str, tuple[float, str]]:
        """The same by the names of effects' parameters, each with its unit."""
        concealed = self.surroundings()
        return {
            "translation/coulomb.F_c": (concealed.friction, "N"),
            "translation/viscous.sigma": (concealed.damping, "N s/m"),
            "pitch/viscous.sigma": (concealed.pitch_damping, "N m s/rad"),
        }

    def run(self, trials: Sequence[Trial], loop: Loop, rng: np.random.Generator) -> Iterator[Recording]:
        """See `Target`; nothing is drawn.

        Raises:
            InputError: a trial cannot be done, or the emulator is lost.
            KeyboardInterrupt: a trial was interrupted; its recording has been yielded.
        """
        options = [f"--{name.replace('_', '-')}={value!r}" for name, value in asdict(self.surroundings()).items()]
        options += [f"--parameter={name}={value!r}" for name, value in self.parameters.items()]
        with emulator([f"--lines={self.lines}", f"--seed={self.seed}", *options]) as hands:
            yield from self._hardware(hands.can, hands.imu).run_by(hands, trials, loop)

    def _hardware(self, can: Mapping[str, Any], imu: str) -> HardwareTarget:
        return HardwareTarget(
            self.parameters,
            can,
            {"port": imu},
            self.limits,
            {"reply_within": REPLY_WITHIN},
            weights=self.weights,
            priority=self.priority,
            emulated=True,
            logs=self.logs,
        )


@contextmanager
def emulator(options: Sequence[str]) -> Iterator["EmulatorHands"]:
    """An emulator in a process of its own, ended with the block.

    Args:
        options: Of its command line.

    Raises:
        InputError: it does not start.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", "wipx.hardware.emulator", *options],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,  # Ctrl-C is for the loop, which switches the motor off first
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        yield EmulatorHands(process)
    finally:
        with suppress(OSError):  # it is gone
            process.stdin.close()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


class EmulatorHands:
    """Set the emulated robot up by lines of its emulator's input; an `Operator`.

    Args:
        process: The emulator, just started.

    Attributes:
        can: Arguments of `can.Bus`.
        imu: Port of the IMU.
    """

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process
        self._trial: Trial | None = None
        self._attempts = 0
        given = dict(word.lstrip("+").split("=", 1) for word in self._answer().split())
        self.imu = given.pop("target.imu.port")
        can = {key.removeprefix("target.can."): value for key, value in given.items() if key.startswith("target.can.")}
        self.can: dict[str, Any] = {**can, **{key: float(can[key]) for key in ("sleep_after_open",) if key in can}}
        if "port" in can:
            self.can |= {"port": int(can["port"]), "tcp_tune": True}

    def set_up(self, request: str, trial: Trial, load: Load | None) -> None:
        """See `Operator`.

        Raises:
            InputError: the emulator is lost, or does what it is told not.
        """
        self._attempts = self._attempts + 1 if trial is self._trial else 1
        self._trial = trial
        if self._attempts > ATTEMPTS:
            raise InputError(f"target=emulated_hardware: {request.partition(';')[0]} after {ATTEMPTS} attempts")
        carried = load or Load(0.0, 0.0, 0.0)
        self._tell(f"load {carried.mass} {carried.height} {carried.side}")
        self._tell(f"pitch {trial.pitch}")

    def kill(self) -> None:
        """End the emulator as a cut cable would."""
        self._process.kill()
        self._process.wait()

    def _tell(self, line: str) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"{line}\n")
            self._process.stdin.flush()
        except OSError as error:
            raise InputError("target=emulated_hardware: the emulator has ended; run the command again") from error
        self._answer()

    def _answer(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise InputError("target=emulated_hardware: the emulator has ended; run the command again")
        return line
