"""Streams of different rates and clocks on the rows of one of them."""

from dataclasses import replace
from pathlib import Path

import log_writers as logs
import numpy as np
import pytest

from wipx.core.errors import InputError
from wipx.importing.merge import Series, on_rows

COMMANDS = {
    f"u_{joint}": {"stream": "/command", "field": f"data[{k}]", "unit": "N m"} for k, joint in enumerate(logs.JOINTS)
}


def series(t: np.ndarray, values: np.ndarray) -> Series:
    return Series(t, values, 0)


def test_a_command_that_changes_between_rows_counts_with_its_share_of_the_time(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    t = np.cumsum(rng.uniform(0.8, 1.2, 50))
    fast = np.sort(rng.uniform(t[0] - 1.0, t[-1] + 1.0, 400))
    values = rng.normal(size=400)
    means = on_rows(series(fast, values), t, held=True)
    fine = np.linspace(0.0, 1.0, 20_001)[:-1] + 0.5 / 20_000
    for k in range(49):
        times = t[k] + (t[k + 1] - t[k]) * fine
        assert means[k] == pytest.approx(np.mean(values[np.searchsorted(fast, times, side="right") - 1]), abs=1e-3)


def test_a_command_that_holds_over_a_row_is_exact(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    t = np.cumsum(rng.uniform(0.8, 1.2, 50))
    values = rng.normal(size=50)
    np.testing.assert_array_equal(on_rows(series(t, values), t, held=True), values)
    np.testing.assert_array_equal(on_rows(series(t[::5], values[:10]), t, held=True), np.repeat(values[:10], 5))


def test_nothing_is_made_up_before_the_first_and_after_the_last_message():
    t = np.arange(10.0)
    inner = series(t[3:7], t[3:7])
    assert np.isnan(on_rows(inner, t, held=False)).tolist() == [k < 3 or k > 6 for k in range(10)]
    assert np.isnan(on_rows(inner, t, held=True)).tolist() == [k < 3 for k in range(10)]


def test_a_measurement_is_interpolated(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    fast = np.sort(rng.uniform(0.0, 10.0, 2000))
    t = np.linspace(1.0, 9.0, 300)
    np.testing.assert_allclose(on_rows(series(fast, np.sin(fast)), t, held=False), np.sin(t), atol=1e-3)


def test_header_and_receive_stamps_are_compared(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0))
    path = logs.write_mcap(tmp_path / "a.mcap", motion)  # received 2 ms later
    states = next(s for s in imported(path, "joint_state").preview.streams if s.name == "/joint_states")
    assert states.clock == "header"
    assert states.difference is not None
    assert states.difference.median == pytest.approx(0.002)
    assert states.difference.drift == pytest.approx(0.0, abs=1e-6)


def test_receive_stamps_shift_the_measurement_against_a_command_without_header(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0))
    path = logs.write_mcap(tmp_path / "a.mcap", motion)
    by_header = logs.recorded(imported(path, "joint_state", columns=COMMANDS, clock="header"))
    np.testing.assert_array_equal(by_header["u_elbow"], motion.commands[:, 1])
    by_receive = logs.recorded(imported(path, "joint_state", columns=COMMANDS, clock="receive"))
    changed = np.flatnonzero(np.diff(motion.commands[:-1, 1]))
    assert np.all(by_receive["u_elbow"][changed] != motion.commands[changed, 1])  # a part of the next command counts


def test_a_clock_since_the_start_of_the_robot_is_not_mixed_with_that_of_the_logger(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0))
    late = logs.EPOCH - 10**9  # header stamps count from the robot's start, receive stamps from 1970
    since_start = replace(motion, stamps=motion.stamps - late)
    path = logs.write_mcap(tmp_path / "a.mcap", since_start, received_later=late)
    log = imported(path, "joint_state", columns=COMMANDS)
    assert "receive stamps count" in log.preview.notes[0]
    assert {stream.clock for stream in log.preview.streams} == {"receive"}
    with pytest.raises(InputError, match=r"mixed clocks: /joint_states is received .* after its header stamps"):
        imported(path, "joint_state", columns=COMMANDS, clock="header")


def test_messages_are_put_in_order_and_repeated_ones_are_left_out(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0))
    order = np.arange(300)
    order[[100, 101]] = order[[101, 100]]
    order = np.insert(order, 50, 50)
    path = logs.write_mcap(tmp_path / "a.mcap", logs.part(motion, order))
    log = imported(path, "joint_state")
    states = next(s for s in log.preview.streams if s.name == "/joint_states")
    assert (states.duplicates, states.out_of_order) == (1, 1)
    np.testing.assert_allclose(logs.recorded(log)["elbow"], motion.positions[:, 1])


def test_an_angle_that_begins_anew_is_made_continuous(imported, tmp_path: Path):
    motion = logs.motion(np.random.default_rng(0))
    turning = replace(motion, positions=motion.positions + 12.0 * motion.t[:, None])
    path = logs.write_can(tmp_path / "a.log", turning)
    log = imported(path, "can_motors", format={"motors": {"elbow": {"id": 2}}})
    angle = logs.recorded(log)["elbow"]
    np.testing.assert_allclose(angle - angle[0], turning.positions[:, 1] - turning.positions[0, 1], atol=1e-3)


def test_a_table_whose_time_begins_anew_is_several_episodes(imported, tmp_path: Path):
    rng = np.random.default_rng(0)
    parts = [logs.motion(rng, 200) for _ in range(3)]
    files = [logs.write_table(tmp_path / f"{k}.csv", part).read_text().splitlines() for k, part in enumerate(parts)]
    path = tmp_path / "all.csv"
    path.write_text("\n".join([files[0][0], *(line for lines in files for line in lines[1:])]))
    units = {"*": {"stream": "table", "field": "*_pos", "unit": "deg"}}
    log = imported(path, "table", format={"time": "time_ms", "time_unit": "ms"}, columns=units)
    assert [piece.episode for piece in log.preview.pieces] == ["1", "2", "3"]
    np.testing.assert_allclose(logs.recorded(log, 2)["elbow"], parts[2].positions[:, 1], atol=1e-9)
