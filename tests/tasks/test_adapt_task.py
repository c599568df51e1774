"""`task=adapt` and what is made of its sweeps, as a user runs them, on a small emulated robot."""

import json
from pathlib import Path

import numpy as np
import pytest
from tasks.conftest import Program

ROBOT = (
    "target=emulated_paper",
    "sim@target.engine=analytic",
    "target.engine.step=1e-3",
    "task.per_load=2",
    "task.held_out=[b3]",
    "friction=coulomb_viscous",
    "objective=paper",
    "objective.at_rest=true",
    "objective.samples=40",
    "task.duration=0.65",
    "sim.threads=1",
)
SEARCH = ("optimizer=least_squares", "optimizer.starts=1")


@pytest.fixture(scope="module")
def trials(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for trials, which are recorded by the first test that needs them."""
    return tmp_path_factory.mktemp("trials")


@pytest.fixture
def with_trials(program: Program, tmp_path: Path, trials: Path) -> Program:
    """The program in a folder that shares its trials with other tests."""
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "trials").symlink_to(trials)
    return program


def result(folder: Path) -> dict:
    return json.loads((folder / "result.json").read_text())["result"]


@pytest.mark.slow
def test_an_adapted_simulation_is_closer_to_the_robot_also_with_loads_it_never_saw(program: Program, tmp_path: Path):
    before = program("task=adapt", "method=pure_sim", *ROBOT, "hydra.run.dir=before")
    after = program("task=adapt", "method=ours", *ROBOT, *SEARCH, "hydra.run.dir=after")
    assert (before.status, after.status) == (0, 0), before.error + after.error
    pure, ours = result(tmp_path / "before"), result(tmp_path / "after")
    assert ours["held_out"]["value"] < 0.1 * pure["held_out"]["value"]
    assert ours["held_out"]["floor"] < ours["held_out"]["value"]
    held_out = [c["name"] for c in ours["classes"] if c["held_out"]]
    assert held_out == ["b3"]
    for name, value in ours["parameters"].items():
        low, high = ours["intervals"][name]
        assert low <= value <= high
    for name in ("model.yaml", "trajectories.csv", "trajectories.png", "search.png", "config.yaml"):
        assert (tmp_path / "after" / name).is_file()


@pytest.mark.slow
def test_a_finished_job_is_not_repeated_and_one_with_other_settings_is_refused(program: Program, tmp_path: Path):
    first = program("task=adapt", "method=pure_sim", *ROBOT, "hydra.run.dir=job")
    assert first.status == 0, first.error
    written = (tmp_path / "job" / "result.json").stat().st_mtime_ns
    again = program("task=adapt", "method=pure_sim", *ROBOT, "hydra.run.dir=job")
    assert again.status == 0
    assert "nothing to do" in again.out
    assert (tmp_path / "job" / "result.json").stat().st_mtime_ns == written
    other = program("task=adapt", "method=pure_sim", *ROBOT, "seed=7", "hydra.run.dir=job")
    assert other.status == 2
    assert "seed (0 before, 7 now)" in other.error


@pytest.mark.slow
def test_a_robot_emulated_by_another_simulator_is_recorded_anew(
    program: Program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    for simulator in ("before", "before", "after"):
        monkeypatch.setattr("wipx.tasks.shared.trials.simulator_digest", lambda simulator=simulator: simulator)
        run = program("task=adapt", "method=pure_sim", *ROBOT, f"hydra.run.dir={simulator}")
        assert run.status == 0, run.error
    assert len([folder for folder in (tmp_path / "runs" / "trials").iterdir() if folder.is_dir()]) == 2


@pytest.mark.slow
def test_a_sweep_gives_a_table_and_one_with_a_failed_job_does_not(program: Program, tmp_path: Path):
    sweep = ("task=adapt", *ROBOT, "name=gap", "label='${hydra:runtime.choices.method}'", *SEARCH, "-m")
    assert program(*sweep, "method=pure_sim,ours").status == 0
    table = program("task=method_table", "task.folder=runs/gap", "hydra.run.dir=table")
    assert table.status == 0, table.error
    assert "| pure_sim |" in table.out
    assert (tmp_path / "table" / "trajectories.png").is_file()
    failed = program(*sweep, "method=pure_sim,sim_param_opt", "bounds.nonsense=[0,1]")
    assert failed.status == 2
    assert "nonsense" in (tmp_path / "runs" / "gap" / "sim_param_opt" / "error.txt").read_text()
    holes = program("task=method_table", "task.folder=runs/gap", "hydra.run.dir=table2")
    assert holes.status == 2
    assert "1 failed" in holes.error
    assert not (tmp_path / "table2").exists() or not any((tmp_path / "table2").iterdir())


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("task.held_out=[nothing]",), "there is no load 'nothing'"),
        (("objective=multi_step",), "choose objective=paper"),
        (("method.values=random",), "leaves nothing to do"),
        (("target=recordings", "target.path=nowhere"), "nowhere"),
    ],
)
def test_bad_input_is_one_line(with_trials: Program, change: tuple[str, ...], expected: str):
    keep = [a for a in ROBOT if not (a.startswith(("target", "sim@target")) and change[0].startswith("target"))]
    keep = [a for a in keep if not (a.startswith("objective") and change[0].startswith("objective"))]
    keep = [a for a in keep if a.partition("=")[0] != change[0].partition("=")[0]]
    answer = with_trials("task=adapt", "method=pure_sim", *keep, *change, "hydra.run.dir=bad")
    assert answer.status == 2
    assert expected in answer.error
    assert len(answer.error.strip().splitlines()) == 1


def test_the_friction_figure_shows_the_papers_curve(program: Program, tmp_path: Path):
    assert program("task=friction_figure", "hydra.run.dir=figure").status == 0
    table = np.genfromtxt(tmp_path / "figure" / "friction.csv", delimiter=",", names=True)
    fast = np.abs(table["velocity"]) > 0.9
    np.testing.assert_allclose(table["eq5"][fast], table["baseline"][fast], atol=2e-4)  # Stribeck's peak is over
    assert np.max(table["eq5"]) == pytest.approx(0.15, abs=1e-3)
    refused = program("task=friction_figure", "task.zeta.F_x=1", "hydra.run.dir=bad")
    assert refused.status == 2
    assert "F_x" in refused.error


@pytest.mark.slow
def test_a_model_that_was_completed_before_is_taken_as_it_is(program: Program, tmp_path: Path):
    assert program("task=adapt", "method=ours", *ROBOT, *SEARCH, "hydra.run.dir=ours").status == 0
    path = "model.path=ours/model.yaml"
    taken = program("task=adapt", "method=diagnosed", path, *ROBOT, "hydra.run.dir=taken")
    assert taken.status == 0, taken.error
    before, after = result(tmp_path / "ours"), result(tmp_path / "taken")
    assert after["held_out"]["value"] == pytest.approx(before["held_out"]["value"], rel=1e-9)
    assert after["fit"]["value"] == pytest.approx(before["fit"]["value"], rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("method=diagnosed",), "give model.path=FOLDER/model.yaml"),
        (("method=pure_sim", "model.path=m.yaml"), "choose method=diagnosed"),
        (("method=diagnosed", "model.path=m.yaml"), "m.yaml"),
    ],
)
def test_a_model_and_a_method_that_do_not_fit_are_refused(
    with_trials: Program, arguments: tuple[str, ...], expected: str
):
    answer = with_trials("task=adapt", *arguments, *ROBOT, "hydra.run.dir=bad")
    assert answer.status == 2
    assert expected in answer.error
