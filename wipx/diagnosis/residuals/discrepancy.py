"""What stands in for physics that has no name: a law beyond the vocabulary, or a force that is only a curve.

The curve is the mean of a Gaussian process over one signal (Rasmussen, Williams 2006, ch. 2), given the
white innovations linearised in the force; size and smoothness maximise the marginal likelihood.
"""

import numpy as np
from scipy.optimize import minimize

from wipx.core.curve import Curve
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.residuals.residual_tests import Residual, Shape, residual_tests
from wipx.effects.remainder import KNOTS
from wipx.sim.coefficients import joint_count, joint_index

ROUNDS = 3  # of linearising anew
IMITATED = 0.02  # of the largest response: what is left of one that numbers imitate; 0.005 on EMPS, the next one 0.18
NUGGET = 1e-8
FACTORS = {"force": 0.0, "gain": 1.0, "friction": -1.0}  # of the effect `remainder`, by kind of shape


def process_mean(slopes: np.ndarray, white: np.ndarray, knots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of the force at the knots, shape (KNOTS,) each.

    Args:
        slopes: Of the white innovations by the force at each knot, shape (N, KNOTS).
        white: White innovations, shape (N,).
        knots: Shape (KNOTS,).
    """
    normal, score = slopes.T @ slopes, slopes.T @ white
    plain = np.linalg.pinv(normal, rcond=1e-10, hermitian=True)
    size = float(np.sqrt(np.mean((plain @ score) ** 2))) + 1e-12
    triangle = _triangle(slopes)  # products of large slopes would round what the prior adds away
    distance = (knots[:, None] - knots[None, :]) / (knots[-1] - knots[0])

    def posterior_root(logarithms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Root of the prior's covariance, and that of what the white innovations add to its inverse (both lower)."""
        deviation, reach = np.exp(logarithms)
        prior = np.exp(-0.5 * (distance / reach) ** 2) + NUGGET * np.eye(len(knots))
        root = deviation * np.linalg.cholesky(prior)
        return root, _triangle(np.concatenate([np.eye(len(knots)), triangle @ root])).T

    def negative_evidence(logarithms: np.ndarray) -> float:
        root, inner = posterior_root(logarithms)
        gain = 0.5 * float(np.sum(np.linalg.solve(inner, root.T @ score) ** 2))
        return float(np.log(np.abs(np.diag(inner))).sum() - gain)

    start = np.log([size, 0.3])
    bounds = [(start[0] - 4.0, start[0] + 4.0), (np.log(0.08), np.log(3.0))]
    best = minimize(negative_evidence, start, method="Nelder-Mead", bounds=bounds, options={"maxiter": 120}).x
    root, inner = posterior_root(best)
    half = np.linalg.solve(inner, root.T)
    return -half.T @ (half @ score), np.sqrt(np.sum(half**2, axis=0))


def _triangle(matrix: np.ndarray) -> np.ndarray:
    """The triangular factor R of a matrix Q R."""
    return np.asarray(np.linalg.qr(matrix, mode="r"))


def with_curve(fitter: InnovationFitter, setting: Setting, fit: Fit, residual: Residual) -> tuple[Fit, np.ndarray]:
    """A fit with a force over one signal added, refined, and the force's standard deviation at the knots.

    What the numbers of the fit can do as well is left to them.
    """
    shape = residual.shape
    name = f"{fitter.data.plant.joints[shape.joint]}/remainder"
    force = np.zeros(KNOTS)
    data = fitter.data
    current = fitter.fit(with_force(setting, fit, name, shape, force, data), fit.levels, steps=0)
    spread = np.zeros(KNOTS)
    for _ in range(ROUNDS):
        again = residual_tests(fitter, current, [shape])[0]
        change, spread = process_mean(again.slopes, current.white.ravel(), shape.knots)
        force = _beyond(again.slopes, force + change)
        found = fitter.fit(with_force(setting, fit, name, shape, force, data), current.levels, steps=3)
        if found.log_likelihood < current.log_likelihood + 0.5:
            break
        current = found
    return fitter.converged(current, rounds=2), spread


def _beyond(slopes: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The part of a force at the knots, (KNOTS,), to which `slopes`, freed of the fit's numbers, answer."""
    _, sizes, directions = np.linalg.svd(slopes, full_matrices=False)
    own = directions[sizes > IMITATED * sizes[0]]
    return own.T @ (own @ force)


def with_force(
    setting: Setting, fit: Fit, name: str, shape: Shape, force: np.ndarray, data: RecordingBatch
) -> Hypothesis:
    """The hypothesis of a fit, on a nominal model that has the force."""
    values = {
        "signal": float(_code(shape, data)),
        "factor": FACTORS[shape.kind],
        "low": float(shape.knots[0]),
        "high": float(shape.knots[-1]),
        **{f"f{i}": float(f) for i, f in enumerate(force)},
    }
    extended_effects = Setting(setting.nominal.with_effects({name: values}), setting.uncertainty, setting.scales)
    return Hypothesis.of(extended_effects, fit.effects, fit.hypothesis.values)


def curve_of(shape: Shape, fit: Fit, spread: np.ndarray, data: RecordingBatch) -> Curve:
    """The force as a person reads it."""
    plant = data.plant
    site = plant.joints[shape.joint]
    values = fit.hypothesis.model.effects[f"{site}/remainder"]
    force = np.array([values[f"f{i}"] for i in range(KNOTS)])
    unit = "share of u" if shape.kind == "gain" else "N m" if plant.is_angular(site) else "N"
    quantity = {"gain": "change of gain", "friction": "change of friction", "force": "unknown force"}[shape.kind]
    return Curve(
        quantity,
        shape.signal,
        "s" if shape.signal == "t" else plant.unit_of(shape.signal),
        unit,
        shape.knots,
        force,
        shape.knots,
        force,
        spread,
    )


def _code(shape: Shape, data: RecordingBatch) -> int:
    """Number of a signal in the law of the effect `remainder`."""
    plant = data.plant
    joints = joint_count(plant)
    if shape.signal in plant.coordinates:
        return joint_index(plant, plant.joints[plant.coordinates.index(shape.signal)])
    if shape.signal in plant.rates:
        return joints + joint_index(plant, plant.joints[plant.rates.index(shape.signal)])
    if shape.signal in plant.commands:
        return 2 * joints + joint_index(plant, plant.actuated[plant.commands.index(shape.signal)])
    return 3 * joints
