"""The law of an effect as a curve over one signal, and the force that the recordings themselves ask for."""

import numpy as np

from wipx.core.curve import Curve
from wipx.core.effect import Steady
from wipx.core.model import Model
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.force_response import response
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.residuals.residual_tests import Shape
from wipx.effects.catalogue import effect_of, kind_of

POINTS = 201


def law_curve(fitter: InnovationFitter, completed: Fit, effect: str, shapes: list[Shape]) -> Curve | None:
    """The law of an effect beside the force that the recordings need in its place; None where no curve shows it.

    That force is the law and what the completed model leaves over of the same signal (partial residuals: Larsen,
    McCleary 1972, Technometrics 14(3)).
    """
    plant = fitter.data.plant
    steady = effect_of(effect, plant).steady
    site = effect.partition("/")[0]
    drive = plant.drives.get(plant.joint_at(site))
    if steady is None or (steady.over == "command" and drive is not None and drive.kind != "torque"):
        return None
    joint = plant.joints.index(plant.joint_at(site))
    signal = _signal(steady, joint, fitter)
    shape = next((s for s in shapes if s.kind == "force" and (s.joint, s.signal) == (joint, signal)), None)
    if shape is None:
        return None
    at = _abscissa(shape.knots[0], shape.knots[-1])
    law = added_force(completed.hypothesis.model, effect, at)
    slopes = response(fitter, completed, joint, shape.columns)
    left, spread = _left_over(slopes, completed.white.ravel(), float(np.abs(law).max()))
    quantity, unit = ("torque", "N m") if plant.is_angular(plant.joints[joint]) else ("force", "N")
    return Curve(
        quantity,
        shape.signal,
        plant.unit_of(shape.signal),
        unit,
        at,
        law,
        shape.knots,
        added_force(completed.hypothesis.model, effect, shape.knots) + left,
        spread,
    )


def _left_over(slopes: np.ndarray, white: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Force that a fit leaves over at the knots and its standard deviation, shape (KNOTS,) each.

    Args:
        slopes: Of the white innovations by the force at each knot, shape (N, KNOTS).
        white: White innovations, shape (N,).
        size: Of the force, where the innovations do not tell; its standard deviation beforehand.
    """
    scaled = slopes * max(size, 1e-300)
    covariance = np.linalg.inv(scaled.T @ scaled + np.eye(slopes.shape[1]))
    return -size * covariance @ (scaled.T @ white), size * np.sqrt(np.diag(covariance))


def _signal(steady: Steady, joint: int, fitter: InnovationFitter) -> str:
    plant = fitter.data.plant
    if steady.over == "rate":
        return plant.rates[joint]
    if steady.over == "coordinate":
        return plant.coordinates[joint]
    return plant.commands[plant.actuated.index(plant.joints[joint])]


def _abscissa(low: float, high: float) -> np.ndarray:
    """Points between two ends, with those just beside zero, where dry friction jumps."""
    at = np.linspace(low, high, POINTS)
    return np.unique(np.concatenate([at, [-1e-9, 1e-9]])) if low < 0.0 < high else at


def added_force(model: Model, effect: str, at: np.ndarray) -> np.ndarray:
    """Force that an effect of a model adds in steady motion [N or N m].

    Args:
        model: With the effect.
        effect: One that has a curve.
        at: Rates, coordinates or commands, shape (N,), in the units of the recordings.
    """
    steady = effect_of(effect, model.plant).steady
    assert steady is not None
    if steady.over != "command":
        return steady.force(at, model.effects[effect], model.parameters)
    without = {name: values for name, values in model.effects.items() if name != effect}
    site = effect.partition("/")[0]
    return _driven(model, site, at) - _driven(Model(model.plant, model.parameters, without), site, at)


def _driven(model: Model, site: str, command: np.ndarray) -> np.ndarray:
    """Force of the drive at a site, at constant commands, shape (N,) [N or N m]."""
    joint = model.plant.joint_at(site)
    force = command * model.parameters["input_gain" if model.plant.tree is None else f"{joint}.gain"]
    own = {name: values for name, values in model.effects.items() if name.partition("/")[0] == site}
    laws = [(steady, values) for name, values in own.items() if (steady := kind_of(name).steady) is not None]
    for steady, values in sorted(laws, key=lambda law: law[0].stage):
        if steady.over == "command":
            force = force + steady.force(force, values, model.parameters)
    return force
