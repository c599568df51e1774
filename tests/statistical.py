"""Tests whose claim holds with a stated probability: on fresh draws they are repeated, and their failures counted.

A plain test must pass on every draw. `@pytest.mark.statistical(allowed=0.05)` says that a claim fails on one draw in
twenty; the run fails where so many failures would be rarer than `SURPRISE`.
"""

import re
from dataclasses import dataclass, field

import pytest
from scipy.stats import binom

DRAWS = 10  # of each statistical test
SURPRISE = 1e-3  # probability, for each test, that a true claim fails the run
PROPERTY = "statistical"  # under which a report carries the rate that its claim allows


def most_failures(draws: int, allowed: float) -> int:
    """Failures in so many draws that a claim survives."""
    return int(binom.isf(SURPRISE, draws, allowed))


def claim_of(nodeid: str) -> str:
    """The test without the number of its draw."""
    return re.sub(r"-?draw\d+", "", nodeid).replace("[]", "").replace("[-", "[")


@dataclass
class Claim:
    """What the draws of one test came to.

    Attributes:
        allowed: Rate of failures that it allows.
        draws: How many there were.
        failures: Reports of those that failed.
    """

    allowed: float
    draws: int = 0
    failures: list[pytest.TestReport] = field(default_factory=list)

    @property
    def fails(self) -> bool:
        """Whether it fails more often than it allows."""
        return len(self.failures) > most_failures(self.draws, self.allowed)


class Claims:
    """Counts failures of statistical tests over a run, in all its processes; a plugin of pytest."""

    def __init__(self) -> None:
        self.claims: dict[str, Claim] = {}

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note a draw; a failure within the rate is shown as an expected one."""
        properties = dict(report.user_properties)
        if PROPERTY not in properties or report.when != "call":
            return
        claim = self.claims.setdefault(claim_of(report.nodeid), Claim(float(str(properties[PROPERTY]))))
        claim.draws += 1
        if report.failed:
            claim.failures.append(report)
            report.outcome = "skipped"
            report.wasxfail = f"one of at most {most_failures(DRAWS, claim.allowed)}"

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """A claim that fails too often fails the run."""
        if any(claim.fails for claim in self.claims.values()):
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say which claims failed on some draws, and show the draws of those that fail the run."""
        for name, claim in self.claims.items():
            if claim.failures:
                verdict = "MORE THAN ITS CLAIM ALLOWS" if claim.fails else "as its claim allows"
                terminalreporter.write_line(
                    f"{name}: {len(claim.failures)} of {claim.draws} draws failed, {verdict} ({claim.allowed:g})"
                )
            for report in claim.failures if claim.fails else ():
                terminalreporter.write_sep("_", report.nodeid, red=True)
                terminalreporter.write_line(report.longreprtext)
                for title, content in report.sections:
                    terminalreporter.write_line(f"{title}: {content}")
