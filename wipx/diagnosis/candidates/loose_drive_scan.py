"""Drives that move on their own: first guesses for backlash and for elasticity.

How long a drive takes to cross its gap depends on the gap times its inertia, and the likelihood has a narrow ridge
along that product. How well a drive on a spring fits depends above all on the frequency at which it swings. So gaps
and frequencies are compared on a fine scale, for light and heavy drives.
"""

from itertools import product

import numpy as np

from wipx.core.model import ModelBatch
from wipx.diagnosis.candidates.left_over import LeftOverByRow
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.effects.catalogue import kind_of

GUESSES = 8
GAPS = np.geomspace(5e-4, 0.1, 13)  # of the way that the joint moves
DRIVES = ((0.03, 0.0), (0.12, 0.0), (0.01, 200.0))  # inertia over that of the joint, and how fast grease slows it [1/s]
RETURNED = (0.0, 1.0)  # of the momentum
CONTACT_TIME = 5e-4  # [s]
FREQUENCIES = np.geomspace(
    2.0, 60.0, 14
)  # of drive and link against each other [Hz]; faster than a motion, slower than a log
ON_SPRINGS = (0.1, 0.3, 1.0)  # inertia of a drive on a spring over that of the joint
DAMPING_RATIO = 0.05
TOGETHER = 26  # models simulated at once; bounds the memory


def plays(left_over: LeftOverByRow, effect: str) -> np.ndarray:
    """Likely gaps [m or rad], numbers of the free drive, and times of contact, best first.

    Args:
        left_over: By a fit.
        effect: Its name "site/backlash".

    Returns:
        Shape (GUESSES, 5), in the order of the effect's numbers.
    """
    fitter = left_over.fitter
    joint = _joint(fitter, effect)
    way = float(np.ptp(fitter.data.measured[:, joint][fitter.data.rows]))
    inertia = _inertia(fitter, joint)
    guesses = [
        (gap * way, share * inertia, share * inertia * slowing, returned, CONTACT_TIME)
        for (share, slowing), returned, gap in product(DRIVES, RETURNED, GAPS)
    ]
    return _best(left_over, effect, np.array(guesses))


def springs(left_over: LeftOverByRow, effect: str) -> np.ndarray:
    """Likely inertias of a drive on a spring, stiffnesses and dampings of the spring, best first.

    Args:
        left_over: By a fit.
        effect: Its name "site/elasticity".

    Returns:
        Shape (GUESSES, 3), in the order of the effect's numbers.
    """
    inertia = _inertia(left_over.fitter, _joint(left_over.fitter, effect))
    guesses = []
    for share, frequency in product(ON_SPRINGS, FREQUENCIES):
        reduced, pulsation = inertia * share / (1.0 + share), 2.0 * np.pi * frequency
        guesses.append((share * inertia, reduced * pulsation**2, 2.0 * DAMPING_RATIO * reduced * pulsation))
    return _best(left_over, effect, np.array(guesses))


def _joint(fitter: InnovationFitter, effect: str) -> int:
    plant = fitter.data.plant
    return plant.joints.index(plant.joints_at(effect.partition("/")[0])[0])


def _inertia(fitter: InnovationFitter, joint: int) -> float:
    """What a force on a joint moves, in the middle of the recordings [kg or kg m^2]."""
    return 1.0 / float(np.median(fitter.innovations_model.linear.b[:, joint, joint]))


def _best(left_over: LeftOverByRow, effect: str, guesses: np.ndarray) -> np.ndarray:
    """The guesses that make the white innovations smaller by most, best first."""
    parts = (guesses[i : i + TOGETHER] for i in range(0, len(guesses), TOGETHER))
    gains = np.concatenate([_gains(left_over, effect, part) for part in parts])
    return guesses[np.argsort(-gains)[:GUESSES]]


def _gains(left_over: LeftOverByRow, effect: str, guesses: np.ndarray) -> np.ndarray:
    """By how much each guess makes the white innovations smaller [nats]."""
    symbols = list(kind_of(effect).neutral)
    names = tuple(f"{effect}.{symbol}" for symbol in symbols)
    model = left_over.fit.hypothesis.model.with_effects({effect: dict(zip(symbols, guesses[0].tolist(), strict=True))})
    change = left_over.freed(left_over.changes(ModelBatch(model, names, guesses)))
    return -(change @ left_over.errors) - 0.5 * np.sum(change**2, axis=1)
