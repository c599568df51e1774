"""Where a log is cut into recordings, with the reason."""

from dataclasses import replace
from pathlib import Path

import log_writers as logs
import numpy as np
import pytest

from wipx.importing.checks import column_summary, longest_constant
from wipx.importing.cutting import Interruption, cut, resolution
from wipx.importing.mapping import ColumnSource, MappedColumn

NUMBERS = {"0": "shoulder", "1": "elbow"}


def with_pause(motion: logs.Motion, begin: int, end: int) -> logs.Motion:
    """The robot stands still without a command between two rows."""
    copies = {name: np.array(value) for name, value in vars(motion).items()}
    copies["positions"][begin:end] = copies["positions"][begin]
    for name in ("rates", "commands", "efforts"):
        copies[name][begin:end] = 0.0
    return replace(motion, **copies)


def test_every_row_belongs_to_one_stretch_or_to_an_interruption(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    t = np.cumsum(rng.uniform(0.5, 1.5, 200))
    ends = np.sort(rng.uniform(t[0], t[-1], (6, 2)), axis=1)
    interruptions = [Interruption(begin, end, f"reason {k}") for k, (begin, end) in enumerate(ends)]
    stretches = cut(t, interruptions, "the log")
    inside = np.zeros(200, dtype=int)
    for stretch in stretches:
        inside[stretch.first : stretch.last] += 1
    interrupted = np.any([(t > one.begin) & (t < one.end) for one in interruptions], axis=0)
    np.testing.assert_array_equal(inside == 1, ~interrupted)
    assert inside.max() == 1
    assert stretches[0].begins == "the log begins"
    assert all(s.begins.startswith("reason") for s in stretches[1:])


def test_an_interruption_between_two_rows_divides_them():
    stretches = cut(np.arange(10.0), [Interruption(4.0, 5.0, "gap")], "the log")
    assert [(s.first, s.last, s.begins, s.ends) for s in stretches] == [
        (0, 5, "the log begins", "gap"),
        (5, 10, "gap", "the log ends"),
    ]


def test_a_long_pause_divides_a_log_and_some_rest_is_kept(imported, tmp_path: Path):
    motion = with_pause(logs.motion(np.random.default_rng(0), 1200), 400, 800)  # 4 s
    log = imported(logs.write_npz(tmp_path / "a.npz", motion), "mujoco", rename=NUMBERS)
    first, second = log.preview.recordings
    assert first.ends == second.begins
    assert first.ends.startswith("pause of 3.")
    rest = [motion.t[400] + 0.5, motion.t[800] - 0.5]
    assert [first.end, second.begin] == pytest.approx(rest, abs=0.4)  # around its ends a window holds motion
    assert len(log.preview.motion) == 2


def test_a_short_pause_divides_nothing(imported, tmp_path: Path):
    motion = with_pause(logs.motion(np.random.default_rng(0), 600), 200, 350)
    log = imported(logs.write_npz(tmp_path / "a.npz", motion), "mujoco", rename=NUMBERS)
    assert len(log.recordings) == 1


def test_a_joint_that_sticks_under_a_changing_command_is_no_pause(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0), 900)
    still = with_pause(motion, 300, 700)
    sticking = replace(still, commands=motion.commands)
    log = imported(logs.write_npz(tmp_path / "a.npz", sticking), "mujoco", rename=NUMBERS)
    assert len(log.recordings) == 1
    frozen = next(column for column in log.preview.columns if column.name == "elbow")
    assert frozen.frozen == pytest.approx(4.0, abs=0.3)
    assert frozen.frozen_at == pytest.approx(motion.t[300], abs=0.05)


def test_a_robot_that_balances_in_the_noise_of_its_sensor_does_not_pause(imported, tmp_path: Path, fresh_seed: int):
    motion = with_pause(logs.motion(np.random.default_rng(0), 1200), 400, 800)
    noise = 1e-3 * np.random.default_rng(fresh_seed).normal(size=motion.positions.shape)
    measured = motion.positions + noise
    idle = replace(motion, positions=measured)
    log = imported(logs.write_npz(tmp_path / "a.npz", idle), "mujoco", rename=NUMBERS)
    assert len(log.recordings) == 2
    balancing = replace(idle, commands=motion.commands - 20.0 * noise)
    log = imported(logs.write_npz(tmp_path / "b.npz", balancing), "mujoco", rename=NUMBERS)
    assert len(log.recordings) == 1


def test_a_gap_divides_a_log(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0), 600)
    kept = np.concatenate([np.arange(250), np.arange(300, 600)])
    log = imported(logs.write_mcap(tmp_path / "a.mcap", logs.part(motion, kept)), "joint_state")
    first, second = log.preview.recordings
    assert (first.rows, second.rows) == (250, 300)
    assert first.ends == second.begins
    assert first.ends.startswith("gap of 0.5")
    assert first.ends.endswith("in /joint_states")
    states = next(s for s in log.preview.streams if s.name == "/joint_states")
    assert states.gaps == 1


def test_a_motor_that_is_switched_off_ends_a_recording(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0), 300)
    path = logs.write_can(tmp_path / "a.log", motion, switched=True)
    again = logs.write_can(tmp_path / "b.log", replace(motion, stamps=motion.stamps + 4 * 10**9), switched=True)
    path.write_text(path.read_text() + again.read_text())
    motors = {joint: {"id": k + 1} for k, joint in enumerate(logs.JOINTS)}
    log = imported(path, "can_motors", format={"motors": motors})
    first, second = log.preview.recordings
    assert first.ends == "stop (shoulder/mode off)"
    assert second.begins.startswith(("stop", "gap"))
    assert (first.rows, second.rows) == (pytest.approx(300, abs=2), pytest.approx(300, abs=2))


def test_short_stretches_are_no_recordings(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0), 600)
    kept = np.concatenate([np.arange(50), np.arange(100, 600)])
    log = imported(logs.write_mcap(tmp_path / "a.mcap", logs.part(motion, kept)), "joint_state")
    assert [piece.name for piece in log.preview.pieces] == ["", "r01"]


@pytest.mark.parametrize(("step", "found"), [(1e-3, 1e-3), (2.0 * np.pi / 4096.0, 2.0 * np.pi / 4096.0), (0.0, 0.0)])
def test_the_resolution_of_an_encoder_is_found(fresh_seed: int, step: float, found: float):
    values = np.sin(np.linspace(0.0, 20.0, 3000)) + 1e-3 * np.random.default_rng(fresh_seed).normal(size=3000)
    values = np.round(values / step) * step if step else values
    assert resolution(values) == pytest.approx(found, rel=1e-6)


def test_a_saturated_signal_is_told_from_one_with_a_peak(fresh_seed: int):
    t = np.linspace(0.0, 10.0, 2000)
    signal = np.sin(3.0 * t) + 0.01 * np.random.default_rng(fresh_seed).normal(size=2000)
    column = MappedColumn("u", "s", "f", ColumnSource("s", "f"), "N")
    free = column_summary(column, signal, 0, (0.0, 0.0))
    clipped = column_summary(column, np.clip(signal, -0.9, 2.0), 0, (0.0, 0.0))
    assert (free.at_low, free.at_high, clipped.at_high) == (0.0, 0.0, 0.0)
    assert clipped.at_low == pytest.approx(np.mean(signal <= -0.9))


def test_a_signal_that_rests_at_its_extremes_is_not_saturated():
    t = np.arange(0.0, 20.0, 0.005)
    share = np.clip(t % 4.0 / 1.5, 0.0, 1.0) - np.clip((t % 4.0 - 2.0) / 1.5, 0.0, 1.0)
    encoder = np.round(10.0 * share**3 - 15.0 * share**4 + 6.0 * share**5, 4)  # to and fro without jerk
    levels = np.repeat(np.random.default_rng(0).normal(size=40), 100)  # a command in steps
    column = MappedColumn("q", "s", "f", ColumnSource("s", "f"), "rad")
    for signal in (encoder, levels, np.round(np.sin(3.0 * t), 2)):
        summary = column_summary(column, signal, 0, (0.0, 0.0))
        assert (summary.at_low, summary.at_high) == (0.0, 0.0)


def test_the_longest_constant_stretch_counts_while_something_should_change():
    t = np.arange(100) * 0.1
    values = np.sin(t)
    values[20:50] = values[20]
    assert longest_constant(t, values, np.ones(100, dtype=bool)) == pytest.approx((2.9, 2.0))
    assert longest_constant(t, values, np.zeros(100, dtype=bool)) == (0.0, 0.0)
