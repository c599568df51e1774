"""`task=train` and the tables that are made of its sweeps, as a user runs them, on few robots."""

import json
from pathlib import Path

import pytest
from tasks.conftest import Program

SMALL = (
    "task=train",
    "method=pure_sim",
    "target=emulated_paper",
    "sim@target.engine=analytic",
    "target.engine.step=1e-3",
    "friction=none",
    "objective=paper",
    "objective.at_rest=true",
    "task.dataset.samples=300",
    "task.dataset.checked=5",
    "task.dataset.per_load=1",
    "sim.threads=1",
)


@pytest.mark.slow
def test_an_estimator_is_judged_on_simulated_and_on_recorded_robots(program: Program, tmp_path: Path):
    answer = program(*SMALL, "estimator=momentum_observer", "hydra.run.dir=job")
    assert answer.status == 0, answer.error
    result = json.loads((tmp_path / "job" / "result.json").read_text())["result"]
    assert len(result["simulated"]["pitch"]) == 30
    assert len(result["recorded"]["pitch"]) == 8
    for judged in (result["simulated"], result["recorded"]):
        low, estimate, high = judged["low"], judged["estimate"], judged["high"]
        assert all(a < b < c for a, b, c in zip(low, estimate, high, strict=True))
    assert result["latency"] > 0.0
    assert (tmp_path / "job" / "estimates.png").is_file()
    assert "nothing to do" in program(*SMALL, "estimator=momentum_observer", "hydra.run.dir=job").out


@pytest.mark.slow
def test_a_sweep_over_lengths_gives_the_second_table(program: Program, tmp_path: Path):
    label = "label='${hydra:runtime.choices.estimator}-${task.length}'"
    sweep = program(*SMALL, "estimator=cnn1d", "estimator.epochs=3", "task.length=20,80", "name=lengths", label, "-m")
    assert sweep.status == 0, sweep.error
    table = program("task=table_estimators", "task.folder=runs/lengths", "hydra.run.dir=table")
    assert table.status == 0, table.error
    assert "| cnn1d | 80 |" in table.out
    assert "0.005, 0.035" in table.out  # the paper's, beside
    for name in ("table.md", "table.tex", "lengths.png", "estimates.png"):
        assert (tmp_path / "table" / name).is_file()
    assert (tmp_path / "table" / "table.tex").read_text().startswith(r"\begin{tabular}")
    wrong = program("task=table_methods", "task.folder=runs/nowhere", "hydra.run.dir=table2")
    assert wrong.status == 2
    assert "no jobs here" in wrong.error


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ("task.length=81", "task.length is 81"),
        ("task.length=1", "task.length is 1"),
        ("task.dataset.samplse=10", "samplse"),
        ("task.dataset.mass=[2.0,1.0]", "mass"),
    ],
)
def test_bad_input_is_one_line(program: Program, change: str, expected: str):
    answer = program(*SMALL, f"++{change}" if "samplse" in change else change, "hydra.run.dir=bad")
    assert answer.status == 2
    assert expected in answer.error
    assert len(answer.error.strip().splitlines()) == 1
