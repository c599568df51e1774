"""`task=blind_check`: compares a blind run with its commitments and scores it again, from its files alone."""

from dataclasses import dataclass
from pathlib import Path

from wipx.core.errors import InputError
from wipx.proof.blind.diagnosing import read_answers
from wipx.proof.blind.judging import Opened, read_commitments, read_opened, scores_of, verified
from wipx.proof.blind_robots.folder import RunFolder
from wipx.tasks.shared.job import Job


@dataclass(frozen=True)
class BlindCheck:
    """Check every opened case of a run.

    Attributes:
        folder: Of the run.
    """

    folder: str

    def run(self, job: Job) -> None:
        """Compare recordings, answers, seals and scores with what was written down.

        The unseen recordings are not predicted again.

        Raises:
            InputError: something was changed, or nothing is opened yet.
        """
        folder = RunFolder(Path(self.folder))
        commitments = read_commitments(folder)
        opened = [read_opened(folder.opened(case)) for case in commitments if folder.opened(case).is_file()]
        if not opened:
            raise InputError(f"{folder.path}: no case is opened yet; let the run go on first")
        for one in opened:
            _compare(folder, one, verified(folder, commitments[one.case], one.key))
        print(
            f"{len(opened)} of {len(commitments)} cases: recordings, answers and seals have the digests of "
            f"{folder.commitments}, and their scores follow from them"
        )


def _compare(folder: RunFolder, one: Opened, content: dict) -> None:
    again = scores_of(folder, one.case, content, read_answers(folder.answers(one.case)), one.errors)
    if again != one.scores:
        raise InputError(f"{folder.opened(one.case)}: the scores do not follow from seal and answers; restore the file")
