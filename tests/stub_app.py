"""`python -m wipx` with one more task, which does as its setting says: a stand-in for the real ones."""

import sys
import types
from dataclasses import dataclass

from wipx.app import main
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
        if self.behaviour == "refuse late":
            (job.out / "partial.txt").write_text("")
            raise InputError("r3.csv row 812: t decreases; sort or drop the row")
        if self.behaviour == "break":
            raise OSError("defect")
        if self.behaviour == "interrupt":
            raise KeyboardInterrupt
        if self.behaviour == "need recordings":
            job.part("recordings")


if __name__ == "__main__":
    StubTask.__module__ = "wipx.stub"
    stub = types.ModuleType("wipx.stub")
    vars(stub)["StubTask"] = StubTask
    sys.modules["wipx.stub"] = stub
    sys.exit(main())
