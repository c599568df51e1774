"""Rows of the simulator: counted by the program, and filled as the effects say."""

import numpy as np
import pytest
from sim.robots import robot

from wipx.core.effect import Effect
from wipx.core.model import ModelBatch
from wipx.core.plant import PLANTS
from wipx.effects.catalogue import kinds, vocabulary
from wipx.effects.remainder import KNOTS
from wipx.sim import body as B
from wipx.sim import rows as R
from wipx.sim.coefficients import coefficients, joints_of, row_at


def neutral_rows(effect: Effect) -> dict[str, float]:
    values = {symbol: np.array([value]) for symbol, value in effect.neutral.items()}
    found = {row: values[c] if isinstance(c, str) else c(values, {}) for row, c in effect.rows.items()}
    return {row: float(np.ravel(value)[0]) for row, value in found.items()}


def test_the_lists_follow_each_other():
    assert R.SWING == R.REMAINDER + KNOTS
    assert R.ROTOR == R.STATES
    assert min(R.LAWS) >= R.FLAGS


@pytest.mark.parametrize("plant", PLANTS.values(), ids=list(PLANTS))
def test_effects_name_rows_of_the_simulator(plant):
    for name, effect in vocabulary(plant).items():
        site = name.partition("/")[0]
        model = robot(plant.kind, {name: effect.neutral})
        found = coefficients(ModelBatch(model))
        for row in effect.rows:
            assert all(0 <= row_at(row, site) < (B.ROWS if j < 0 else R.BLOCK) for j in joints_of(row, site, plant))
        for part in effect.parts if isinstance(effect.parts, tuple) else ():
            flag = row_at(f"ON_{part}", site)
            assert all((found.on if j < 0 else found.has[j])[flag] for j in joints_of(f"ON_{part}", site, plant))


def test_effects_that_fill_one_row_agree_on_its_neutral_value():
    values: dict[str, set[float]] = {}
    for effect in kinds().values():
        for row, value in neutral_rows(effect).items():
            values.setdefault(row, set()).add(value)
    assert {row for row, found in values.items() if len(found) > 1} == set()


def test_effects_that_fill_one_row_add_up():
    alone = robot("wip", {"pitch/viscous": {"sigma": 0.2}})
    assert coefficients(ModelBatch(alone)).joints[:, R.VISCOUS, 0].tolist() == [0.0, 0.2]
    both = robot("wip", {"pitch/coulomb": {"F_c": 0.2}, "pitch/asymmetric_coulomb": {"F_plus": 0.3, "F_minus": 0.4}})
    joints = coefficients(ModelBatch(both)).joints[:, :, 0]
    assert joints[0, R.LEVEL_PLUS] == 0.0
    assert joints[1, [R.LEVEL_PLUS, R.LEVEL_MINUS]].tolist() == [0.5, pytest.approx(0.6)]


def test_a_delay_fills_the_row_of_its_site():
    taus = {"actuator": 0.01, "sensor_x": 0.02, "sensor_theta": 0.03}
    found = coefficients(ModelBatch(robot("wip", {f"{site}/delay": {"tau": tau} for site, tau in taus.items()})))
    assert found.joints[:, R.DELAY, 0].tolist() == [0.01, 0.0]
    assert found.joints[:, R.SENSOR_DELAY, 0].tolist() == [0.02, 0.03]
    assert found.on[R.ON_DELAY]
    assert found.has[:, R.ON_SENSOR_DELAY].all()


def test_an_actuator_is_that_of_every_driven_joint():
    found = coefficients(ModelBatch(robot("double_pendulum", {"actuator/gain": {"k": 1.1}})))
    assert found.joints[:, R.GAIN, 0].tolist() == [1.1, 1.1]
