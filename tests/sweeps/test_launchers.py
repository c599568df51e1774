"""Every launcher gives the results of the basic one; `make test-launchers`."""

import importlib.util
import json
import shutil
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import pytest
from sweeps.slurm import cluster
from sweeps.small_sweep import environment, logged, results, run

SEEDS = 2  # four jobs


@pytest.fixture(scope="module")
def basic(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("basic")
    answer = run(folder, SEEDS, "hydra/launcher=basic")
    assert answer.returncode == 0, answer.stderr
    assert len(results(folder)) == 2 * SEEDS
    return folder


@pytest.mark.slow
@pytest.mark.launchers
@pytest.mark.parametrize("launcher", ["joblib", "submitit_local", "submitit_slurm", "ray"])
def test_a_launcher_gives_the_results_of_the_basic_one(basic: Path, tmp_path: Path, launcher: str):
    if launcher == "ray" and importlib.util.find_spec("ray") is None:
        pytest.skip("Ray is not installed: python -m pip install 'wipx[ray]'")
    settings = {
        "submitit_slurm": ["hydra.launcher.mem_gb=1", "hydra.launcher.partition=debug"],
        "ray": ["+hydra.launcher.ray.init.num_cpus=2", "+hydra.launcher.ray.init._node_ip_address=127.0.0.1"],
    }
    shutil.copytree(basic / "runs" / "trials", tmp_path / "runs" / "trials")
    slurm = cluster(tmp_path / "slurm") if launcher == "submitit_slurm" else nullcontext({})
    quiet = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_AUTH_MODE": "disabled"}
    with slurm as found:
        answer = run(tmp_path, SEEDS, f"hydra/launcher={launcher}", *settings.get(launcher, []), **found, **quiet)
    assert answer.returncode == 0, answer.stderr
    assert results(tmp_path) == results(basic)
    assert logged(tmp_path) == logged(basic)


def blind(folder: Path, *launcher: str) -> dict:
    """Scores of a blind run of two robots, without the times that it took."""
    folder.mkdir()
    command = [sys.executable, "-m", "wipx", "+experiment=blind", "task.cases=2", "task.seed=8", "task.tiers=[nothing]"]
    command += ["task.baselines=[]", "tracking=none", *launcher]
    answer = subprocess.run(command, cwd=folder, env=environment(), capture_output=True, text=True, check=False)
    assert answer.returncode == 0, answer.stderr
    out = folder / "runs" / "blind" / "quick"
    scores = json.loads((out / "score.json").read_text())["cases"]
    assert all((out / "answers" / case / "wipx.opened.txt").is_file() for case in scores)  # under the witness
    return {case: {**methods["wipx"], "seconds": None} for case, methods in scores.items()}


@pytest.mark.slow
@pytest.mark.launchers
def test_blind_cases_handed_out_by_a_launcher_are_answered_as_in_one_process(tmp_path: Path):
    handed_out = blind(tmp_path / "handed_out", "hydra/launcher=submitit_local")
    assert len(handed_out) == 2
    assert handed_out == blind(tmp_path / "alone")
