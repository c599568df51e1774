"""A network of the residual acceleration: learned, added to the simulator, written and read."""

import importlib
from pathlib import Path

import numpy as np
import pytest
from baselines.driven_pendulum import NOISE, SIMULATOR, VISCOUS, case, pendulum, record

from wipx.baselines.learned_simulator import learned_simulator
from wipx.baselines.network import ResidualAcceleration, read_network
from wipx.baselines.residual_network import ResidualNetwork
from wipx.core.errors import InputError
from wipx.identify.evaluation import Judge


@pytest.mark.slow
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
