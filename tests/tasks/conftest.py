"""The program as a user calls it, and a folder of recordings that is free of faults."""

import logging
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml

from wipx.app import main


@dataclass(frozen=True)
class Answer:
    """What a run left: exit status, standard output, standard error."""

    status: int
    out: str
    error: str


Program = Callable[..., Answer]


def program_in(folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Program:
    """Runs `python -m wipx` with the arguments given, in this process and in a folder."""

    def run(*arguments: str) -> Answer:
        monkeypatch.chdir(folder)
        monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
        monkeypatch.setattr(sys, "argv", ["wipx", *arguments])
        # Hydra closes the log handlers that there are; absl's closes the stream of pytest with it.
        monkeypatch.setattr(logging, "_handlerList", [])
        capsys.readouterr()
        status = main()
        written = capsys.readouterr()
        return Answer(status, written.out, written.err)

    return run


@pytest.fixture
def program(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Program:
    """The same in a folder of its own, untracked unless the test says otherwise."""
    run = program_in(tmp_path, capsys, monkeypatch)
    return lambda *arguments, tracking="none": run(f"tracking={tracking}", *arguments)


@dataclass(frozen=True)
class RecordingFolder:
    """A pendulum's recordings, made to be damaged.

    Attributes:
        path: The folder.
    """

    path: Path

    @property
    def robot(self) -> dict:
        """Content of robot.yaml."""
        return yaml.safe_load((self.path / "robot.yaml").read_text())

    def describe(self, robot: dict) -> None:
        """Replace robot.yaml."""
        (self.path / "robot.yaml").write_text(yaml.safe_dump(robot))

    @property
    def lines(self) -> list[str]:
        """Lines of b.csv, the header first."""
        return (self.path / "b.csv").read_text().splitlines()

    def write(self, lines: list[str]) -> None:
        """Replace b.csv."""
        (self.path / "b.csv").write_text("".join(f"{line}\n" for line in lines))

    def cell(self, line: int, column: int, text: str) -> None:
        """Replace one cell of b.csv; line 1 is the header."""
        lines = self.lines
        cells = lines[line - 1].split(",")
        cells[column] = text
        lines[line - 1] = ",".join(cells)
        self.write(lines)


@pytest.fixture
def folder(tmp_path: Path) -> RecordingFolder:
    """Two recordings a.csv and b.csv of a free swing, 200 rows of 10 ms each."""
    path = tmp_path / "swing"
    path.mkdir()
    recordings = RecordingFolder(path)
    body = {"body_mass": 0.8, "com_height": 0.45, "body_inertia": 0.037, "gravity": 9.81}
    recordings.describe({"plant": "pendulum", "parameters": body})
    t = np.arange(200) * 0.01
    theta = np.pi + 0.2 * np.cos(4.2 * t)
    rows = "\n".join(f"{a:.9g},{b:.9g},0" for a, b in zip(t, theta, strict=True))
    for name in ("a.csv", "b.csv"):
        (path / name).write_text(f"t,theta,u\n{rows}\n")
    return recordings
