"""Baselines name friction, and size it."""

import numpy as np
import pytest
from baselines.driven_pendulum import COULOMB, SIMULATOR, VISCOUS, Effects, case, record

from wipx.baselines.all_at_once import AllAtOnce
from wipx.baselines.case import Baseline
from wipx.baselines.paper import PaperFriction
from wipx.baselines.regression import TorqueRegression
from wipx.baselines.residual_network import ResidualNetwork
from wipx.baselines.sparse_regression import SparseRegression
from wipx.identify.evaluation import Judge

NAMING = {
    "regression": TorqueRegression(seconds=5.0),
    "sparse_regression": SparseRegression(seconds=5.0),
    "all_at_once": AllAtOnce(seconds=8.0),
    "paper": PaperFriction(seconds=4.0),
}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in ("all_at_once", "paper") else []) for n in NAMING]
)
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


def test_every_baseline_keeps_to_the_protocol():
    baselines: list[Baseline] = [*NAMING.values(), ResidualNetwork()]
    assert all(baseline.seconds > 0.0 for baseline in baselines)
