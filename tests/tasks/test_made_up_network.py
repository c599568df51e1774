"""A network is one class and one configuration file."""

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
from tasks.conftest import Program
from tasks.made_up import add_option
from tasks.test_train_task import SMALL
from torch import nn

from wipx.learn.onnx_model import read_estimator
from wipx.learn.recipe import NetworkRecipe


@dataclass(frozen=True, kw_only=True)
class Perceptron(NetworkRecipe):
    """One hidden layer."""

    hidden: int

    def body(self, length: int) -> nn.Module:
        return nn.Sequential(nn.Flatten(), nn.Linear(2 * length, self.hidden), nn.Tanh(), nn.Linear(self.hidden, 1))


@pytest.mark.slow
def test_a_network_in_one_file_is_trained_and_judged(program: Program, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    found = add_option(monkeypatch, tmp_path, "estimator", Perceptron, hidden=8, epochs=20)
    answer = program(*SMALL, "estimator=made_up", "estimator.hidden=12", found, "hydra.run.dir=out")
    assert answer.status == 0, answer.error
    result = json.loads((tmp_path / "out" / "result.json").read_text())["result"]
    assert result["estimator"] == "made_up"
    assert read_estimator(tmp_path / "out" / "estimator.onnx").card.kind == "Perceptron"
