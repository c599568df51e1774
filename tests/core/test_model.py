"""Models, batches of models, and the numbers that a plant asks of its owner."""

import pickle
from types import MappingProxyType

import numpy as np
import pytest
from sim.robots import PARAMETERS, robot

from wipx.core.errors import InputError, unknown_name
from wipx.core.model import Model, ModelBatch
from wipx.core.nominal import NominalPlant
from wipx.core.parameters import UNITS, Scales
from wipx.core.plant import PLANTS, plant_of
from wipx.core.recording import Recording, RecordingSplit

EFFECTS = {"translation/coulomb": {"F_c": 2.0}, "actuator/delay": {"tau": 0.005}}


def test_values_are_named_by_parameter_or_by_effect_and_symbol():
    model = robot("wip", EFFECTS)
    assert model.value("body_mass") == 2.6
    assert model.value("translation/coulomb.F_c") == 2.0


def test_with_values_replaces_in_a_copy():
    model = robot("wip", EFFECTS)
    changed = model.with_values({"body_mass": 3.0, "actuator/delay.tau": 0.01})
    assert (changed.value("body_mass"), changed.value("actuator/delay.tau")) == (3.0, 0.01)
    assert (model.value("body_mass"), model.value("actuator/delay.tau")) == (2.6, 0.005)
    assert changed.with_values({"body_mass": 2.6, "actuator/delay.tau": 0.005}) == model


def test_with_values_refuses_an_effect_that_the_model_lacks():
    with pytest.raises(KeyError):
        robot("wip").with_values({"pitch/viscous.sigma": 1.0})


def test_with_effects_adds_and_replaces():
    model = robot("wip", EFFECTS).with_effects({"pitch/viscous": {"sigma": 0.1}, "actuator/delay": {"tau": 0.0}})
    assert set(model.effects) == {"translation/coulomb", "actuator/delay", "pitch/viscous"}
    assert model.value("actuator/delay.tau") == 0.0


def test_a_model_cannot_be_written_into():
    model = robot("wip", EFFECTS)
    assert isinstance(model.parameters, MappingProxyType)
    assert isinstance(model.effects["actuator/delay"], MappingProxyType)
    source = {"body_mass": 1.0}
    copied = Model(plant_of("pendulum"), source, {})
    source["body_mass"] = 2.0
    assert copied.value("body_mass") == 1.0


@pytest.mark.parametrize("kind", PARAMETERS)
def test_a_model_survives_pickling(kind: str):
    model = robot(kind, {"actuator/gain": {"k": 1.2}})
    assert pickle.loads(pickle.dumps(model)) == model


def test_a_batch_varies_the_numbers_it_names_and_shares_the_others():
    model = robot("wip", EFFECTS)
    batch = ModelBatch(model, ("actuator/delay.tau",), np.array([[0.0], [0.01], [0.02]]))
    assert batch.size == 3
    np.testing.assert_array_equal(batch.column("actuator/delay.tau"), [0.0, 0.01, 0.02])
    np.testing.assert_array_equal(batch.column("body_mass"), [2.6, 2.6, 2.6])
    assert ModelBatch(model).size == 1


@pytest.mark.parametrize("kind", PLANTS)
def test_every_plant_names_its_columns_rates_and_units(kind: str):
    plant = PLANTS[kind]
    assert len(plant.coordinates) == len(plant.rates) == len(plant.joints)
    assert len(plant.commands) == len(plant.actuated)
    assert set(plant.actuated) <= set(plant.joints)
    for column in (*plant.coordinates, *plant.rates, *plant.commands, "t"):
        assert plant.unit_of(column)


@pytest.mark.parametrize(
    ("kind", "command_unit"),
    [("wip", "N"), ("cartpole", "N"), ("linear_axis", "N"), ("pendulum", "N m"), ("double_pendulum", "N m")],
)
def test_commands_are_forces_where_the_joint_slides_and_torques_where_it_turns(kind: str, command_unit: str):
    plant = PLANTS[kind]
    assert plant.unit_of(plant.commands[0]) == command_unit


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"com_height": 0.3}, "lacks body_mass"),
        ({"body_mass": -1.0}, "positive"),
        ({"body_mass": "heavy"}, "expected a number"),
        ({"body_mass": True}, "expected a number"),
        ({"body_mass": float("nan")}, "positive"),
        ({"bodymass": 1.0}, "did you mean body_mass"),
    ],
)
def test_wrong_parameters_are_refused_in_one_line_that_names_them(values: dict, message: str):
    with pytest.raises(InputError, match=message) as caught:
        plant_of("pendulum").complete(values, "robot.yaml")
    assert str(caught.value).startswith("robot.yaml: ")
    assert "\n" not in str(caught.value)


def test_optional_parameters_are_filled_in():
    values = plant_of("cartpole").complete(PARAMETERS["cartpole"], "robot.yaml")
    assert (values["gravity"], values["input_gain"], values["wheel_inertia"]) == (9.81, 1.0, 0.0)


def test_an_unknown_plant_lists_the_valid_ones():
    with pytest.raises(InputError, match="cartpole, double_pendulum, linear_axis, pendulum, wip"):
        plant_of("segway")


def test_an_unknown_name_comes_with_the_nearest_and_all_valid_ones():
    message = str(unknown_name("effect", "colomb", ["viscous", "coulomb"], "robot.yaml"))
    assert message == "robot.yaml: unknown effect 'colomb'; did you mean coulomb? valid: coulomb, viscous"


def test_a_nominal_plant_replaces_single_parameters_or_the_whole_body():
    described = robot("wip", EFFECTS)
    heavier = NominalPlant(parameters={"body_mass": 4.0}).nominal(described)
    assert (heavier.value("body_mass"), heavier.value("wheel_mass")) == (4.0, 1.2)
    cart = NominalPlant("cartpole", PARAMETERS["cartpole"]).nominal(described)
    assert cart.plant.kind == "cartpole"
    assert cart.effects == described.effects
    with pytest.raises(InputError, match="has columns theta"):
        NominalPlant("pendulum", PARAMETERS["pendulum"]).nominal(described)


def test_every_dimension_has_a_scale():
    scales = Scales(force=2.0, velocity=4.0, coordinate=0.5)
    assert all(scales.of(dimension) > 0.0 for dimension in UNITS)
    assert scales.of("damping") == 0.5
    assert scales.of("stiffness") == 4.0


def test_a_recording_is_immutable_and_cut_by_rows_and_times():
    t = np.arange(5) * 0.1
    recording = Recording("r", {"t": t, "u": t})
    t[0] = -1.0
    assert recording.t[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        recording["u"][0] = 1.0
    assert len(recording.rows(1, 3)) == 2
    np.testing.assert_allclose(recording.between(0.1, 0.3).t, [0.1, 0.2])
    assert recording.rate == pytest.approx(10.0)
    assert recording.duration == pytest.approx(0.4)
    assert len(pickle.loads(pickle.dumps(recording))) == 5


def test_a_split_keeps_something_to_fit():
    with pytest.raises(InputError, match="none left to fit"):
        RecordingSplit((), (), "all held out")
