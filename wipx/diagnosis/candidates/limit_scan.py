"""How much a drive gives at most: first guesses for saturation and for a torque-speed limit.

What a limit takes away is no more proportional to it than where it sets in. The linear response to the force that is
missing under each of many limits is enough to compare them all; the screening then simulates the best ones. Beside dry
friction the linear response is only roughly right, and its whole size may cost more than it explains. So the limits
whose response goes best with what is left, whatever its size, are simulated too.

A limit that acts in many rows colours the errors of its joint. Where they are white, only those that act in few rows
are compared.
"""

import numpy as np

from wipx.diagnosis.candidates.left_over import LeftOverByRow
from wipx.diagnosis.candidates.peaks import peaks
from wipx.diagnosis.likelihood.force_response import FAST, drive_force

GUESSES = 6
BY_COURSE = 3  # more, by the course of the response
TOGETHER = 24  # limits whose responses are kept at once; bounds the memory
SHARES = np.concatenate([np.geomspace(1e-3, 0.1, 12), np.linspace(0.14, 0.98, 22)])  # of the rows, in which one acts
SPEEDS = np.array([0.7, 0.85, 1.05, 1.35, 1.8, 2.6, 4.5])  # without load, of the largest speed
RARE = 0.01  # share of the rows, up to which a limit may act and leave errors white; judgement
SAME_LIMIT = 1.3  # ratio up to which two limits count as one, where their speeds are alike too


def saturations(left_over: LeftOverByRow, effect: str, *, rare: bool = False) -> np.ndarray:
    """Likely largest forces [N or N m], best first, shape (up to GUESSES + BY_COURSE, 1).

    Args:
        left_over: By a fit.
        effect: Its name "site/saturation".
        rare: Whether to look only at those that act in few rows.
    """
    return _likely(left_over, effect, np.array([np.inf]), rare)[:, :1]


def speed_limits(left_over: LeftOverByRow, effect: str, *, rare: bool = False) -> np.ndarray:
    """Likely stall forces [N or N m] and speeds without load, best first, shape (up to GUESSES + BY_COURSE, 2).

    Args:
        left_over: By a fit.
        effect: Its name "site/speed_limit".
        rare: Whether to look only at those that act in few rows.
    """
    return _likely(left_over, effect, SPEEDS, rare)


def _likely(left_over: LeftOverByRow, effect: str, speeds: np.ndarray, rare: bool) -> np.ndarray:
    data, motion, model = left_over.fitter.data, left_over.motion, left_over.fit.hypothesis.model
    plant = data.plant
    driven = plant.joints_at(effect.partition("/")[0])
    joints = [plant.joints.index(joint) for joint in driven]
    forces = [np.where(data.rows, drive_force(model, motion, joint), 0.0) for joint in driven]
    rates = [motion[plant.rates[joint]] for joint in joints]
    fastest = max(1e-9, *(float(np.quantile(np.abs(rate[data.counted]), FAST)) for rate in rates))
    shares = SHARES[SHARES <= RARE] if rare else SHARES
    pairs = []
    for free in speeds * fastest:
        most = np.max([asked(force, rate, free) for force, rate in zip(forces, rates, strict=True)], axis=0)
        stalls = np.unique(np.quantile(most[data.rows], 1.0 - shares, method="lower"))
        pairs += [(stall, free) for stall in stalls if 0.0 < stall < np.inf]
    pairs = np.array(pairs).reshape(-1, 2)
    slopes, sizes = np.zeros(len(pairs)), np.zeros(len(pairs))
    for begin in range(0, len(pairs), TOGETHER):
        part = pairs[begin : begin + TOGETHER, :, None, None].swapaxes(0, 1)
        change = np.sum(
            [
                left_over.answer(joint, limited(force, rate, *part) - force)
                for joint, force, rate in zip(joints, forces, rates, strict=True)
            ],
            axis=0,
        )
        slopes[begin : begin + TOGETHER] = change @ left_over.errors
        sizes[begin : begin + TOGETHER] = np.sum(change**2, axis=1)
    whole = -slopes - 0.5 * sizes
    course = (
        0.5 * np.minimum(slopes, 0.0) ** 2 / np.maximum(sizes, 1e-300) - left_over.fitter.rules.selection.least_gain
    )
    stall, free = pairs.T

    def same(i: int) -> np.ndarray:
        ratio = np.maximum(stall, stall[i]) / np.minimum(stall, stall[i])
        return (ratio <= SAME_LIMIT) & (free == free[i])

    return pairs[list(dict.fromkeys([*peaks(whole, GUESSES, same), *peaks(course, BY_COURSE, same)]))]


def asked(force: np.ndarray, rate: np.ndarray, free: float) -> np.ndarray:
    """The stall force below which a limit takes from a force; infinite where a drive is too fast to give any."""
    driving = force * rate > 0.0
    share = np.where(driving, np.maximum(1.0 - np.abs(rate) / free, 0.0), 1.0)
    return np.divide(np.abs(force), share, out=np.full_like(force, np.inf), where=share > 0.0)


def limited(force: np.ndarray, rate: np.ndarray, stall: np.ndarray, free: np.ndarray) -> np.ndarray:
    """What is left of a force: driving, up to a line from `stall` to none at `free`; braking, up to `stall`."""
    driving = force * rate > 0.0
    size = stall * np.where(driving, np.maximum(1.0 - np.abs(rate) / free, 0.0), 1.0)
    return np.clip(force, -size, size)
