"""What a run of the blind benchmark tells about itself: why its figures can be believed, and how far."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

from wipx.proof.blind.diagnosing import read_answers
from wipx.proof.blind.judging import Opened
from wipx.proof.blind_robots.folder import RunFolder, read_json
from wipx.proof.blind_robots.table import Count

FALSE_ALARM_BAR = 0.02  # share of robots with nothing hidden that may be accused


@dataclass(frozen=True)
class Account:
    """How a run came about.

    Attributes:
        seed: Of the draws; None where it was lost.
        given: Whether the seed was given by the user, not drawn.
        pauses: How often the run was interrupted.
        drawn: Cases that were sealed.
    """

    seed: int | None
    given: bool
    pauses: int
    drawn: int


def notes(cases: Sequence[Opened], account: Account, alarms: Count) -> tuple[str, ...]:
    """What a reader must know before relying on the figures.

    Args:
        cases: Those that are opened.
        account: How the run came about.
        alarms: False alarms where nothing is hidden.
    """
    found = []
    if len(cases) < account.drawn:
        found.append(f"{account.drawn - len(cases)} of {account.drawn} cases are not opened yet or can no longer be.")
    if alarms.total and alarms.interval[1] > FALSE_ALARM_BAR:
        found.append(
            f"With nothing hidden in {robots(alarms.total)}, the rate of false alarms lies in {interval(alarms)}; to "
            f"judge it against the bar of {bar()} takes more of them (task.cases)."
        )
    if account.given:
        found.append(
            "The seed was given in advance: the run can be repeated, but who knows the seed knows the answers."
        )
    return tuple(found)


def proof(folder: RunFolder, cases: Sequence[Opened], account: Account) -> tuple[tuple[str, str], ...]:
    """Why the figures can be believed, as (what, how).

    Args:
        folder: Of the run.
        cases: Those that are opened, one at least.
        account: How the run came about.
    """
    published = folder.commitments.read_bytes()
    first = min(read_json(folder.answers(one.case))["written"] for one in cases)
    everyone = [answer for one in cases for answer in read_answers(folder.answers(one.case)).values()]
    refused = sorted({what for answer in everyone for what in answer.refused})
    pauses = ""
    if account.pauses:
        times = "once" if account.pauses == 1 else f"{account.pauses} times"
        pauses = (
            f" The run was interrupted {times}; meanwhile nothing was diagnosed, and the keys were in a file that only "
            "its owner can read."
        )
    most = max(answer.opened for answer in everyone)
    asked = f"here: {'; '.join(refused[:5])}." if refused else "nothing of that was asked for."
    drawn = "fresh randomness" if not account.given else "a seed that was given"
    again = (
        f"; task.seed={account.seed} draws the same robots again, with the same settings"
        if account.seed is not None
        else ""
    )
    return (
        (
            "Fixed in advance",
            f"Digests of every case (SHA-256 over salt and content) were written to commitments.json at "
            f"{read_json(folder.commitments)['written']}, the first answer at {first}. "
            f"SHA-256 of commitments.json: {hashlib.sha256(published).hexdigest()}",
        ),
        (
            "Out of reach",
            "Truth, unseen recordings and seed were encrypted, each case with a key of its own that was in the memory "
            f"of the process that started the others, until the digests of the answers were written down.{pauses}",
        ),
        (
            "Watched",
            "Every file that a diagnosis opened from Python was noted (answers/CASE/METHOD.opened.txt): of this run "
            f"at most {most}, its own recordings and results. The rest of the run, the code that draws cases, other "
            f"processes and connections are refused; {asked} A compiled library that opened files by itself would not "
            "be noted, but what is sealed is encrypted.",
        ),
        (
            "Foreign physics",
            f"The robots were drawn from {drawn}{again}. Their equations of motion, friction, drives, sensors and logs "
            "are written anew in wipx/proof/blind_robots and share no code with what is fitted.",
        ),
        (
            "Opened",
            f"{len(cases)} of {account.drawn} seals; recordings, answers and contents all had the digests that were "
            "written down before. The keys are in opened/ now.",
        ),
    )


def bar() -> str:
    """`FALSE_ALARM_BAR` in words."""
    return f"{100.0 * FALSE_ALARM_BAR:g} %"


def robots(count: int) -> str:
    """A number of robots in words."""
    return f"{count} robot" if count == 1 else f"{count} robots"


def count_in_words(count: Count) -> str:
    """A rate as right of total, and its interval in a second line."""
    return "-" if count.total == 0 else f"{count.right} of {count.total}\n{interval(count)}"


def interval(count: Count) -> str:
    """The 95 % interval of a rate in words."""
    low, high = count.interval
    return "-" if count.total == 0 else f"{100.0 * low:.0f} to {100.0 * high:.0f} %"
