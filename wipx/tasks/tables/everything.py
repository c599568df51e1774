"""`task=tables`: every table and figure, each made by commands of this program, and one page of all of them."""

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from wipx.core.errors import InputError, unknown_name
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import StageProgress

LOG = "log.txt"
NEW_EACH_TIME = "blind"  # a finished blind run is followed by a fresh one, so it is made once only


@dataclass(frozen=True)
class Everything:
    """Make all tables.

    A part that fails is named on the page with its reason; the others are made all the same.

    Attributes:
        parts: By name, `sweeps`, lists of overrides, and `table`, the overrides of what makes the table.
        launcher: Of the sweeps, an option of hydra/launcher; None for that of the experiment.
        only: Names of the parts to make; empty for all.
        folder: Takes a folder for each part, and index.html.
    """

    parts: dict[str, Any] = field(default_factory=dict)
    launcher: str | None = None
    only: tuple[str, ...] = ()
    folder: str = "runs/tables"

    def __post_init__(self) -> None:
        for name in self.only:
            if name not in self.parts:
                raise unknown_name("part", name, self.parts, "task.only")

    def run(self, job: Job) -> None:
        """Run every part's sweeps and table, then write the page.

        Raises:
            InputError: parts failed; the page names them.
        """
        from wipx.report.tables_page import write_tables_page

        chosen = self.only or tuple(self.parts)
        failed: dict[str, str] = {}
        with StageProgress("tables") as progress:
            for i, name in enumerate(chosen):
                progress(name, i / len(chosen))
                reason = self._make(name)
                if reason is not None:
                    failed[name] = reason
        folder = Path(self.folder)
        write_tables_page(folder, tuple(self.parts), failed)
        print(f"page: {folder / 'index.html'}")
        if failed:
            name, reason = next(iter(failed.items()))
            raise InputError(
                f"{len(failed)} of {len(chosen)} tables could not be made, first {name}: {reason}; "
                "run the same command again, which does the missing ones only"
            )

    def _make(self, name: str) -> str | None:
        """Run one part; returns why it failed, None where it did not."""
        part, folder = self.parts[name], Path(self.folder) / name
        folder.mkdir(parents=True, exist_ok=True)
        if name == NEW_EACH_TIME and (folder / "score.md").is_file():
            return None
        launcher = () if self.launcher is None else (f"hydra/launcher={self.launcher}",)
        commands = [(*sweep, *launcher, "-m") for sweep in part.get("sweeps", ())]
        commands.append((*part["table"], f"hydra.run.dir='{folder}'"))
        with (folder / LOG).open("w", encoding="utf-8") as log:
            for command in commands:
                if _run(command, log) != 0:
                    return _last_line(folder / LOG)
        return None


def _run(arguments: Sequence[str], log) -> int:
    """Exit status of one command; Ctrl-C reaches it too, and ends this program after it."""
    process = subprocess.Popen([sys.executable, "-m", "wipx", *arguments], stdout=log, stderr=subprocess.STDOUT)
    try:
        return process.wait()
    except KeyboardInterrupt:
        process.wait()
        raise


def _last_line(log: Path) -> str:
    return (log.read_text(encoding="utf-8").strip().splitlines() or ["no message"])[-1]
