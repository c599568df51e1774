"""Networks learn the equilibrium pitch, say how sure they are, and give the same answers in the loop as in training."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from learn.network_robots import LENGTH, SMALL, coverage, prepared, rmse, robots, workshop

from wipx.learn.checkpoint import read_network
from wipx.learn.onnx_model import NetworkEstimator, read_estimator
from wipx.learn.training import divided, train
from wipx.learn.training_set import TrainingSet

TINY = replace(SMALL["cnn1d"], epochs=3)


@pytest.fixture(scope="module")
def training() -> TrainingSet:
    return robots(600, seed=0)


@pytest.fixture(scope="module")
def fresh() -> TrainingSet:
    return robots(1000, seed=1)


QUICK = ("cnn1d",)


@pytest.fixture(
    scope="module", params=[kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.slow) for kind in SMALL]
)
def made(request: pytest.FixtureRequest, training: TrainingSet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a trained network of each kind."""
    folder = tmp_path_factory.mktemp(request.param)
    prepared(SMALL[request.param], training, folder)
    return folder


def test_every_kind_of_network_learns_the_equilibrium_pitch(made: Path, fresh: TrainingSet):
    estimate = read_estimator(made / "estimator.onnx").estimate(fresh.windows)
    # Small networks, trained for seconds; a constant guess errs by the standard deviation, about 0.1 rad.
    assert rmse(estimate.pitch - fresh.pitch) < 0.2 * fresh.pitch.std()


def test_nine_of_ten_fresh_robots_lie_in_their_intervals(made: Path, fresh: TrainingSet):
    estimate = read_estimator(made / "estimator.onnx").estimate(fresh.windows)
    # Calibrated on 200 robots and counted on 1000: standard deviation sqrt(0.09 / 200 + 0.09 / 1000) = 0.023.
    assert coverage(estimate, fresh.pitch) == pytest.approx(0.9, abs=0.07)


def test_the_graph_answers_as_the_network_does(made: Path, fresh: TrainingSet):
    graph = read_estimator(made / "estimator.onnx", length=LENGTH, period=0.015)
    network = read_network(made / "estimator.npz")
    for some in (fresh.windows[:1], fresh.windows[:300]):
        np.testing.assert_allclose(graph.estimate(some).pitch, network.predict(some), rtol=0.0, atol=1e-5)


@pytest.mark.slow
def test_the_same_seed_trains_the_same_network(training: TrainingSet, fresh: TrainingSet, tmp_path: Path):
    first, again, other = (prepared(TINY, training, tmp_path, seed) for seed in (3, 3, 4))
    assert again == first
    assert rmse(other.estimate(fresh.windows).pitch - first.estimate(fresh.windows).pitch) > 1e-6


@pytest.mark.slow
def test_units_are_the_networks_own_business(training: TrainingSet, tmp_path: Path):
    per_unit, degrees = np.array([1000.0, 180.0 / np.pi]), 180.0 / np.pi
    other = replace(training, windows=training.windows * per_unit, pitch=training.pitch * degrees)
    metres = prepared(TINY, training, tmp_path)
    millimetres = prepared(TINY, other, tmp_path)
    pitch = metres.estimate(training.windows).pitch
    # Single precision, over the steps of three epochs.
    np.testing.assert_allclose(millimetres.estimate(other.windows).pitch / degrees, pitch, rtol=0.0, atol=1e-4)
    assert millimetres.card.half_width == pytest.approx(metres.card.half_width * degrees, rel=1e-2)


@pytest.mark.slow
def test_training_stops_early_and_keeps_the_best_weights(training: TrainingSet, tmp_path: Path):
    recipe = replace(TINY, epochs=100, patience=3, learning_rate=0.02, annealed=False)
    told: list[float] = []
    trained = train(recipe, workshop(training, tmp_path), lambda stage, share: told.append(share))
    stopping = divided(training.of("train")).stopping
    assert trained.epochs == trained.best_epoch + 3 < 100
    assert told == [pytest.approx((k + 1) / 100) for k in range(trained.epochs)]
    error = rmse(trained.network.predict(stopping.windows) - stopping.pitch)
    assert trained.stopping_rmse == pytest.approx(error, rel=1e-3)  # single precision


def test_a_budget_of_time_ends_a_training_after_an_epoch(training: TrainingSet, tmp_path: Path):
    told: list[float] = []
    recipe = replace(TINY, epochs=1000, seconds=1e-3)
    recipe.prepare(workshop(training, tmp_path), lambda stage, share: told.append(share))
    assert told == [1e-3]


def test_a_training_leaves_nothing_but_its_two_files(
    training: TrainingSet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    here, folder = tmp_path / "here", tmp_path / "folder"
    here.mkdir()
    folder.mkdir()
    monkeypatch.chdir(here)
    random = torch.get_rng_state()
    prepared(TINY, training, folder)
    assert sorted(path.name for path in folder.iterdir()) == ["estimator.npz", "estimator.onnx"]
    assert not list(here.iterdir())
    assert capfd.readouterr() == ("", "")
    assert torch.equal(torch.get_rng_state(), random)
    assert not torch.are_deterministic_algorithms_enabled()


def test_an_estimator_travels_to_other_processes(training: TrainingSet, tmp_path: Path):
    estimator = prepared(TINY, training, tmp_path)
    copy: NetworkEstimator = pickle.loads(pickle.dumps(estimator))
    assert copy.length == LENGTH
    np.testing.assert_array_equal(copy.estimate(training.windows).low, estimator.estimate(training.windows).low)
