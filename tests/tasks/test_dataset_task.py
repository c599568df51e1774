"""`task=dataset`: a training set that later runs share, what it leaves, and what it refuses."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from wipx.core.errors import InputError
from wipx.core.load import Load
from wipx.core.model import ModelBatch
from wipx.core.nominal import NominalPlant
from wipx.identify.friction import JointFriction
from wipx.identify.method import Method
from wipx.identify.objectives import PaperTrajectories
from wipx.learn.dataset_file import read_training_set
from wipx.recordings.model_file import model_from_mapping
from wipx.recordings.source import RecordingSource
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import StateFeedback
from wipx.tasks.dataset import DECIDING, FOLDER, Dataset, training_set_of
from wipx.tasks.shared.job import Job

ROBOT = {
    "plant": "wip",
    "parameters": {
        "body_mass": 5.0,
        "wheel_mass": 1.2,
        "com_height": 0.35,
        "body_inertia": 0.15,
        "wheel_inertia": 0.0023,
        "wheel_radius": 0.0625,
    },
    "controller": {"kind": "lqr", "gains": [-10.0, 150.0, -21.0, 32.0], "rate": 650.0},
    "loads": {
        "left": {"mass": 0.8, "height": 0.5, "side": -0.1, "recordings": "left_*.csv"},
        "right": {"mass": 1.6, "height": 0.5, "side": 0.1, "recordings": "right_*.csv"},
    },
}
TYPICAL = ("task=dataset", "target=recordings", "objective=paper", "sim.threads=1", "sim.step=2e-3")


@pytest.fixture
def trials(tmp_path: Path) -> Path:
    """Two trials of a robot with a load each, and noise."""
    folder = tmp_path / "trials"
    folder.mkdir()
    (folder / "robot.yaml").write_text(yaml.safe_dump(ROBOT))
    model = model_from_mapping({key: ROBOT[key] for key in ("plant", "parameters")}, "test")
    inputs = Inputs.regular(1.25, 650.0, 1)
    rng = np.random.default_rng(0)
    for name, load in ROBOT["loads"].items():
        loaded = Load(load["mass"], load["height"], load["side"]).on(model)
        feedback = StateFeedback(np.array([ROBOT["controller"]["gains"]]))
        rows = len(inputs.t) - 1
        references = np.zeros((rows, 4, 1))
        run = AnalyticSimulator(2e-3).close_loop(ModelBatch(loaded), inputs, np.zeros((4, 1, 1)), feedback, references)
        shown = run.coordinates[:-1, :, 0, 0] + 5e-4 * rng.normal(size=(rows, 2))
        table = np.column_stack([inputs.t[:-1, 0], shown, run.commands[:, 0, 0, 0]])
        np.savetxt(folder / f"{name}_1.csv", table, "%.9g", ",", header="t,x,theta,u", comments="")
    return folder


def job(trials: Path, out: Path, method: str = "none") -> Job:
    """A run without a configuration: the bare rigid body, or joint friction at random."""
    parts = {
        "target": RecordingSource(path=str(trials)),
        "method": Method("none", "nominal") if method == "none" else Method("friction", "random"),
        "friction": JointFriction(("coulomb", "viscous")),
        "sim": AnalyticSimulator(2e-3, threads=1),
        "objective": PaperTrajectories(at_rest=True),
        "plant": NominalPlant(),
    }
    settings = {key: str(parts.get(key)) for key in DECIDING}
    chosen = {"method": method, "sim": "analytic", "task": "dataset"}
    return Job(out, 0, (), {}, {}, None, parts.__getitem__, lambda node, name: None, settings, chosen)


SMALL = Dataset(samples=60, checked=4)


@pytest.fixture
def datasets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that runs share."""
    monkeypatch.chdir(tmp_path)
    return tmp_path / FOLDER


def test_a_training_set_is_made_once_and_shared(trials: Path, datasets: Path):
    training, model, _ = training_set_of(job(trials, datasets, "random"), SMALL)
    (made,) = datasets.glob("*.parquet")
    before = made.stat().st_mtime_ns
    again, again_model, _ = training_set_of(job(trials, datasets, "random"), SMALL)
    assert made.stat().st_mtime_ns == before
    assert again.card == training.card
    assert again_model == model
    assert np.array_equal(again.windows, training.windows)


def test_random_numbers_are_drawn_afresh_for_every_robot(trials: Path, datasets: Path):
    training, model, _ = training_set_of(job(trials, datasets, "random"), SMALL)
    simulations: Any = training.card["simulations"]
    assert simulations["count"] == 60
    assert set(model.effects) == {
        f"{joint}/{kind}" for joint in ("translation", "pitch") for kind in ("coulomb", "viscous")
    }


def test_whatever_decides_a_training_set_makes_another_one(
    trials: Path, datasets: Path, monkeypatch: pytest.MonkeyPatch
):
    path = trials / "left_1.csv"
    training_set_of(job(trials, datasets), SMALL)
    training_set_of(job(trials, datasets), replace(SMALL, lean=1e-3))
    training_set_of(replace(job(trials, datasets), seed=1), SMALL)
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    training_set_of(job(trials, datasets), SMALL)
    monkeypatch.setattr("wipx.tasks.dataset.simulator_digest", lambda: "of another simulator")
    training_set_of(job(trials, datasets), SMALL)
    assert len(list(datasets.glob("*.parquet"))) == 5


def test_a_robot_without_controller_is_refused(trials: Path, datasets: Path):
    (trials / "robot.yaml").write_text(yaml.safe_dump({k: v for k, v in ROBOT.items() if k != "controller"}))
    with pytest.raises(InputError, match=r"add the robot's `controller` to robot\.yaml"):
        training_set_of(job(trials, datasets), SMALL)


def test_the_task_leaves_pictures_and_says_where_the_training_set_is(program, trials: Path, tmp_path: Path):
    answer = program(*TYPICAL, f"target.path={trials}", "task.samples=60", "method=pure_sim", "hydra.run.dir=out")
    assert answer.status == 0, answer.error
    result = json.loads((tmp_path / "out/result.json").read_text())["result"]
    assert result["path"] in answer.out
    check: Any = read_training_set(tmp_path / result["path"]).card["label_check"]
    assert check["largest_difference"] < 1e-4
    assert {"labels.png", "windows.png"} <= {path.name for path in (tmp_path / "out").iterdir()}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("task.mass=[2.0,1.0]",), "mass is [2, 1] kg"),
        (("objective=windowed",), "choose objective=paper"),
        (("method=ours", "optimizer.evaluations=0"), "evaluations is 0"),
    ],
)
def test_settings_at_fault_are_refused_in_one_line(program, trials: Path, arguments: tuple[str, ...], message: str):
    changed = [argument.partition("=")[0] for argument in arguments]
    kept = [argument for argument in TYPICAL if argument.partition("=")[0] not in changed]
    answer = program(*kept, f"target.path={trials}", *arguments)
    assert answer.status == 2
    assert message in answer.error
    assert len(answer.error.splitlines()) == 1
