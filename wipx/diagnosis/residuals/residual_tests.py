"""What a fit leaves over: forces of any shape, tested on its innovations.

Score tests of forces over position, speed, angle, command and time, of dry friction that changes over position,
command or time, of a command whose gain drifts and of resonances, on each joint (after Kristensen, Madsen, Jorgensen
2004, and the model-error models of Ljung 1999, System Identification, sec. 16.6). They say whether something is left,
where, and what it looks like.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from wipx.core.plant import Plant
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.force_response import direction, motion_of, response
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.likelihood.sandwich import stretches, sums_over
from wipx.effects.remainder import KNOTS
from wipx.sim.cache import cached

ENDS = (0.005, 0.995)  # quantiles of a signal between which its knots lie
FREQUENCIES = np.geomspace(0.5, 16.0, 12)  # [Hz] of resonances that are looked for
DAMPING = 0.05  # ratio, of the same
REGULARISATION = 1e-9


@dataclass(frozen=True)
class Shape:
    """A family of forces on one joint.

    Attributes:
        joint: Its index.
        kind: "force" over a signal, "friction" (its level), "gain" (share of the command) or "resonance".
        signal: Column, rate or command; "t" for time, a frequency for a resonance [Hz].
        knots: Where the forces are given, shape (KNOTS,); empty for a resonance.
        columns: Forces of unit size at every row, shape (C, K + 1, R).
    """

    joint: int
    kind: str
    signal: str
    knots: np.ndarray
    columns: np.ndarray


@dataclass(frozen=True)
class Residual:
    """A family of forces that a fit leaves over.

    Attributes:
        shape: The family.
        gain: Log-likelihood that it would add, in nats.
        p_value: Of that gain if nothing were left over, not yet corrected for the number of families.
        slopes: Of the white innovations by the forces, freed of the fit's own, shape (R m (K + 1), C).
    """

    shape: Shape
    gain: float
    p_value: float
    slopes: np.ndarray


def shapes_of(fitter: InnovationFitter, fit: Fit) -> list[Shape]:
    """All families of forces that are looked at, over the motion as a fit sees it."""
    data = fitter.data
    signals = motion_of(fitter, fit)
    found = []
    for joint, site in enumerate(data.plant.joints):
        for name, values in signals.items():
            knots, hats = _hats(values, data.rows)
            if knots is not None:
                found.append(Shape(joint, "force", name, knots, hats))
                if name in _wearing(data.plant, joint):
                    towards = direction(signals[data.plant.rates[joint]], data.rows)
                    found.append(Shape(joint, "friction", name, knots, -hats * towards))
        if site in data.plant.actuated:
            command = signals[data.plant.commands[data.plant.actuated.index(site)]]
            knots, hats = _hats(signals["t"], data.rows)
            if knots is not None:
                found.append(Shape(joint, "gain", "t", knots, hats * command))
        forces, rates = _swings(data, joint, signals)
        found += [
            Shape(joint, "resonance", f"{frequency:.2g}", np.zeros(0), np.stack([forces[i], rates[i]]))
            for i, frequency in enumerate(FREQUENCIES)
        ]
    return found


def residual_tests(fitter: InnovationFitter, fit: Fit, shapes: list[Shape]) -> list[Residual]:
    """What each family of forces would add to a fit, the most significant first.

    The simulator's steps err by about what halving them changes: errors along that direction are expected, as far as
    it goes.
    """
    white = fit.white.ravel()
    own = fit.jacobian[: white.size]
    basis = np.linalg.qr(own / np.maximum(np.linalg.norm(own, axis=0), 1e-300))[0] if own.size else own
    basis = np.column_stack([basis, _expected(fitter.error_of_steps(fit), basis)])
    left = white - basis @ (basis.T @ white)
    labels = np.repeat(stretches(fitter.data)[:, None], fit.white.shape[1], axis=1).ravel()
    found = [_tested(fitter, fit, shape, basis, left, labels) for shape in shapes]
    return sorted(found, key=lambda residual: residual.p_value)


def _expected(change: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """A direction that makes unit noise white again which has, beside, a multiple of a change: 1, give or take 1.

    Args:
        change: Shape (N,).
        basis: Orthonormal directions that are taken out already, shape (N, D).

    Returns:
        Shape (N,); the more of it is taken out, the more the change stands out of the noise.
    """
    change = change - basis @ (basis.T @ change)
    squared = float(change @ change)
    return change * np.sqrt((1.0 - 1.0 / np.sqrt(1.0 + squared)) / max(squared, 1e-300))


def _tested(
    fitter: InnovationFitter, fit: Fit, shape: Shape, basis: np.ndarray, left: np.ndarray, labels: np.ndarray
) -> Residual:
    slopes = response(fitter, fit, shape.joint, shape.columns)
    slopes = slopes - basis @ (basis.T @ slopes)
    size = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    scaled = slopes / size
    normal = scaled.T @ scaled + REGULARISATION * np.eye(len(size))
    score = scaled.T @ left
    force = np.linalg.solve(normal, score)
    gain = 0.5 * float(score @ force)
    # By how much scores vary more from stretch to stretch than white innovations would have it, the force allowed for.
    parts = sums_over(labels, scaled * (left - scaled @ force)[:, None])
    inflation = max(1.0, float(np.mean(np.sum(parts**2, axis=0))))
    degrees = int(np.linalg.matrix_rank(normal, tol=1e-6))
    p_value = chdtrc(degrees, 2.0 * gain / inflation)
    return Residual(shape, gain, float(p_value), slopes)


def _wearing(plant: Plant, joint: int) -> tuple[str, ...]:
    """Signals over which the friction of a joint is looked at: its place, its load, time."""
    loads = [c for c, site in zip(plant.commands, plant.actuated, strict=True) if site == plant.joints[joint]]
    return (plant.coordinates[joint], *loads, "t")


def _hats(values: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray | None, np.ndarray]:
    """Knots over a signal and the piecewise linear basis on them, shape (KNOTS, K + 1, R)."""
    low, high = np.quantile(values[rows], ENDS)
    if not high - low > 1e-9 * max(abs(high), abs(low), 1e-9):
        return None, np.zeros(0)
    knots = np.linspace(low, high, KNOTS)
    place = np.clip((values - low) / (high - low), 0.0, 1.0) * (KNOTS - 1)
    hats = np.maximum(1.0 - np.abs(place - np.arange(KNOTS)[:, None, None]), 0.0)
    return knots, hats * rows


def _swings(data: RecordingBatch, joint: int, signals: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Force of a unit mass that swings along with a joint, and its rate, shape (len(FREQUENCIES), K + 1, R) each."""
    q, rate = signals[data.plant.coordinates[joint]], signals[data.plant.rates[joint]]
    pulsation = 2.0 * np.pi * FREQUENCIES
    return _swung(q, rate, data.intervals, pulsation, DAMPING)


@cached
def _swung(q, rate, intervals, pulsation, damping):
    rows, recordings = q.shape
    forces = np.zeros((len(pulsation), rows, recordings))
    rates = np.zeros((len(pulsation), rows, recordings))
    for i in range(len(pulsation)):
        stiffness, loss = pulsation[i] ** 2, 2.0 * damping * pulsation[i]
        for r in range(recordings):
            place, speed = q[0, r], rate[0, r]
            for k in range(rows):
                forces[i, k, r] = stiffness * (place - q[k, r]) + loss * (speed - rate[k, r])
                rates[i, k, r] = speed - rate[k, r]
                if k == rows - 1:
                    break
                steps = max(1, int(np.ceil(intervals[k, r] * pulsation[i] * 10.0)))
                h = intervals[k, r] / steps
                for s in range(steps):
                    share = (s + 0.5) / steps
                    base = q[k, r] + share * (q[k + 1, r] - q[k, r])
                    moving = rate[k, r] + share * (rate[k + 1, r] - rate[k, r])
                    speed -= h * (stiffness * (place - base) + loss * (speed - moving))
                    place += h * speed
    return forces, rates
