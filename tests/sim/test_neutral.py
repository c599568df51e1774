"""An effect at its neutral values is an absent effect."""

import numpy as np
import pytest
from sim.robots import LIVELY, move, robot, sines

from wipx.core.plant import PLANTS
from wipx.effects.catalogue import vocabulary


@pytest.mark.parametrize("kind", PLANTS)
@pytest.mark.parametrize("at_rest", [False, True], ids=["moving", "at rest"])
def test_neutral_values_leave_the_plant_bare(kind: str, at_rest: bool):
    plant = PLANTS[kind]
    t = np.linspace(0.0, 0.5, 101)
    initial = np.zeros(len(LIVELY[kind])) if at_rest else LIVELY[kind]
    commands = sines(t, 0.8, len(plant.commands))
    bare = move(robot(kind), initial, t, commands)
    for name, effect in vocabulary(plant).items():
        neutral = move(robot(kind, {name: effect.neutral}), initial, t, commands)
        # Round-off of a neutral delay or gap; absent parts are exact.
        np.testing.assert_allclose(neutral.q, bare.q, rtol=0.0, atol=1e-9, err_msg=name)
        np.testing.assert_allclose(neutral.v, bare.v, rtol=0.0, atol=1e-9, err_msg=name)
