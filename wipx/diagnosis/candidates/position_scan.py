"""Where on its way a joint meets a force: first guesses for torque ripple and for a sticky spot.

Both laws fit somewhat at many places, so their likelihood has many peaks. The linear response to the force at each
place is enough to compare them all; the screening then simulates the best ones.
"""

import numpy as np

from wipx.diagnosis.candidates.left_over import LeftOverByRow
from wipx.diagnosis.candidates.peaks import peaks
from wipx.diagnosis.likelihood.force_response import direction

PEAKS = 6  # guesses
TOGETHER = 12  # frequencies whose responses are kept at once; bounds the memory
FREQUENCIES = 60  # that are looked at
TURNED = 1.5  # [rad] of phase over the whole way, by which neighbouring frequencies differ
APART = 2  # frequencies nearer to a peak belong to it
BINS = 40  # pieces of the way
SAME_SPOT = 0.7  # share that two spots have in common, from which they count as one
REGULARISATION = 1e-9


def ripples(left_over: LeftOverByRow, effect: str) -> np.ndarray:
    """Amplitude [N or N m], periods per turn and phase of likely torque ripple, best first, shape (PEAKS, 3).

    Args:
        left_over: By a fit.
        effect: Its name "site/ripple".
    """
    data, motion = left_over.fitter.data, left_over.motion
    plant = data.plant
    radius = left_over.fit.hypothesis.model.parameters["wheel_radius"] if "wheel_radius" in plant.parameters else 1.0
    joints = [plant.joints.index(site) for site in plant.joints_at(effect.partition("/")[0])]
    angles = [motion[plant.coordinates[joint]] / radius for joint in joints]
    way = max(float(np.ptp(angle[data.rows])) for angle in angles)
    step = max(1.0, TURNED / max(way, 1e-9))
    fewest = np.ceil(2.0 * np.pi / max(way * step, 1e-9))  # one period over the whole way
    numbers = step * (fewest + np.arange(FREQUENCIES))
    found = []
    for begin in range(0, FREQUENCIES, TOGETHER):
        part = numbers[begin : begin + TOGETHER, None, None]
        waves = [np.concatenate([np.cos(part * angle), np.sin(part * angle)]) for angle in angles]
        slopes = np.sum([left_over.answer(j, wave) for j, wave in zip(joints, waves, strict=True)], axis=0)
        normal, score = slopes @ slopes.T, slopes @ left_over.errors
        for i in range(part.size):
            pair = [i, i + part.size]
            own = normal[np.ix_(pair, pair)]  # alike where the joint hardly moves
            force = -np.linalg.solve(own + REGULARISATION * (1.0 + np.trace(own)) * np.eye(2), score[pair])
            found.append((-0.5 * float(score[pair] @ force), np.hypot(*force), np.arctan2(-force[1], force[0])))
    gains, amplitudes, phases = np.array(found).T
    chosen = peaks(gains, PEAKS, lambda i: np.abs(np.arange(len(gains)) - i) < APART)
    return np.column_stack([amplitudes[chosen], numbers[chosen], phases[chosen]])


def sticky_spots(left_over: LeftOverByRow, effect: str) -> np.ndarray:
    """Level [N or N m], begin and end [m or rad] of likely sticky spots, best first, shape (up to PEAKS, 3).

    Args:
        left_over: By a fit.
        effect: Its name "site/sticky_spot".
    """
    data, motion = left_over.fitter.data, left_over.motion
    joint = data.plant.joints.index(effect.partition("/")[0])
    x, rate = motion[data.plant.coordinates[joint]], motion[data.plant.rates[joint]]
    edges = np.linspace(x[data.rows].min(), x[data.rows].max(), BINS + 1)
    inside = (x >= edges[:-1, None, None]) & (x < edges[1:, None, None]) & data.rows
    slopes = left_over.answer(joint, np.where(inside, -direction(rate, data.rows), 0.0))
    # A spot is some bins in a row: sums over it are differences of sums from the beginning.
    score = np.concatenate([[0.0], np.cumsum(slopes @ left_over.errors)])
    normal = np.zeros((BINS + 1, BINS + 1))
    normal[1:, 1:] = np.cumsum(np.cumsum(slopes @ slopes.T, axis=0), axis=1)
    low, high = np.triu_indices(BINS + 1, 1)
    total = normal[high, high] - normal[low, high] - normal[high, low] + normal[low, low]
    level = -(score[high] - score[low]) / np.maximum(total, REGULARISATION)
    gains = np.where(level > 0.0, 0.5 * level**2 * total, 0.0)

    def same(i: int) -> np.ndarray:
        common = np.minimum(high, high[i]) - np.maximum(low, low[i])
        return common >= SAME_SPOT * (np.maximum(high, high[i]) - np.minimum(low, low[i]))

    chosen = peaks(gains, PEAKS, same)
    return np.column_stack([level[chosen], edges[low[chosen]], edges[high[chosen]]])
