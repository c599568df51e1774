"""What a rule is worth: every answer is made once, and the table counts what changes."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from wipx.core.errors import InputError
from wipx.proof.rule_ablation import ALL, Answer, RuleAblation, markdown

RIGHT = Answer(("pitch/coulomb",), "mismatch", True, False, None, {"gain": 90.0})


def test_the_table_counts_what_changes():
    wrong = Answer((), "consistent", False, False, None, {"gain": 0.0})
    weaker = replace(RIGHT, numbers={"gain": 89.0})
    answers = {ALL: [RIGHT, RIGHT], "same": [RIGHT, RIGHT], "weaker": [RIGHT, weaker], "wrong": [wrong, RIGHT]}
    table = markdown(answers)
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines() if line.startswith("|")]
    assert rows[0][3] == "names right (of 2)"
    assert rows[2:] == [
        [ALL, "0", "0", "2", "0", "0", "0"],
        ["wrong", "1", "1", "1", "0", "0", "0"],
        ["weaker", "0", "1", "2", "0", "0", "0"],
        ["same", "0", "0", "2", "0", "0", "0"],
    ]
    assert table.rstrip().endswith("Rules that change nothing here: same.")


def test_an_unknown_rule_is_refused():
    with pytest.raises(InputError, match=r"task.rules.*selection.least_share"):
        RuleAblation(rules=("selection.least_shar",))


@pytest.mark.slow
def test_a_run_goes_on_where_it_was_stopped(tmp_path: Path):
    settings = ("task.robots=1", "task.tiers=[nothing]", "task.lengths=[4,4]", "task.workers=1")
    command = [sys.executable, "-m", "wipx", "+experiment=ablation_rules", *settings, f"hydra.run.dir='{tmp_path}'"]

    def run(rules: str, *more: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*command, f"task.rules=[{rules}]", *more], capture_output=True, text=True, check=False)

    assert run("selection.least_gain").returncode == 0
    answers = tmp_path / "answers" / "case0001"
    made = (answers / f"{ALL}.json").stat().st_mtime_ns
    done = run("selection.least_gain,selection.least_share")
    assert done.returncode == 0
    assert (answers / f"{ALL}.json").stat().st_mtime_ns == made
    assert {path.stem for path in answers.glob("*.json")} == {ALL, "selection.least_gain", "selection.least_share"}
    assert (tmp_path / "table.md").read_text() in done.stdout
    refused = run("selection.least_gain", "task.seed=1")
    assert refused.returncode == 2
    assert "answers of other settings are here" in refused.stderr
