"""How far a sweep is, in words, with the time that is left."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from wipx.tasks.files.sweep_folder import JobState


@dataclass(frozen=True)
class SweepProgress:
    """How far the jobs of a sweep are.

    Attributes:
        jobs: All of them.
        now: Time at which they were looked at [s since the epoch].
    """

    jobs: Sequence[JobState]
    now: float

    @classmethod
    def of(cls, jobs: Sequence[JobState]) -> "SweepProgress":
        """The progress at this moment."""
        return cls(jobs, time.time())

    def named(self, state: str) -> list[JobState]:
        """Jobs in a state."""
        return [job for job in self.jobs if job.state == state]

    @property
    def seconds_left(self) -> float | None:
        """Time that is left [s], as if the others took as long as the finished ones and as many ran at once as now.

        None where no job is done, or none is running.
        """
        spent = [job.note.seconds for job in self.named("done") if job.note and job.note.seconds is not None]
        running = self.named("running")
        if not spent or not running:
            return None
        typical = sum(spent) / len(spent)
        begun = [max(typical - (self.now - job.note.started), 0.0) for job in running if job.note]
        return (typical * len(self.named("missing")) + sum(begun)) / len(running)

    def line(self) -> str:
        """Counts and the time left."""
        counts = {state: len(self.named(state)) for state in ("done", "running", "failed", "missing")}
        told = [f"{count} {state}" for state, count in counts.items() if count or state == "done"]
        left = self.seconds_left
        if left is not None:
            told.append(f"about {duration(left)} left")
        return f"{len(self.jobs)} jobs: {', '.join(told)}"


def duration(seconds: float) -> str:
    """A time in words, to two digits: 45 s, 12 min, 3.5 h."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 90.0 * 60.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h"
