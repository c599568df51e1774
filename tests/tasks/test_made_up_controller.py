"""A controller is one class and one configuration file: tasks read what they need from its interface."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
import pytest
from tasks.conftest import Program
from tasks.made_up import add_option
from tasks.test_margins_task import QUICK

from wipx.control.controller import Controller, PitchEstimator
from wipx.control.filtered_loop import FilteredLoop
from wipx.control.linear_law import LinearLaw
from wipx.control.lqr import Lqr
from wipx.control.release_window import ReleaseWindow
from wipx.core.model import Model

RAILS: list[float] = []


@dataclass(frozen=True)
class TwoStep(Controller):
    """The baseline's gains; once its window is full, about the pitch that the estimator found."""

    rate: float = 650.0
    limit: float = 100.0
    asks_estimator: ClassVar[bool] = True

    @property
    def moves_balance(self) -> bool:
        return True

    def on_rail(self, half: float) -> Self:
        RAILS.append(half)
        return self

    def law(self, model: Model) -> LinearLaw:
        return Lqr(rate=self.rate).law(model)

    def loop(self, model: Model, estimator: PitchEstimator | None = None) -> "TwoStepLoop":
        assert estimator is not None
        return TwoStepLoop(self, model, estimator)


class TwoStepLoop(FilteredLoop):
    def __init__(self, settings: TwoStep, model: Model, balance: PitchEstimator) -> None:
        super().__init__(Lqr().estimator(model), settings.rate, settings.limit)
        self.gains, self.asked = settings.law(model).gains, balance
        self.window = ReleaseWindow(balance.length, balance.period)

    def reset(self, t: float, measured: np.ndarray) -> None:
        super().reset(t, measured)
        self.window.reset(t)
        self.released, self.balance, self.notes = t, 0.0, ()

    def wanted(self, t: float, state: np.ndarray, measured: np.ndarray, reference: np.ndarray) -> np.ndarray:
        self.window.see(t, measured)
        samples = self.window.samples()
        if not self.notes and samples is not None and t - self.released > self.asked.length * self.asked.period:
            self.balance = float(self.asked.estimate(samples[None]).pitch[0])
            self.notes = (f"it balances at {self.balance:.3f} rad",)
        return -self.gains @ (state - reference - np.array([0.0, self.balance or 0.0, 0.0, 0.0]))


OWN = [argument for argument in QUICK if "task.controllers" not in argument]
SHIPPED = ("lqr", "lqr_equilibrium", "lqi", "mpc", "mpc_offset_free", "pid")


@pytest.fixture
def made_up(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> str:
    """The argument that adds controller=made_up."""
    RAILS.clear()
    return add_option(monkeypatch, tmp_path, "controller", TwoStep, limit=90.0)


@pytest.mark.slow
def test_a_controller_in_one_file_drives_the_robot_with_an_estimator_trained_for_it(
    program: Program, tmp_path: Path, made_up: str
):
    simulation = [a for a in OWN if a.startswith(("method", "estimator", "target", "sim", "task.dataset"))]
    paper = ("objective=paper", "objective.at_rest=true")
    quick = ("estimator.windows=20", "estimator.rounds=1", "task.loads=[a1]", "task.per_load=1")
    out = "hydra.run.dir=out"
    answer = program("task=control", *simulation, *paper, *quick, "controller=made_up", made_up, out)
    assert answer.status == 0, answer.error
    result = json.loads((tmp_path / "out" / "result.json").read_text())["result"]
    assert (result["controller"], result["estimator"]) == ("made_up", "momentum_observer")
    (trial,) = result["trials"]
    assert trial["estimate"] == pytest.approx(-0.03, abs=0.02)
    assert trial["notes"][0].startswith("it balances at")
    assert RAILS == [2.25]


@pytest.mark.slow
def test_a_controller_in_one_file_has_margins_and_a_region_of_recovery(program: Program, tmp_path: Path, made_up: str):
    others = (f"~task.controllers.{name}" for name in SHIPPED)
    answer = program(*OWN, *others, "+controller@task.controllers.made_up=made_up", made_up)
    assert answer.status == 0, answer.error
    result = json.loads((tmp_path / "out" / "result.json").read_text())["result"]
    assert result["margins"]["made_up"]["inner"]
    assert result["region"]["controllers"]["made_up"]["recovered"] == [[True]]
