"""A task that does as its setting says, in place of the real ones."""

from dataclasses import dataclass

from wipx.core.errors import InputError
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class StubTask:
    behaviour: str = "succeed"

    def run(self, job: Job) -> None:
        if self.behaviour == "succeed":
            (job.out / "result.txt").write_text(f"{job.seed} {dict(job.free)} {dict(job.bounds)} {job.effects}")
        if self.behaviour == "refuse":
            raise InputError("r3.csv row 812: t decreases; sort or drop the row")
        if self.behaviour == "break":
            raise OSError("defect")
        if self.behaviour == "interrupt":
            raise KeyboardInterrupt
