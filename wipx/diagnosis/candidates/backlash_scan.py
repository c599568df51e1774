"""How a drive crosses its gap: first guesses for backlash.

How long a crossing takes depends on the gap times the free drive's inertia, and the likelihood has a narrow ridge
along that product: gaps are compared on a fine scale, for light and heavy drives.
"""

from itertools import product

import numpy as np

from wipx.core.model import ModelBatch
from wipx.diagnosis.candidates.position_scan import left_of
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.innovations import InnovationFitter

SYMBOLS = ("gap", "drive_inertia", "drive_damping", "returned", "contact_time")
GUESSES = 8
GAPS = np.geomspace(5e-4, 0.1, 13)  # of the way that the joint moves
DRIVES = ((0.03, 0.0), (0.12, 0.0), (0.01, 200.0))  # inertia over that of the joint, and how fast grease slows it [1/s]
RETURNED = (0.0, 1.0)  # of the momentum
CONTACT_TIME = 5e-4  # [s]
TOGETHER = 26  # models simulated at once; bounds the memory


def plays(fitter: InnovationFitter, fit: Fit, basis: np.ndarray, effect: str) -> np.ndarray:
    """Likely gaps [m or rad], numbers of the free drive, and times of contact, best first.

    Args:
        fitter: Of the fit.
        fit: What is already explained.
        basis: What its numbers can imitate, orthonormal, shape (N, D).
        effect: Its name "site/backlash".

    Returns:
        Shape (GUESSES, 5).
    """
    data = fitter.data
    joint = data.plant.joints.index(data.plant.joints_at(effect.partition("/")[0])[0])
    way = float(np.ptp(data.measured[:, joint][data.rows]))
    inertia = 1.0 / float(np.median(fitter.innovations_model.linear.b[:, joint, joint]))
    guesses = np.array(
        [
            (gap * way, share * inertia, share * inertia * slowing, returned, CONTACT_TIME)
            for (share, slowing), returned, gap in product(DRIVES, RETURNED, GAPS)
        ]
    )
    left = left_of(fit, basis)
    gains = np.concatenate(
        [_gains(fitter, fit, basis, left, effect, guesses[i : i + TOGETHER]) for i in range(0, len(guesses), TOGETHER)]
    )
    return guesses[np.argsort(-gains)[:GUESSES]]


def _gains(
    fitter: InnovationFitter, fit: Fit, basis: np.ndarray, left: np.ndarray, effect: str, guesses: np.ndarray
) -> np.ndarray:
    """By how much each guess makes the white innovations smaller [nats]."""
    names = tuple(f"{effect}.{symbol}" for symbol in SYMBOLS)
    model = fit.hypothesis.model.with_effects({effect: dict(zip(SYMBOLS, guesses[0].tolist(), strict=True))})
    change = fitter.white_of(fit, ModelBatch(model, names, guesses)) - fit.white.ravel()
    change -= (change @ basis) @ basis.T
    return -(change @ left) - 0.5 * np.sum(change**2, axis=1)
