"""`task=baseline` from the command line: its files, its network in a prediction, its refusals."""

import importlib
import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from baselines.driven_pendulum import BODY, COULOMB, VISCOUS, Effects, record

from wipx.tasks.files.results import write_csv


def folder(path: Path, effects: Effects, rng: np.random.Generator) -> Path:
    path.mkdir()
    for recording in record(effects, rng):
        write_csv(path / recording.name, recording.columns)
    (path / "robot.yaml").write_text(yaml.safe_dump({"plant": "pendulum", "parameters": BODY}))
    return path


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    main = importlib.import_module("wipx.app").main
    monkeypatch.setattr("sys.argv", ["wipx", "tracking=none", "sim.threads=1", *arguments])
    return main()


def test_the_task_writes_what_the_contract_asks_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    seen, unseen, out = (
        folder(tmp_path / "seen", COULOMB, rng),
        folder(tmp_path / "unseen", COULOMB, rng),
        tmp_path / "out",
    )
    assert run(monkeypatch, "task=baseline", f"recordings.path={seen}", f"hydra.run.dir={out}") == 0
    content = json.loads((out / "diagnosis.json").read_text())
    assert content["verdict"] == "mismatch"
    assert sum(content["location"]["sites"].values()) == pytest.approx(1.0)
    for effect in content["effects"]:
        assert set(effect) >= {"name", "parameters", "equivalent"}
        assert all(number["ci95"] == [None, None] for number in effect["parameters"].values())
    predict = ["task=predict", f"recordings.path={unseen}", f"model.path={out / 'model.yaml'}"]
    assert run(monkeypatch, *predict, f"hydra.run.dir={tmp_path / 'p'}") == 0
    metrics = json.loads((tmp_path / "p" / "metrics.json").read_text())
    assert metrics["rms"]["theta"] < 0.5 * metrics["rms_nominal"]["theta"]


@pytest.mark.slow
def test_the_task_leaves_a_network_that_a_prediction_adds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fresh_seed: int
):
    pytest.importorskip("torch")
    rng = np.random.default_rng(fresh_seed)
    seen, out = folder(tmp_path / "seen", VISCOUS, rng), tmp_path / "out"
    learn = ("task=baseline", "baseline=residual_network", f"recordings.path={seen}", f"hydra.run.dir={out}")
    assert run(monkeypatch, *learn) == 0
    predict = ["task=predict", f"recordings.path={seen}", f"task.residual={out / 'residual.npz'}"]
    assert run(monkeypatch, *predict, f"hydra.run.dir={tmp_path / 'p'}") == 0
    metrics = json.loads((tmp_path / "p" / "metrics.json").read_text())
    assert metrics["rms"]["theta"] < 0.5 * metrics["rms_nominal"]["theta"]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("baseline=guesswork", "baseline: unknown option 'guesswork'"),
        ("baseline.seconds=0", "seconds is 0, expected a positive number"),
        ("baseline.population=3", "baseline: unknown key 'population'"),
    ],
)
def test_a_wrong_setting_gets_one_line(
    setting: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    seen = folder(tmp_path / "seen", {}, np.random.default_rng(0))
    out = tmp_path / "out"
    assert run(monkeypatch, "task=baseline", setting, f"recordings.path={seen}", f"hydra.run.dir={out}") == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.strip().splitlines()) == 1
    assert not out.exists()
