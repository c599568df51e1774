"""Trials of a robot on fake lines: what stops it, and that the motor is switched off whatever happens."""

import gc
import os
import re
import signal
import time

import can
import numpy as np
import pytest
from hardware.fake_lines import BALANCING, Bench, FakeClock, Feedback

from wipx.core.errors import InputError
from wipx.hardware.can_motor import MotorSettings
from wipx.hardware.devices import Drivetrain
from wipx.hardware.mit_protocol import ENTER, EXIT, MitProtocol, Ranges
from wipx.hardware.pace import Pace, undisturbed
from wipx.hardware.robot import HardwareTarget
from wipx.hardware.run import TrialRun, run_trial
from wipx.hardware.safety import Limits
from wipx.hardware.target import Trial

LIMITS = Limits(force=30.0, pitch=0.5, rail=0.4, speed=2.0, silence=1.0)
NO_TORQUE = MitProtocol(Ranges(), 1, 0).command()
RADIUS = 0.0625


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    fake = FakeClock()
    monkeypatch.setattr("time.perf_counter", fake.perf_counter)
    monkeypatch.setattr("time.sleep", fake.sleep)


def run(bench: Bench, loop: Feedback, limits: Limits = LIMITS, *, duration: float = 0.3) -> TrialRun:
    return run_trial(bench.devices, Trial("r", duration), loop, limits, priority=0, source="fake")


def assert_switched_off(bench: Bench) -> None:
    assert bench.bus.sent[-2:] == [NO_TORQUE, EXIT]


def lost_replies(result: TrialRun) -> int:
    assert result.quality is not None
    return len(result.quality.lost_replies)


def torques(bench: Bench) -> list[float]:
    protocol = MitProtocol(Ranges(), 1, 0)
    return [protocol.torque_of(frame) for frame in bench.bus.sent if frame not in (ENTER, EXIT)]


def test_a_trial_leaves_a_recording_as_the_contract_has_it():
    bench = Bench(pitch=0.03)
    loop = Feedback(BALANCING)
    result = run(bench, loop)
    assert result.cut_short is None
    assert result.switched_off
    assert_switched_off(bench)
    recording = result.recording
    assert recording is not None
    assert list(recording.columns) == ["t", "x", "theta", "x_dot", "theta_dot", "u", "u_measured"]
    assert all(np.isfinite(values).all() for values in recording.columns.values())
    assert recording.t[0] == 0.0
    assert np.all(np.diff(recording.t) > 0.0)
    assert recording["x"][0] == pytest.approx(0.0, abs=1e-4)  # wherever the wheel was; a step is 0.02 mm
    assert recording["theta"][0] == pytest.approx(0.03, abs=5e-3)
    # the reply to the next command shows the torque of this one, which this motor follows at once
    step = 24.0 / 4095.0 / RADIUS
    np.testing.assert_allclose(recording["u_measured"], recording["u"], atol=1.01 * step)


def test_every_row_is_the_robot_at_the_moment_of_its_command():
    bench = Bench(pitch=0.15)
    send, seen = bench.bus.send, []

    def watched(msg: can.Message, timeout: float | None = None) -> None:
        send(msg, timeout)
        now = time.perf_counter()
        seen.append((now, *bench.robot.state(now), bench.robot.force))

    bench.bus.send = watched
    recording = run(bench, Feedback(BALANCING), duration=0.25).recording
    assert recording is not None
    truth = np.array(seen)[2 : 2 + len(recording)]  # after the frames that switch the motor on
    np.testing.assert_allclose(recording.t, truth[:, 0] - truth[0, 0], atol=1e-5)
    np.testing.assert_allclose(recording["u"], truth[:, 5], atol=1e-9)
    assert np.ptp(recording["x"]) > 0.05
    # Steps of the protocol are 24 um and 2.3 mm/s; between messages of the IMU, 5 ms apart, the pitch bends.
    for column, (name, tolerance) in enumerate((("x", 3e-5), ("theta", 5e-5), ("x_dot", 3e-3), ("theta_dot", 0.03)), 1):
        np.testing.assert_allclose(recording[name], truth[:, column], atol=tolerance)


def test_a_command_beyond_the_limit_is_cut_and_recorded_as_sent():
    bench = Bench()
    limits = Limits(force=2.0, pitch=9.0, rail=9.0, speed=9.0, silence=1.0)
    result = run(bench, Feedback(np.zeros(4), push=50.0), limits, duration=0.05)
    assert result.recording is not None
    step = 24.0 / 4095.0 / RADIUS
    np.testing.assert_allclose(result.recording["u"], 2.0, atol=step)
    assert max(torques(bench)) <= 2.0 * RADIUS + step * RADIUS


@pytest.mark.parametrize(
    ("limits", "reason"),
    [
        (Limits(30.0, 0.1, 9.0, 9.0, 1.0), "pitch .* rad is beyond"),
        (Limits(30.0, 9.0, 0.02, 9.0, 1.0), "x .* m is beyond"),
        (Limits(30.0, 9.0, 9.0, 0.3, 1.0), "speed .* m/s is beyond"),
    ],
)
def test_a_limit_stops_the_robot_and_keeps_what_was_recorded(limits: Limits, reason: str):
    bench = Bench()
    result = run(bench, Feedback(np.zeros(4), push=20.0), limits, duration=5.0)
    assert result.cut_short is not None
    assert re.search(reason, result.cut_short)
    assert not result.device_lost
    assert_switched_off(bench)
    assert result.recording is not None
    assert result.recording.duration < 4.0
    assert result.cut_short in result.recording.source


def test_a_command_that_is_no_number_stops_the_robot():
    bench = Bench()
    result = run(bench, Feedback(np.full(4, np.nan)))
    assert result.cut_short == "the controller's command is nan"
    assert_switched_off(bench)


def test_a_fault_of_the_controller_stops_the_robot():
    class Faulty(Feedback):
        def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
            raise ZeroDivisionError

    bench = Bench()
    with pytest.raises(ZeroDivisionError):
        run(bench, Faulty(BALANCING))
    assert_switched_off(bench)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_stops_the_robot_even_when_it_comes_twice(number: signal.Signals):
    class Interrupted(Feedback):
        def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
            if self.steps == 5:
                os.kill(os.getpid(), number)
            return super().step(t, measured, reference)

    bench = Bench()
    send = bench.bus.send

    def impatient(msg: can.Message, timeout: float | None = None) -> None:
        if bytes(msg.data) == EXIT:
            os.kill(os.getpid(), number)
        send(msg, timeout)

    bench.bus.send = impatient
    before = signal.getsignal(number)
    result = run(bench, Interrupted(BALANCING))
    assert result.interrupted
    assert result.cut_short == "interrupted"
    assert result.recording is not None
    assert len(result.recording) >= 4
    assert_switched_off(bench)
    assert signal.getsignal(number) == before


def test_a_signal_during_the_switching_off_waits_for_it():
    bench = Bench()
    send = bench.bus.send

    def interrupted(msg: can.Message, timeout: float | None = None) -> None:
        if bytes(msg.data) == EXIT:
            os.kill(os.getpid(), signal.SIGINT)
        send(msg, timeout)

    bench.bus.send = interrupted
    result = run(bench, Feedback(BALANCING), duration=0.05)
    assert result.interrupted
    assert result.recording is not None
    assert_switched_off(bench)


class Cutting(Feedback):
    """Does something to the bench at its fifth step."""

    def __init__(self, bench: Bench, cut: str) -> None:
        super().__init__(np.zeros(4), push=3.0)
        self.bench = bench
        self.cut = cut

    def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        command = super().step(t, measured, reference)
        if self.steps == 5 and self.cut == "motor":
            self.bench.bus.silent = True
        if self.steps == 5 and self.cut == "imu":
            self.bench.port.silent = True
        if self.steps == 5 and self.cut == "bus":
            self.bench.bus.broken = can.CanOperationError("gone")
        return command + self.steps


@pytest.mark.parametrize(
    ("cut", "reason"),
    [("motor", "no reply from the motor"), ("imu", "no message from the IMU"), ("bus", "the CAN bus is lost")],
)
def test_a_device_that_falls_silent_ends_the_trial(cut: str, reason: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("wipx.hardware.can_motor.PATIENCE", 0.01)
    bench = Bench()
    limits = Limits(30.0, 9.0, 9.0, 9.0, 0.1)
    result = run(bench, Cutting(bench, cut), limits, duration=5.0)
    assert result.device_lost
    assert result.cut_short is not None
    assert result.cut_short.startswith(reason)
    assert result.switched_off == (cut == "imu")
    assert EXIT in bench.bus.sent
    assert bench.bus.sent[-1] in (NO_TORQUE, EXIT)


def test_while_replies_are_missing_the_last_torque_is_held_and_the_loop_rests(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("wipx.hardware.can_motor.PATIENCE", 0.01)
    bench = Bench()
    loop = Cutting(bench, "motor")
    result = run(bench, loop, Limits(30.0, 9.0, 9.0, 9.0, 0.1), duration=5.0)
    assert loop.steps == 5
    assert lost_replies(result) > 1
    protocol = MitProtocol(Ranges(), 1, 0)
    commands = bench.bus.sent[: bench.bus.sent.index(EXIT) - 1][2:]  # between entering and switching off
    held = commands[4:]
    assert set(held) == {protocol.command(torque=8.0 * RADIUS)}
    assert len(held) == lost_replies(result)


def test_a_few_lost_replies_are_survived_and_interpolated():
    class Flaky(Feedback):
        def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
            bench.bus.silent = self.steps % 7 == 3
            return super().step(t, measured, reference)

    bench = Bench(pitch=0.02)
    send = bench.bus.send

    def recovering(msg: can.Message, timeout: float | None = None) -> None:
        send(msg, timeout)
        bench.bus.silent = False

    bench.bus.send = recovering
    result = run(bench, Flaky(BALANCING))
    assert result.cut_short is None
    assert lost_replies(result) >= 2
    assert result.recording is not None
    assert all(np.isfinite(values).all() for values in result.recording.columns.values())


def test_replies_that_come_late_and_all_at_once_do_not_shift_those_that_follow():
    bench = Bench(pitch=0.03)
    send, sent = bench.bus.send, []

    def stalling(msg: can.Message, timeout: float | None = None) -> None:
        sent.append(msg)
        bench.bus.stalled = 20 <= len(sent) < 26
        send(msg, timeout)

    bench.bus.send = stalling
    result = run(bench, Feedback(BALANCING))
    assert lost_replies(result) >= 6
    recording = result.recording
    assert recording is not None
    late = recording.rows(30, len(recording))
    # This motor follows at once: a reply that is taken for that of the next command would show the force before.
    step = 24.0 / 4095.0 / RADIUS
    np.testing.assert_allclose(late["u_measured"], late["u"], atol=1.01 * step)
    assert np.ptp(late["u"]) > 2.0 * step


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("on_body", [False, True])
def test_force_and_travel_have_the_robots_signs(direction: int, on_body: bool):
    drivetrain = Drivetrain(RADIUS, direction, on_body)
    assert drivetrain.force(drivetrain.torque(3.0)) == pytest.approx(3.0)
    assert drivetrain.torque(3.0) * direction > 0.0
    x, theta = 0.2, 0.1
    angle = direction * (x / RADIUS + (theta if on_body else 0.0))
    assert drivetrain.travel(angle, theta) == pytest.approx(x)


def test_a_motor_that_is_built_in_the_other_way_round_gives_the_same_recording():
    # A robot seen through a motor of direction -1 is its mirror image along the rail.
    runs = []
    for direction in (1, -1):
        bench = Bench(settings=MotorSettings(direction=direction, reply_within=0.002))
        runs.append(run(bench, Feedback(np.zeros(4), push=2.0), duration=0.1).recording)
    plain, mirrored = runs
    assert plain is not None
    assert mirrored is not None
    assert plain["x"][-1] > 0.0
    assert mirrored["x"][-1] > 0.0
    assert plain["theta"][-1] * mirrored["theta"][-1] < 0.0


def test_missed_deadlines_are_skipped_not_caught_up_with():
    pace = Pace(100.0)
    begin = pace.begin()
    time.sleep(0.035)
    late = pace.wait() - begin
    assert [skipped for _, skipped in pace.overruns] == [3]
    assert late == pytest.approx(0.04, abs=1e-5)
    assert pace.wait() - begin == pytest.approx(0.05, abs=1e-5)


def test_a_late_step_is_told_with_its_place_and_what_was_used_meanwhile_was_old():
    class Late(Feedback):
        def step(self, t: float, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
            if self.steps == 20:
                time.sleep(0.0165)  # three of the periods that follow are over
            return super().step(t, measured, reference)

    quality = run(Bench(), Late(BALANCING), duration=0.2).quality
    assert quality is not None
    (overrun,) = quality.overruns
    assert (overrun.step, overrun.skipped) == (21, 3)
    assert overrun.t == pytest.approx(20 * 0.005 + 0.0165, abs=1e-3)
    summary = quality.summary()
    assert summary["period_error"]["p50"] < 1e-4
    assert summary["period_error"]["p100"] == pytest.approx(0.0165, abs=1e-3)
    assert summary["imu_age"]["p100"] == pytest.approx(0.0165, abs=1e-3)  # it was read before the late step
    assert summary["motor_age"]["p50"] == pytest.approx(0.005, abs=1e-4)
    assert summary["motor_age"]["p100"] == pytest.approx(0.0215, abs=1e-3)


def test_a_priority_that_is_refused_is_told_once_and_the_trial_runs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def refuse(*arguments: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr("os.sched_setscheduler", refuse)
    ran = 0
    for _ in range(2):
        with undisturbed(50):
            assert not gc.isenabled()
            ran += 1
    assert gc.isenabled()
    assert ran == 2
    assert capsys.readouterr().err.count("target.priority=50 is refused (Operation not permitted)") == 1


def settings(**changes: object) -> dict:
    return {
        "parameters": {"body_mass": 5.0, "wheel_mass": 1.2, "com_height": 0.35, "body_inertia": 0.15}
        | {"wheel_inertia": 0.0023, "wheel_radius": RADIUS},
        "can": {"interface": "slcan", "channel": "/dev/no_such_adapter", "sleep_after_open": 0.0},
        "imu": {"port": "/dev/no_such_port"},
        "limits": {"force": 30.0, "pitch": 0.5, "rail": 0.4, "speed": 2.0, "silence": 0.05},
    } | changes


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"limits": {"force": 30.0}}, "target.limits.pitch is missing"),
        ({"limits": {**settings()["limits"], "force": 999.0}}, "target.limits.force needs a torque of 62.4 N m"),
        ({"limits": {**settings()["limits"], "speed": -1.0}}, "speed is -1, expected a positive number"),
        ({"motor": {"direktion": 1}}, "target.motor: unknown key 'direktion'; did you mean direction?"),
        ({"motor": {"direction": 2}}, "target.motor.direction is 2, expected 1 or -1"),
        ({"motor": {"id": 1.5}}, "target.motor.id is 1.5, expected a whole number"),
        ({"ranges": {"torque": 0}}, "torque is 0, expected a positive number"),
        ({"imu": {}}, "target.imu.port is missing"),
        ({"weights": {"heavy": {"mass": 1.6}}}, "target.weights.heavy.height is missing"),
        ({"priority": 120}, "target.priority is 120"),
    ],
)
def test_settings_at_fault_are_named(changes: dict, message: str):
    with pytest.raises(InputError, match=message):
        HardwareTarget(**settings(**changes))


def test_a_load_that_the_robot_lacks_is_refused_before_anything_is_opened(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    target = HardwareTarget(**settings(weights={"heavy": {"mass": 1.6, "height": 0.4, "side": -0.1}}))
    with pytest.raises(InputError, match=r"target\.weights: unknown load 'light'"):
        next(target.run([Trial("r", 1.0, "light")], Feedback(BALANCING), np.random.default_rng(0)))


def test_loads_are_those_of_the_owner():
    target = HardwareTarget(**settings(weights={"heavy": {"mass": 1.6, "height": 0.4, "side": -0.1}}))
    assert target.loads["heavy"].equilibrium(target.nominal()) < 0.0


def test_without_an_operator_nothing_is_started(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    with pytest.raises(InputError, match="run it from a terminal"):
        next(HardwareTarget(**settings()).run([Trial("r", 1.0)], Feedback(BALANCING), np.random.default_rng(0)))
