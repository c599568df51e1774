"""Units, and the way from a log's columns to those of contract section 1."""

import numpy as np
import pytest

from wipx.core.errors import InputError
from wipx.core.plant import plant_of
from wipx.recordings.signals import Signal, plain_signal, recorded_columns, required_columns, signal_from_mapping
from wipx.recordings.units import COMMAND_UNITS, UNITS, factor_to_si

WIP = plant_of("wip")


@pytest.mark.parametrize(
    ("unit", "factor"), [("ms", 1e-3), ("mm", 1e-3), ("deg", np.pi / 180), ("rpm", np.pi / 30), ("mN m", 1e-3)]
)
def test_factors_are_those_of_the_tables(unit: str, factor: float):
    assert factor_to_si(unit) == pytest.approx(factor, rel=1e-15)


def test_every_unit_belongs_to_a_column_of_some_plant():
    plants = [plant_of(kind) for kind in ("wip", "cartpole", "pendulum", "linear_axis", "double_pendulum")]
    si = {plant.unit_of(column) for plant in plants for column in recorded_columns(plant)} | set(COMMAND_UNITS)
    assert {unit.si for unit in UNITS.values()} == si


def test_value_is_scale_times_factor_times_columns_plus_offset():
    signal = Signal(column="duty", unit="V", scale=-0.5, offset=0.25, times="supply")
    logged = {"duty": np.array([1.0, -2.0]), "supply": np.array([12.0, 10.0])}
    np.testing.assert_array_equal(signal.values(logged, 2), [-5.75, 10.25])


def test_negative_scale_turns_the_direction_round():
    signal = signal_from_mapping("theta", {"column": "p", "unit": "deg", "scale": -1}, WIP, "robot.yaml")
    assert signal.values({"p": np.array([180.0])}, 1) == pytest.approx(-np.pi)


def test_constant_needs_no_column():
    signal = signal_from_mapping("u", {"constant": 0}, WIP, "robot.yaml")
    assert signal.needs == ()
    np.testing.assert_array_equal(signal.values({}, 3), np.zeros(3))


@pytest.mark.parametrize("unit", ["rad", "deg", "turn"])
def test_wrapped_angle_comes_back_continuous(unit: str):
    angle = np.linspace(0.0, 20.0, 400)
    wrapped = (np.mod(angle + np.pi, 2 * np.pi) - np.pi) / factor_to_si(unit)
    signal = Signal(column="a", unit=unit, scale=0.96, offset=0.1, unwrap=True)  # a scale must not hide the jumps
    np.testing.assert_allclose(signal.values({"a": wrapped}, 400), 0.96 * angle + 0.1, atol=1e-12)


def test_setting_left_out_means_the_same_name_in_si():
    assert signal_from_mapping("x_dot", {}, WIP, "robot.yaml") == plain_signal("x_dot", WIP)


def test_columns_follow_the_plant():
    double = plant_of("double_pendulum")
    assert required_columns(double) == ("t", "theta1", "theta2", "u1", "u2")
    assert set(recorded_columns(double)) - set(required_columns(double)) == {
        *("theta1_dot", "theta2_dot", "u1_measured", "u2_measured")
    }
    assert "x_dot_ref" in recorded_columns(WIP)
    assert "x" not in recorded_columns(plant_of("pendulum"))


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("theta", {"unit": "grad"}, "unknown unit 'grad'"),
        ("x", {"unit": "deg"}, "unit deg is not one of m; give one of: m, cm, mm"),
        ("theta", {"unit": "V"}, "unit V is not one of rad"),
        ("u_measured", {"unit": "V"}, "unit V is not one of N"),
        ("u", {"unit": "N m"}, "unit N m is not one of N"),
        ("phi", {}, "unknown column of plant wip 'phi'"),
        ("x", {"colum": "a"}, "unknown setting 'colum'; did you mean column?"),
        ("x", {"scale": "2"}, "scale is '2', expected a finite number"),
        ("x", {"scale": 0}, "scale is 0"),
        ("x", {"column": 3}, "column is 3"),
        ("x", {"unwrap": True}, "unwrap is for angles"),
        ("theta", {"unwrap": "yes"}, "unwrap is 'yes'"),
        ("u", {"constant": 0, "unit": "V"}, "constant replaces all other keys; drop unit"),
        ("x", "cart", "x is 'cart', expected settings"),
    ],
)
def test_signal_at_fault_is_named_in_one_line(name: str, data: object, said: str):
    with pytest.raises(InputError) as error:
        signal_from_mapping(name, data, WIP, "robot.yaml: signals")
    assert str(error.value).startswith("robot.yaml: signals")
    assert said in str(error.value)
    assert "\n" not in str(error.value)
