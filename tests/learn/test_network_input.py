"""What networks are given by mistake is refused in one line."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import pytest
from learn.network_robots import LENGTH, SMALL, prepared, robots, workshop

from wipx.config import build
from wipx.core.errors import InputError
from wipx.learn.checkpoint import read_network
from wipx.learn.conformal import half_width
from wipx.learn.networks.cnn1d import Cnn1d
from wipx.learn.networks.recurrent import Gru, Lstm
from wipx.learn.networks.tcn import Tcn
from wipx.learn.networks.transformer import Transformer
from wipx.learn.onnx_model import NetworkEstimator, read_estimator
from wipx.learn.recipe import NetworkRecipe
from wipx.learn.training_set import PARTS, TrainingSet


@pytest.fixture(scope="module")
def training() -> TrainingSet:
    return robots(90, seed=2)


@pytest.fixture(scope="module")
def folder(training: TrainingSet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made")
    prepared(replace(SMALL["cnn1d"], epochs=1), training, folder)
    return folder


@pytest.fixture
def estimator(folder: Path) -> NetworkEstimator:
    return read_estimator(folder / "estimator.onnx")


def refused(call: Callable[[], object]) -> str:
    """The one line in which a call is refused."""
    with pytest.raises(InputError) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize("shape", [(3, LENGTH - 1, 2), (LENGTH, 2), (3, LENGTH, 4)], ids=["short", "flat", "rates"])
def test_windows_of_another_shape_are_refused(estimator: NetworkEstimator, shape: tuple[int, ...]):
    message = refused(lambda: estimator.estimate(np.zeros(shape)))
    assert f"shape {shape}, expected (N, {LENGTH}, 2)" in message
    assert "15 ms apart" in message


def test_a_gap_in_a_window_is_named(estimator: NetworkEstimator):
    windows = np.zeros((5, LENGTH, 2))
    windows[3, 17, 1] = np.nan
    assert "theta of window 3, sample 17 is nan" in refused(lambda: estimator.estimate(windows))


def test_an_estimator_of_another_length_or_rate_is_refused(folder: Path):
    path = folder / "estimator.onnx"
    assert f"windows of {LENGTH} samples, expected 80" in refused(lambda: read_estimator(path, length=80))
    assert "15 ms apart, expected 10 ms" in refused(lambda: read_estimator(path, period=0.01))


def test_files_of_another_version_are_refused(folder: Path, tmp_path: Path):
    graph, weights = tmp_path / "old.onnx", tmp_path / "old.npz"
    model = onnx.load_model(folder / "estimator.onnx")
    onnx.helper.set_model_props(model, {"wipx": '{"version": 0}'})
    graph.write_bytes(model.SerializeToString())
    with np.load(folder / "estimator.npz") as content:
        np.savez(weights, **{**content, "card": np.array('{"version": 0}')})
    assert "old.onnx: an estimator of version 0, expected version 1" in refused(lambda: read_estimator(graph))
    assert "old.npz: a network of version 0, expected version 1" in refused(lambda: read_network(weights))


def test_files_that_hold_no_network_are_refused(folder: Path, tmp_path: Path):
    absent, garbage, foreign = tmp_path / "absent", tmp_path / "garbage", tmp_path / "foreign.onnx"
    garbage.write_bytes(b"t,x,theta\n0.0,0.0,0.0\n")
    model = onnx.load_model(folder / "estimator.onnx")
    del model.metadata_props[:]
    foreign.write_bytes(model.SerializeToString())
    cut = tmp_path / "cut.npz"
    cut.write_bytes((folder / "estimator.npz").read_bytes()[:2000])
    for path in (absent, tmp_path):
        assert "cannot be read" in refused(lambda path=path: read_estimator(path))
        assert "cannot be read" in refused(lambda path=path: read_network(path))
    for path in (garbage, foreign):
        assert "no estimator of the equilibrium pitch" in refused(lambda path=path: read_estimator(path))
    elsewhere = tmp_path / "elsewhere.npz"
    with np.load(folder / "estimator.npz") as content:
        card = str(content["card"]).replace("wipx.learn.networks.cnn1d.Cnn1d", "os.path.join")
        np.savez(elsewhere, **{**content, "card": np.array(card)})
    for path in (garbage, foreign, cut, elsewhere):
        assert "no network" in refused(lambda path=path: read_network(path))


def test_training_sets_that_cannot_be_learned_from_are_refused(training: TrainingSet, tmp_path: Path):
    recipe = SMALL["cnn1d"]

    def prepare(robots: TrainingSet) -> str:
        return refused(lambda: recipe.prepare(workshop(robots, tmp_path), lambda stage, share: None))

    few = np.where(np.arange(90) < 82, PARTS.index("train"), PARTS.index("validation"))
    assert "8 validation robots to calibrate the 90 % interval on, expected 9" in prepare(replace(training, part=few))
    none = np.full(90, PARTS.index("validation"))
    assert "0 robots to learn from, expected 10" in prepare(replace(training, part=none))
    holed = training.windows.copy()
    holed[7, 3, 0] = np.inf
    assert "windows of robot 7" in prepare(replace(training, windows=holed))
    assert not list(tmp_path.iterdir())


def test_a_missing_package_is_named(training: TrainingSet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "lightning", None)
    assert "need the package lightning" in refused(lambda: prepared(SMALL["gru"], training, tmp_path))


def test_a_training_that_diverges_says_what_to_change(training: TrainingSet, tmp_path: Path):
    hasty = replace(SMALL["cnn1d"], learning_rate=1e30)
    assert "diverges at learning_rate 1e+30; make it smaller" in refused(lambda: prepared(hasty, training, tmp_path))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("kind", "settings", "complaint"),
    [
        (Lstm, {"kernel": 3}, "estimator: unknown key 'kernel'"),
        (Tcn, {}, "estimator.kernel is missing; give estimator.kernel=VALUE"),
        (Transformer, {"heads": 3}, "estimator.width is 16, expected a multiple of twice estimator.heads = 3"),
        (Cnn1d, {"kernel": 4}, "estimator.kernel is 4, expected an odd number"),
        (Gru, {"layers": 0}, "estimator.layers is 0, expected a positive number"),
        (Gru, {"epochs": 0}, "estimator.epochs is 0, expected a positive number"),
        (Gru, {"weight_decay": -1.0}, "estimator.weight_decay is -1"),
    ],
)
def test_settings_that_make_no_network_are_refused(kind: type[NetworkRecipe], settings, complaint: str):
    node = {"_target_": f"{kind.__module__}.{kind.__name__}", "width": 16, "layers": 2, "epochs": 3, **settings}
    assert complaint in refused(lambda: build(node, "estimator"))


def test_the_half_width_is_the_quantile_that_a_fresh_error_keeps():
    assert half_width(np.arange(-9.0, 0.0), 0.9) == 9.0  # of nine errors the largest
    assert half_width(np.arange(1.0, 100.0), 0.9) == 90.0
    message = refused(lambda: half_width(np.zeros(8), 0.9))
    assert "8 validation robots to calibrate the 90 % interval on, expected 9 at least" in message


def test_a_fresh_error_lies_within_the_half_width_as_often_as_promised():
    errors = np.random.default_rng(0).standard_cauchy((20000, 26))  # any law will do
    covered = np.mean([abs(row[0]) <= half_width(row[1:], 0.9) for row in errors])
    # Of 25 errors the ceil(23.4) = 24th: 24/26 of the time; 20000 draws scatter by 0.002.
    assert covered == pytest.approx(24 / 26, abs=0.008)
