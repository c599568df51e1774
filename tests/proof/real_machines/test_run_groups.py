"""Runs cut into pieces and put together in disjoint groups."""

from itertools import chain
from pathlib import Path

import numpy as np
import pytest

from wipx.core.errors import InputError
from wipx.core.recording import Recording
from wipx.proof.real_machines.run_groups import Way, choose, consecutive, usable
from wipx.recordings.source import RecordingSource


def run(name: str, seconds: float) -> Recording:
    t = np.arange(round(100 * seconds)) * 0.01
    return Recording(name, {"t": t, "theta": np.sin(t), "u": 0.0 * t})


def test_consecutive_spans_have_every_row_once():
    whole = run("a.csv", 10.0)
    spans = consecutive(whole, 3.0)
    assert len(spans) == 3
    np.testing.assert_array_equal(np.concatenate([span.t for span in spans]), whole.t)
    assert len({span.name for span in spans}) == 3
    assert all(span.name.endswith(".csv") for span in spans)


def test_a_run_that_is_short_enough_stays_whole():
    whole = run("a.csv", 4.0)
    assert consecutive(whole, 3.0) == (whole,)


@pytest.mark.parametrize("way", [Way(), Way(blocks=3), Way(interleaved=3), Way(piece=2.0), Way(piece=2.0, blocks=2)])
def test_groups_are_disjoint_and_hold_every_row(way: Way):
    runs = [run(f"r{number}.csv", 4.0) for number in range(5)]
    groups = way.groups(runs)
    pieces = list(chain.from_iterable(groups.values()))
    assert len({piece.name for piece in pieces}) == len(pieces)
    assert sum(len(piece) for piece in pieces) == sum(len(one) for one in runs)
    assert len(groups) > 1


def test_blocks_follow_each_other_and_interleaved_groups_take_turns():
    runs = [run(f"r{number}.csv", 2.0) for number in range(4)]
    assert [one.name for one in Way(blocks=2).groups(runs)["group01"]] == ["r0.csv", "r1.csv"]
    assert [one.name for one in Way(interleaved=2).groups(runs)["group01"]] == ["r0.csv", "r2.csv"]


def test_named_groups_take_their_patterns():
    runs = [run(name, 2.0) for name in ("slow_a.csv", "fast_a.csv", "slow_b.csv")]
    groups = Way(named={"slow": ["slow_*"], "fast": ["fast_*"]}).groups(runs)
    assert {name: [one.name for one in group] for name, group in groups.items()} == {
        "slow": ["slow_a.csv", "slow_b.csv"],
        "fast": ["fast_a.csv"],
    }


def test_a_pattern_without_a_run_is_refused():
    with pytest.raises(InputError, match=r"group fast: fast_\* matches none of a\.csv"):
        Way(named={"fast": ["fast_*"], "all": ["*"]}).groups([run("a.csv", 2.0)])


@pytest.mark.parametrize(
    ("settings", "said"),
    [({"blocks": 1}, "1 groups"), ({"piece": 0.0}, "piece is 0"), ({"blocks": 2, "interleaved": 2}, "exclude")],
)
def test_a_way_that_makes_no_sense_is_refused(settings: dict, said: str):
    with pytest.raises(InputError, match=said):
        Way(**settings)


def test_one_group_predicts_nothing_and_is_refused():
    with pytest.raises(InputError, match="1 group of 1 pieces"):
        Way(piece=10.0).groups([run("a.csv", 4.0)])


def test_several_parts_of_one_file_are_recordings_of_their_own(folder):
    source = RecordingSource(path=str(folder.path), spans={"a.csv": [0.0, 1.0]})
    first, second, other = usable(source, {"b.csv": [[0.5, 1.7], [0.0, 1.2]]})[::-1]
    assert other.name == "a.csv"
    assert other.t[-1] < 1.0
    assert first.name != second.name
    assert second.t[0] == 0.5
    assert first.duration == pytest.approx(1.19)


def test_a_part_that_is_too_short_is_refused(folder):
    with pytest.raises(InputError, match=r"\[0, 0\.5\] s holds less than 1 s"):
        usable(RecordingSource(path=str(folder.path)), {"b.csv": [[0.0, 0.5]]})


def test_chosen_recordings_keep_the_robot(folder):
    source = RecordingSource(path=str(folder.path))
    recordings = source.load()[:1]
    chosen = choose(source, recordings)
    assert chosen.load() == recordings
    assert chosen.describe().model == source.describe().model
    assert Path(str(chosen.path)) == folder.path
