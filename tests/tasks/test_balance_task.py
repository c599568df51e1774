"""`task=balance`: a humanoid with a payload in its hand that its controllers do not know."""

import json
from pathlib import Path

import pytest


@pytest.mark.slow
def test_the_estimated_balance_stands_in_place_where_the_nominal_one_does_not(program, tmp_path: Path):
    made = program("task=balance", "sim=mujoco", "task.settle=5", "task.rest=3", "hydra.run.dir=out")
    assert (made.status, made.error) == (0, "")
    trials = json.loads((tmp_path / "out" / "metrics.json").read_text(encoding="utf-8"))["trials"]
    nominal, estimated = trials
    assert not nominal["balances"]
    assert not nominal["tracks"]
    assert estimated["balances"]
    assert estimated["tracks"]
    assert estimated["mass"] == pytest.approx(1.0, abs=0.15)
    assert estimated["aimed"] == pytest.approx(estimated["true"], abs=0.003)
    assert (tmp_path / "out" / "balance.png").stat().st_size > 0


def test_an_example_that_does_not_balance_is_refused(program):
    answer = program("task=balance", "task.robot=leg")
    assert answer.status == 2
    assert "does not balance" in answer.error
