"""The box of free parameters and the unit cube."""

from collections.abc import Mapping

import numpy as np
import pytest
from emulated_robot import nominal_model
from hypothesis import given
from hypothesis import strategies as st

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.parameters import FreeParameter, Scales
from wipx.effects.catalogue import effect_of
from wipx.identify.parameter_space import ParameterSpace, parameter_space

PENDULUM = nominal_model("pendulum")
SCALES = {site: Scales(force=2.0, velocity=4.0) for site in PENDULUM.plant.sites}


def space_of(
    *switched_on: str,
    uncertainty: Mapping[str, float] | None = None,
    free: Mapping[str, float | None] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    model: Model = PENDULUM,
) -> ParameterSpace:
    prepared = model.with_effects({name: effect_of(name, model.plant).neutral for name in switched_on})
    return parameter_space(prepared, switched_on, uncertainty or {}, free or {}, bounds or {}, SCALES)


LINEAR_AND_LOGARITHMIC = ParameterSpace(
    PENDULUM,
    (FreeParameter("body_mass", "kg", -1.0, 3.0, 1.0, 0.8), FreeParameter("com_height", "m", 1e-3, 10.0, 0.1, 0.45)),
)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_the_cube_maps_to_values_and_back(first: float, second: float):
    cube = np.array([first, second])
    np.testing.assert_allclose(LINEAR_AND_LOGARITHMIC.to_cube(LINEAR_AND_LOGARITHMIC.to_values(cube)), cube, atol=1e-12)


def test_corners_of_the_cube_are_the_bounds():
    np.testing.assert_allclose(LINEAR_AND_LOGARITHMIC.to_values(np.zeros(2)), [-1.0, 1e-3])
    np.testing.assert_allclose(LINEAR_AND_LOGARITHMIC.to_values(np.ones(2)), [3.0, 10.0])


def test_the_middle_of_a_wide_interval_is_its_geometric_mean():
    np.testing.assert_allclose(LINEAR_AND_LOGARITHMIC.to_values(np.full(2, 0.5)), [1.0, 0.1])


def test_values_beyond_the_bounds_go_to_the_nearest_face():
    np.testing.assert_array_equal(LINEAR_AND_LOGARITHMIC.to_cube(np.array([-5.0, 50.0])), [0.0, 1.0])


def test_a_batch_holds_the_values_of_its_positions():
    cube = np.random.default_rng(1).random((5, 2))
    batch = LINEAR_AND_LOGARITHMIC.batch(cube)
    assert batch.size == 5
    np.testing.assert_array_equal(batch.column("body_mass"), LINEAR_AND_LOGARITHMIC.to_values(cube)[:, 0])
    np.testing.assert_array_equal(batch.column("gravity"), np.full(5, 9.81))


def test_search_intervals_are_multiples_of_what_the_joint_does():
    (level,) = space_of("pitch/coulomb").free
    assert (level.name, level.unit, level.low, level.high, level.neutral) == ("pitch/coulomb.F_c", "N m", 0.0, 2.0, 0.0)
    (damping,) = space_of("pitch/viscous").free
    assert damping.unit == "N m s/rad"
    assert damping.high == effect_of("pitch/viscous", PENDULUM.plant).parameters[0].high * 2.0 / 4.0


@pytest.mark.parametrize("count", [1, 32, 33])
def test_random_starts_lie_in_the_cube_and_crowd_around_the_neutral_value(count: int):
    space = space_of("pitch/coulomb", "pitch/viscous")
    starts = space.sample(count, np.random.default_rng(2))
    assert starts.shape == (count, 2)
    assert np.all((starts >= 0.0) & (starts <= 1.0))
    np.testing.assert_array_equal(starts, space.sample(count, np.random.default_rng(2)))
    if count > 1:
        assert np.median(np.abs(starts - space.neutral)) < 0.1


def test_the_prior_of_a_mass_that_is_not_exact_is_one_of_the_factor_by_which_it_is_wrong():
    space = space_of(uncertainty={"body_inertia": 0.1})
    value = PENDULUM.parameters["body_inertia"]
    at = space.to_cube(value * np.exp([[0.0], [0.1], [-0.2]]))
    np.testing.assert_allclose(space.prior_residuals(at), [[0.0], [1.0], [-2.0]], atol=1e-9)
    assert space.free[0].low < 0.7 * value < 1.3 * value < space.free[0].high


def test_however_uncertain_a_mass_is_it_does_not_vanish():
    space = space_of(uncertainty={"body_mass": 0.5})
    nearly_nothing = space.prior_residuals(np.zeros((1, 1)))
    assert space.free[0].low > 0.0
    np.testing.assert_allclose(nearly_nothing, -4.0)


def test_a_freed_number_without_deviation_has_no_prior():
    space = space_of("pitch/coulomb", free={"body_mass": None})
    assert space.names == ("pitch/coulomb.F_c", "body_mass")
    assert space.prior_residuals(space.start).shape == (1, 0)


def test_a_known_effect_may_be_uncertain_too():
    known = PENDULUM.with_effects({"pitch/viscous": {"sigma": 0.02}})
    (damping,) = space_of(uncertainty={"pitch/viscous.sigma": 0.5}, model=known).free
    assert (damping.unit, damping.low, damping.start, damping.prior_std) == ("N m s/rad", 0.0, 0.02, 0.01)


def test_bounds_replace_the_usual_interval_and_move_the_start_into_it():
    (level,) = space_of("pitch/coulomb", bounds={"pitch/coulomb.F_c": (0.5, 0.7)}).free
    assert (level.low, level.high, level.start) == (0.5, 0.7, 0.5)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"free": {"body_mas": None}}, "unknown parameter 'body_mas'; did you mean body_mass? valid: body_inertia"),
        ({"uncertainty": {"pitch/viscous.sigma": 0.5}}, "unknown parameter 'pitch/viscous.sigma'"),
        ({"bounds": {"pitch/coulomb.F_s": (0.0, 1.0)}}, "bounds: unknown free parameter 'pitch/coulomb.F_s'"),
        ({"bounds": {"body_mass": (0.0, 1.0)}}, "valid: pitch/coulomb.F_c"),
        ({"bounds": {"pitch/coulomb.F_c": (1.0, 1.0)}}, "bounds.pitch/coulomb.F_c: [1, 1], expected low < high"),
    ],
)
def test_a_name_or_an_interval_at_fault_is_refused_in_one_line(arguments: dict, said: str):
    with pytest.raises(InputError) as error:
        space_of("pitch/coulomb", **arguments)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_an_effect_that_the_plant_lacks_is_refused_with_those_that_it_has():
    with pytest.raises(
        InputError, match=r"unknown effect of plant pendulum 'translation/coulomb'.*valid: .*pitch/coulomb"
    ):
        space_of("translation/coulomb")


def test_nothing_to_identify_is_refused():
    with pytest.raises(InputError, match="nothing to identify: switch on effects"):
        space_of()
