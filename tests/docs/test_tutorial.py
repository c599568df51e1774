"""The code of the tutorial runs, and ends as its text says."""

import re
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "tutorial.md"


def test_tutorial_finds_the_friction_that_it_hides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    told: dict[str, Any] = {}
    for block in re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(), flags=re.DOTALL | re.MULTILINE):
        exec(compile(block, str(PAGE), "exec"), told)
    diagnosis = told["diagnosis"]
    assert diagnosis.verdict == "mismatch"
    assert [effect.name for effect in diagnosis.effects] == ["pitch/coulomb"]
    (level,) = diagnosis.effects[0].parameters
    assert level.low < told["FRICTION"] < level.high
    assert told["after"] < 0.2 * told["before"]
