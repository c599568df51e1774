"""First guesses of a payload on a link: how heavy it is, and where.

A point mass m at r changes a link's mass by m, its first moment by m r and its second moments by m r r', and the motion
in proportion to these (Atkeson, An, Hollerbach 1986, IJRR 5(3)). A regression on what innovations leave over finds the
first moment, beside any change of mass and of second moments; several masses with that moment are then tried.
"""

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.diagnosis.candidates.left_over import LeftOver
from wipx.effects.catalogue import effect_of

SMALL = 0.05  # of the link's mass
ARM = 0.1  # [m] of the simulated masses
USUAL = 5.0  # standard deviation of each number, in multiples of those simulated: unseen ones stay zero
DISTANCES = (0.03, 0.06, 0.12, 0.25, 0.5, 1.0)  # [m] of the masses that are tried


def point_masses(left_over: LeftOver, name: str) -> np.ndarray:
    """Mass [kg] and place [m] in the link's frame of likely payloads, shape (A, 4).

    Args:
        left_over: By a fit.
        name: Of the payload, "link_LINK/payload".
    """
    model = left_over.fit.hypothesis.model
    effect = effect_of(name, model.plant)
    tried = probes(model, name)
    small = tried[0, 0]
    names = tuple(f"{name}.{p.name}" for p in effect.parameters)
    change = left_over.changes(ModelBatch(model.with_effects({name: effect.neutral}), names, tried))
    middle, ahead, behind = change[:1], change[1:4], change[4:]
    columns = left_over.freed(np.concatenate([middle, 0.5 * (ahead - behind), 0.5 * (ahead + behind) - middle]))
    amounts = -np.linalg.solve(columns @ columns.T + np.eye(len(columns)) / USUAL**2, columns @ left_over.errors)
    moment = amounts[1:4] * small * ARM
    masses = masses_with(moment, float(amounts[0] * small))
    return np.column_stack([masses, moment / np.maximum(masses[:, None], 1e-300)])


def probes(model: Model, name: str) -> np.ndarray:
    """Small masses [kg] in the origin of a link and ahead of and behind it on each axis [m], shape (7, 4)."""
    small = SMALL * model.parameters[f"{name.partition('/')[0].removeprefix('link_')}.mass"]
    places = ARM * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    return np.column_stack([np.full(len(places), small), places])


def masses_with(moment: np.ndarray, mass: float) -> np.ndarray:
    """Masses [kg] that may have a first moment (3,) [kg m], shape (A,): at several distances, and the likeliest one."""
    tried = np.array([*(np.linalg.norm(moment) / distance for distance in DISTANCES), mass])
    return tried[tried > 0.0]
