"""What a hypothesis knows of its numbers beforehand."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.recorded import bench

from wipx.diagnosis.likelihood.hypothesis import ByForces, Setting

VISCOUS = "translation/viscous"


@pytest.fixture
def setting() -> Setting:
    plain = bench("linear_axis", {}, 1).setting
    return replace(plain, by_forces={f"{VISCOUS}.sigma": ByForces(0.02, 0.005, asked=True)})


def test_what_forces_say_of_a_number_is_its_prior_where_forces_count(setting: Setting):
    space = replace(setting, forces_count=True).space((VISCOUS,))
    cube = space.to_cube(np.array([[0.02], [0.03]]))
    assert space.prior_residuals(cube).ravel() == pytest.approx([0.0, 2.0])


def test_where_the_motion_says_enough_forces_only_give_the_start(setting: Setting):
    assert setting.space((VISCOUS,)).prior_residuals(np.array([[0.5]])).size == 0
    assert setting.asked_for == {f"{VISCOUS}.sigma": 0.02}
    assert setting.expects(VISCOUS)


@pytest.mark.parametrize("deviation", [0.0, np.inf])
def test_forces_that_show_nothing_of_a_number_are_no_prior(setting: Setting, deviation: float):
    by_forces = {f"{VISCOUS}.sigma": ByForces(0.02, deviation, asked=False)}
    space = replace(setting, by_forces=by_forces, forces_count=True).space((VISCOUS,))
    assert space.prior_residuals(np.array([[0.5]])).size == 0


def test_the_level_of_dry_friction_is_the_same_number_in_richer_laws(setting: Setting):
    told = replace(setting, by_forces={"translation/coulomb.F_c": ByForces(0.1, 0.02, asked=True)}, forces_count=True)
    space = told.space(("translation/presliding",))
    priors = {p.name: (p.prior_mean, p.prior_std) for p in space.free if p.prior_mean is not None}
    assert priors == {"translation/presliding.F_c": (0.1, 0.02)}
