"""The time that is left of a sweep follows from the jobs that are done."""

import pytest

from wipx.tasks.files.sweep_folder import JobNote, JobState
from wipx.tasks.shared.sweep_progress import SweepProgress, duration


def job(state, seconds: float | None = None, started: float = 0.0) -> JobState:
    return JobState("j", state, JobNote([], "s", started=started, seconds=seconds))


def test_the_others_take_as_long_as_the_finished_ones():
    jobs = [job("done", 60.0), job("done", 80.0), job("running", started=1000.0), job("running", started=1020.0)]
    jobs += [job("missing")] * 3
    progress = SweepProgress(jobs, now=1040.0)
    # Two at once: three jobs of 70 s that were not begun, 30 s and 50 s of those that were.
    assert progress.seconds_left == pytest.approx((3 * 70.0 + 30.0 + 50.0) / 2)
    assert progress.line() == "7 jobs: 2 done, 2 running, 3 missing, about 2 min left"


def test_without_a_finished_or_a_running_job_no_time_is_told():
    assert SweepProgress([job("running"), job("missing")], now=1.0).seconds_left is None
    assert SweepProgress([job("done", 5.0), job("missing")], now=1.0).line() == "2 jobs: 1 done, 1 missing"


@pytest.mark.parametrize(("seconds", "words"), [(12.3, "12 s"), (600.0, "10 min"), (9000.0, "2.5 h")])
def test_a_time_in_words(seconds: float, words: str):
    assert duration(seconds) == words
