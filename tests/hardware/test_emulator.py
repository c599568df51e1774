"""`target=hardware` from end to end, against the emulator in a process of its own. Nothing here is real hardware.

The loop keeps real time here: a machine that stops it for a quarter of a second lets the robot fall, which says nothing
about the loop. Such tests are repeated; `fake_lines.FakeClock` serves all that can be shown without real time.
"""

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest
import yaml
from hardware.fake_lines import BALANCING, Feedback

from wipx.app import configuration_folder
from wipx.config import build
from wipx.core.errors import InputError
from wipx.core.recording import Recording
from wipx.hardware.robot import HardwareTarget
from wipx.hardware.target import Trial

GENEROUS = {"silence": 2.0}  # [s] the machine that runs the tests may be busy
PATIENT = {"reply_within": 0.05}  # [s]

real_time = pytest.mark.flaky(reruns=5, reruns_delay=2)


@dataclass(frozen=True)
class Emulated:
    """A running emulator and the target that leads to it."""

    process: subprocess.Popen[str]
    target: HardwareTarget

    def tell(self, line: str) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline() == "done\n"


@pytest.fixture
def start() -> Iterator[Callable[..., Emulated]]:
    processes = []

    def started(*options: str, limits: dict | None = None) -> Emulated:
        command = [sys.executable, "-m", "wipx.hardware.emulator", *options]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        processes.append(process)
        assert process.stdout is not None
        line = process.stdout.readline()
        given = dict(word.lstrip("+").split("=", 1) for word in line.split())
        node = yaml.safe_load((configuration_folder() / "target" / "hardware.yaml").read_text())
        node["can"] |= {"interface": "slcan", "channel": given["target.can.channel"], "sleep_after_open": 0.0}
        node["imu"] |= {"port": given["target.imu.port"]}
        node["limits"] |= GENEROUS if limits is None else limits
        node |= {"motor": node["motor"] | PATIENT, "emulated": True}
        node["weights"] = {"heavy": {"mass": 0.8, "height": 0.45, "side": -0.1}}
        return Emulated(process, build(node, "target"))

    yield started
    for process in processes:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            pipe.close()


@pytest.fixture
def operator(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[str], None]], list[str]]:
    """Lets a function answer in place of a person; gives the list of what was asked."""

    def answer(act: Callable[[str], None] = lambda request: None) -> list[str]:
        asked = []

        def answered(request: str) -> str:
            asked.append(request)
            act(request)
            return ""

        monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
        monkeypatch.setattr("builtins.input", answered)
        return asked

    return answer


def trials(emulated: Emulated, loop: Feedback, *plan: Trial) -> Iterator[Recording]:
    return emulated.target.run(plan, loop, np.random.default_rng(0))


@real_time
@pytest.mark.parametrize("options", [(), pytest.param(("--lines=pty",), marks=pytest.mark.slow)])
def test_the_robot_balances_at_the_end_of_both_lines(start, operator, options: tuple[str, ...]):
    emulated = start(*options, "--pitch", "0.03")
    asked = operator()
    (recording,) = trials(emulated, Feedback(BALANCING), Trial("r", 1.5, pitch=0.03))
    assert asked == [
        "trial r: no load on the robot; hold it still at pitch +0.030 rad with room to both sides, "
        "press Enter and let go: "
    ]
    assert recording.source.startswith("emulated hardware: slcan")
    assert recording.duration == pytest.approx(1.5, abs=0.3)
    assert recording["theta"][0] == pytest.approx(0.03, abs=0.01)
    settled = recording.between(1.0, 2.0)["theta"]
    assert np.abs(settled).max() < 0.02  # left alone it would have fallen: it doubles every 0.15 s
    assert np.ptp(recording["x"]) > 0.03
    assert np.ptp(recording["u_measured"]) > 1.0


@real_time
def test_the_operator_is_asked_again_until_the_robot_is_held_right(start, operator):
    emulated = start()

    def act(request: str) -> None:
        if "its pitch is" in request:
            emulated.tell("load 0.8 0.45 -0.1")
            emulated.tell("pitch -0.05")

    asked = operator(act)
    (recording,) = trials(emulated, Feedback(BALANCING), Trial("r", 0.1, load="heavy", pitch=-0.05))
    assert "load heavy (0.8 kg, 0.45 m high) on the robot" in asked[0]
    assert "trial r: its pitch is" in asked[1]
    assert len(asked) == 2
    assert recording["theta"][0] == pytest.approx(-0.05, abs=0.01)


class Stopping(Feedback):
    """Sends the emulator a signal in its second trial."""

    def __init__(self, process: subprocess.Popen[str], number: signal.Signals) -> None:
        super().__init__(BALANCING)
        self.resets = 0
        self._process, self._signal = process, number

    def reset(self, t: float, measured: np.ndarray) -> None:
        super().reset(t, measured)
        self.resets += 1
        self.steps = 0

    def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        if self.resets == 2 and self.steps == 30:
            self._process.send_signal(self._signal)
        return super().step(t, measured, reference)


@real_time
@pytest.mark.parametrize(
    ("number", "reason"),
    [
        (signal.SIGKILL, "is lost"),
        pytest.param(
            signal.SIGSTOP, "no (reply from the motor|message from the IMU) for .* ms", marks=pytest.mark.slow
        ),
    ],
)
def test_hardware_that_dies_ends_the_trials_with_one_line_and_what_was_recorded_is_kept(
    start, operator, capsys: pytest.CaptureFixture[str], number: signal.Signals, reason: str
):
    emulated = start("--pitch", "0.02", limits={"silence": 1.0})
    operator()
    running = trials(
        emulated,
        Stopping(emulated.process, number),
        *(Trial(name, seconds, pitch=0.02) for name, seconds in (("first", 0.3), ("second", 9.0), ("third", 0.3))),
    )
    assert next(running).name == "first"
    cut_short = next(running)
    assert len(cut_short) >= 20
    assert cut_short.duration < 2.0
    assert "stopped early: " in cut_short.source
    with pytest.raises(InputError, match=f"trial second: stopped: .*{reason}") as caught:
        next(running)
    assert "\n" not in str(caught.value)
    assert "the motor has not confirmed that it is off" in capsys.readouterr().err


@real_time
def test_a_silent_imu_is_told_before_the_robot_moves(start, operator):
    emulated = start()
    operator(lambda request: emulated.process.send_signal(signal.SIGSTOP))
    with pytest.raises(InputError, match=r"trial r: 0 good and 0 damaged messages from the IMU in 0\.3 s; check"):
        next(trials(emulated, Feedback(BALANCING), Trial("r", 1.0)))


def test_the_emulator_ends_with_its_input_and_listens_here_only(start):
    emulated = start()
    assert str(emulated.target.can["channel"]).startswith("socket://127.0.0.1:")
    assert str(emulated.target.imu["port"]).startswith("socket://127.0.0.1:")
    assert emulated.process.stdin is not None
    emulated.process.stdin.close()
    assert emulated.process.wait(20) == 0


def test_the_drivers_are_not_imported_until_hardware_is_asked_for():
    command = "import sys, wipx.app; print([n for n in ('can', 'cantools', 'serial') if n in sys.modules])"
    assert subprocess.run([sys.executable, "-c", command], capture_output=True, text=True).stdout == "[]\n"
