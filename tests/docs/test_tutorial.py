"""The code of the tutorial runs, and ends as its text says."""

import re
import shlex
import sys
from pathlib import Path
from typing import Any

import pytest

from wipx.app import main

PAGE = Path(__file__).resolve().parents[2] / "docs" / "tutorial.md"


def blocks(language: str, text: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)


def run_code(text: str) -> dict[str, Any]:
    told: dict[str, Any] = {}
    for block in blocks("python", text):
        exec(compile(block, str(PAGE), "exec"), told)
    return told


@pytest.mark.slow
def test_tutorial_finds_the_friction_that_it_hides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    told = run_code(PAGE.read_text())
    diagnosis = told["diagnosis"]
    assert diagnosis.verdict == "mismatch"
    assert [effect.name for effect in diagnosis.effects] == ["pitch/coulomb"]
    (level,) = diagnosis.effects[0].parameters
    assert level.low < told["FRICTION"] < level.high
    assert told["after"] < 0.2 * told["before"]


@pytest.mark.slow
def test_three_commands_lead_from_a_raw_log_and_a_urdf_to_the_friction(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text()
    before, _, section = text.partition("## From a raw log")
    kept = before.partition("## Ask what is missing")[0]
    told = run_code(kept + section)
    (commands,) = blocks("sh", section)
    for line in commands.splitlines():
        monkeypatch.setattr(sys, "argv", ["wipx", "tracking=none", *shlex.split(line)[3:]])
        assert main() == 0, capsys.readouterr().err
    answer = re.search(r"Coulomb friction on swing \(F_c = ([0-9.]+) N m\) was left out", capsys.readouterr().out)
    assert answer is not None
    assert float(answer[1]) == pytest.approx(told["FRICTION"], rel=0.01)
