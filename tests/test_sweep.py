"""A sweep as a user starts it and asks about it."""

import json
from pathlib import Path

import pytest
from tasks.conftest import program_in
from test_app import CommandLine

from wipx.core.errors import InputError
from wipx.sweep import check_launcher


@pytest.mark.slow
def test_a_sweep_tells_how_far_it_is_and_can_be_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    answer = CommandLine(tmp_path, capsys, monkeypatch)(
        "-m", "name=mixed", "label='${task.behaviour}'", "task.behaviour=refuse,succeed"
    )
    assert answer.status == 2
    assert "runs/mixed: 2 jobs: 1 done, 1 failed; why: task=status" in answer.error

    asked = program_in(tmp_path, capsys, monkeypatch)("task=status", "experiment=mixed")
    assert (asked.status, asked.error) == (0, "")
    assert "2 jobs: 1 done, 1 failed" in asked.out
    assert "failed  refuse: r3.csv row 812: t decreases; sort or drop the row" in asked.out
    (written,) = tmp_path.glob("runs/status/*/status.json")
    content = json.loads(written.read_text())
    assert [job["state"] for job in content["jobs"]] == ["failed", "done"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("-m", "seed=1,2", "hydra/launcher=slurm"), "hydra/launcher: unknown option 'slurm'; valid: basic, joblib, r"),
        (("-m", "hydra/launcher=joblib", "hydra.launcher.n_job=3"), "unknown key 'n_job'; did you mean n_jobs?"),
        (("seed=1", "seed=2"), "seed=1 and seed=2 contradict each other; leave one of them out"),
        (("task=status", "experiment=nothing"), "runs/nothing/sweep.json: no sweep was started here"),
        (("-m", "seed=1,2", "tracking.uri=http://127.0.0.1:9"), "tracking.uri http://127.0.0.1:9: no answer"),
    ],
)
def test_a_sweep_that_cannot_be_is_refused_in_one_line(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    message: str,
):
    answer = program_in(tmp_path, capsys, monkeypatch)(*arguments)
    assert answer.status == 2
    assert message in answer.error
    assert answer.error.count("\n") == 1
    assert not list(tmp_path.rglob("config.yaml"))


def test_a_launcher_without_its_packages_says_what_to_install(monkeypatch: pytest.MonkeyPatch):
    def missing(name: str):
        raise ModuleNotFoundError(name=name)

    monkeypatch.setattr("importlib.import_module", missing)
    with pytest.raises(InputError, match=r"hydra/launcher=ray needs packages .*pip install 'wipx\[ray\]'"):
        check_launcher("hydra_plugins.hydra_ray_launcher.ray_launcher.RayLauncher", "ray")


def test_slurm_is_refused_where_there_is_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("PATH", str(tmp_path))
    pytest.importorskip("hydra_plugins.hydra_submitit_launcher")
    with pytest.raises(InputError, match="no sbatch on this machine"):
        check_launcher("hydra_plugins.hydra_submitit_launcher.submitit_launcher.SlurmLauncher", "submitit_slurm")
