"""Rows of the simulator: counted by the program, and filled as the effects say."""

import numpy as np
import pytest
from sim.robots import robot

from wipx.core.effect import Effect
from wipx.core.model import ModelBatch
from wipx.core.plant import PLANTS
from wipx.effects.catalogue import kinds, vocabulary
from wipx.effects.remainder import KNOTS
from wipx.sim import rows as R
from wipx.sim.coefficients import coefficients, row_at

NUMBERS = {name: number for name, number in vars(R).items() if name.isupper() and isinstance(number, int)}


def neutral_rows(effect: Effect) -> dict[str, float]:
    values = {symbol: np.array([value]) for symbol, value in effect.neutral.items()}
    found = {row: values[c] if isinstance(c, str) else c(values, {}) for row, c in effect.rows.items()}
    return {row: float(np.ravel(value)[0]) for row, value in found.items()}


def test_pairs_stand_side_by_side():
    pairs = [name for name in NUMBERS if f"{name}1" in NUMBERS and name != "M1"]
    assert len(pairs) > 50
    assert all(NUMBERS[f"{name}1"] == NUMBERS[name] + 1 for name in pairs)


def test_the_lists_follow_each_other():
    assert R.SWING == R.REMAINDER + 2 * KNOTS
    assert R.Q == R.N_COEFFICIENTS
    assert R.STEP == R.N_STATES


@pytest.mark.parametrize("plant", PLANTS.values(), ids=list(PLANTS))
def test_effects_name_rows_of_the_simulator(plant):
    for name, effect in vocabulary(plant).items():
        site = name.partition("/")[0]
        model = robot(plant.kind, {name: effect.neutral})
        present = coefficients(ModelBatch(model)).present
        assert all(0 <= row_at(row, site, plant) < R.N_COEFFICIENTS for row in effect.rows)
        parts = effect.parts if isinstance(effect.parts, tuple) else ()
        assert all(present[row_at(part, site, plant, prefix="ON_")] for part in parts)


def test_effects_that_fill_one_row_agree_on_its_neutral_value():
    values: dict[str, set[float]] = {}
    for effect in kinds().values():
        for row, value in neutral_rows(effect).items():
            values.setdefault(row, set()).add(value)
    assert {row for row, found in values.items() if len(found) > 1} == set()


def test_effects_that_fill_one_row_add_up():
    alone = robot("wip", {"pitch/viscous": {"sigma": 0.2}})
    assert coefficients(ModelBatch(alone)).rows[R.VISCOUS1, 0] == 0.2
    both = robot("wip", {"pitch/coulomb": {"F_c": 0.2}, "pitch/asymmetric_coulomb": {"F_plus": 0.3, "F_minus": 0.4}})
    rows = coefficients(ModelBatch(both)).rows[:, 0]
    assert rows[[R.LEVEL_PLUS, R.LEVEL_PLUS1, R.LEVEL_MINUS1]].tolist() == [0.0, 0.5, pytest.approx(0.6)]


def test_a_delay_fills_the_row_of_its_site():
    taus = {"actuator": 0.01, "sensor_x": 0.02, "sensor_theta": 0.03}
    found = coefficients(ModelBatch(robot("wip", {f"{site}/delay": {"tau": tau} for site, tau in taus.items()})))
    assert found.rows[[R.DELAY, R.SENSOR_DELAY, R.SENSOR_DELAY1], 0].tolist() == list(taus.values())
    assert found.present[[R.ON_DELAY, R.ON_SENSOR_DELAY]].all()
