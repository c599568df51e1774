"""Baselines on pendulums that hang and are driven by sums of sines: stable, so that no controller is needed."""

import importlib
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import yaml

from wipx.baselines.all_at_once import AllAtOnce
from wipx.baselines.case import Baseline, Problem
from wipx.baselines.learned_simulator import learned_simulator
from wipx.baselines.motion import motions
from wipx.baselines.network import ResidualAcceleration, read_network
from wipx.baselines.paper import PaperFriction
from wipx.baselines.regression import TorqueRegression
from wipx.baselines.residual_network import ResidualNetwork
from wipx.baselines.sparse_regression import SparseRegression
from wipx.baselines.torque import TorqueData
from wipx.core.errors import InputError
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.core.recording import Recording
from wipx.identify.evaluation import Judge
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.tasks.files.results import write_csv

SIMULATOR = AnalyticSimulator(threads=1)
BODY = {"body_mass": 0.8, "com_height": 0.45, "body_inertia": 0.037}
NOISE = 3e-4  # [rad]
RATE = 200.0  # [Hz]
COULOMB = {"pitch/coulomb": {"F_c": 0.15}}
VISCOUS = {"pitch/viscous": {"sigma": 0.08}}
Effects = Mapping[str, Mapping[str, float]]

NAMING = {
    "regression": TorqueRegression(seconds=5.0),
    "sparse_regression": SparseRegression(seconds=5.0),
    "all_at_once": AllAtOnce(seconds=8.0),
    "paper": PaperFriction(seconds=4.0),
}


def pendulum(effects: Effects) -> Model:
    plant = plant_of("pendulum")
    return Model(plant, plant.complete(BODY, "test"), effects)


def record(
    effects: Effects, rng: np.random.Generator, *, count: int = 3, noise: float = NOISE, drive: float = 0.4
) -> tuple[Recording, ...]:
    inputs = Inputs.regular(8.0, RATE, 1, count)
    t = inputs.t[:-1, 0]
    frequencies, phases = rng.uniform(0.2, 1.5, (4, count)), rng.uniform(0.0, 6.28, (4, count))
    command = drive * np.sin(6.28 * t[:, None, None] * frequencies + phases).sum(axis=1)
    driven = Inputs(inputs.t, command[:, None], inputs.first, inputs.last)
    initial = np.stack([np.full((1, count), np.pi), np.zeros((1, count))])
    theta = SIMULATOR.replay(ModelBatch(pendulum(effects)), driven, initial).coordinates[:-1, 0, 0]
    theta = theta + noise * rng.standard_normal(theta.shape)
    return tuple(Recording(f"r{r}.csv", {"t": t, "theta": theta[:, r], "u": command[:, r]}) for r in range(count))


def case(effects: Effects, rng: np.random.Generator, noise: float = NOISE) -> Problem:
    return Problem(record(effects, rng, noise=noise), pendulum({}), {}, SIMULATOR)


@pytest.mark.parametrize("name", NAMING)
@pytest.mark.parametrize(
    "effects", [COULOMB, pytest.param(VISCOUS, marks=pytest.mark.slow)], ids=["coulomb", "viscous"]
)
def test_a_baseline_finds_clear_friction_and_predicts_better(name: str, effects: Effects, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    given = case(effects, rng)
    answer = NAMING[name].answer(given, rng)
    assert answer.mismatch
    friction = {"pitch/coulomb", "pitch/stribeck", "pitch/presliding", "pitch/viscous", "pitch/quadratic_drag"}
    assert friction & {found.name for found in answer.found}
    judge = Judge(SIMULATOR, given.noise, 0.5)
    errors, _ = judge.compare(given.nominal, answer.model, record(effects, rng), held_out=True)
    assert errors.completed["theta"] < 0.5 * errors.nominal["theta"]


@pytest.mark.parametrize("effects", [COULOMB, VISCOUS], ids=["coulomb", "viscous"])
def test_regression_finds_the_size_of_friction(effects: Effects, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    answer = TorqueRegression().answer(case(effects, rng), rng)
    ((name, true),) = effects.items()
    found = {f.name: f for f in answer.found}
    assert name in found
    for symbol, value in true.items():
        # a few per cent: the filter rounds reversals, and small companions may take a share
        assert found[name].parameters[symbol] == pytest.approx(value, rel=0.15)


def test_a_network_predicts_better_and_names_nothing(fresh_seed: int):
    pytest.importorskip("torch")
    rng = np.random.default_rng(fresh_seed)
    given = case(VISCOUS, rng)
    answer = ResidualNetwork(seconds=5.0).answer(given, rng)
    assert answer.mismatch
    assert not answer.found
    assert answer.network is not None
    unseen = record(VISCOUS, rng)
    nominal, _ = Judge(SIMULATOR, given.noise, 0.5).compare(given.nominal, given.nominal, unseen, held_out=True)
    learned = Judge(learned_simulator(answer.network, given.noise), given.noise, 0.5)
    errors, _ = learned.compare(given.nominal, given.nominal, unseen, held_out=True)
    assert errors.completed["theta"] < 0.5 * nominal.nominal["theta"]


def test_a_network_finds_nothing_where_nothing_is_missing(fresh_seed: int):
    pytest.importorskip("torch")
    rng = np.random.default_rng(fresh_seed)
    answer = ResidualNetwork(seconds=5.0).answer(case({}, rng), rng)
    assert not answer.mismatch
    assert answer.network is None


def test_without_pytorch_a_network_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch):
    def absent(name: str):
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(importlib, "import_module", absent)
    with pytest.raises(InputError, match=r"needs PyTorch; pip install torch=="):
        ResidualNetwork().answer(case({}, np.random.default_rng(0)), np.random.default_rng(0))


@pytest.mark.parametrize(
    "effects",
    [
        VISCOUS,
        {"actuator/gain": {"k": 0.8}},
        {"actuator/delay": {"tau": 0.02}},
        {"geometry/payload": {"mass": 0.1, "height": 0.3}},
        {"sensor_theta/scale": {"e": 0.05}},
    ],
    ids=lambda effects: next(iter(effects)),
)
def test_the_torque_residual_of_the_true_model_vanishes_without_noise(effects: Effects, fresh_seed: int):
    recordings = record(effects, np.random.default_rng(fresh_seed), noise=0.0, drive=0.05)
    data = TorqueData(motions(recordings, plant_of("pendulum"), np.array([NOISE])))
    true, nominal = (np.std(data.residual(pendulum(e))) for e in (effects, {}))
    assert true < 0.05 * nominal  # the filter does not commute with the sine of the angle; small swings


def silent(joints: int, features: int) -> ResidualAcceleration:
    """A network that always answers zero."""
    low = -np.ones(features)
    weights = np.zeros((3, features + 1)), np.zeros((3, 4)), np.zeros((joints, 4))
    return ResidualAcceleration(low, -low, *weights, scale=np.ones(joints))


def test_without_learned_acceleration_rollouts_are_those_of_the_simulator(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    (recording,) = record(VISCOUS, rng, count=1)
    judges = (Judge(s, np.array([NOISE]), 0.5) for s in (SIMULATOR, learned_simulator(silent(1, 3), np.array([NOISE]))))
    analytic, learned = (judge.predict(pendulum(VISCOUS), (recording,))[0] for judge in judges)
    np.testing.assert_allclose(learned, analytic, atol=0.1 * NOISE)


def test_a_network_is_read_as_it_was_written(tmp_path: Path):
    rng = np.random.default_rng(1)
    network = ResidualAcceleration(
        -np.ones(3), np.ones(3), rng.normal(size=(4, 4)), rng.normal(size=(4, 5)), rng.normal(size=(1, 5)), np.ones(1)
    )
    network.write(tmp_path / "residual.npz")
    again = read_network(tmp_path / "residual.npz", features=3, joints=1)
    inputs = rng.normal(size=(3, 7))
    np.testing.assert_array_equal(network(inputs), again(inputs))


@pytest.mark.parametrize(
    ("content", "message"),
    [(None, "cannot be read"), (b"not a network", "no network"), ("other", "expected 3 and 1 for this plant")],
)
def test_a_file_that_is_no_network_gets_one_line(tmp_path: Path, content: object, message: str):
    path = tmp_path / "residual.npz"
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        silent(2, 5).write(path)
    with pytest.raises(InputError, match=message) as caught:
        read_network(path, features=3, joints=1)
    assert "\n" not in str(caught.value)


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


def test_every_baseline_keeps_to_the_protocol():
    baselines: list[Baseline] = [*NAMING.values(), ResidualNetwork()]
    assert all(baseline.seconds > 0.0 for baseline in baselines)
