"""What every machine has a little of: laws whose numbers are known to be small, not to be zero.

No encoder is quite centred, and no drive gives the same force hot and cold (`wipx.core.effect.Effect.tolerance`). In
the range of some recordings that looks like a bias, a payload or a speed limit. An effect must hold beside it.
"""

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.hypothesis import Setting
from wipx.diagnosis.likelihood.predictions import Predictions
from wipx.effects.catalogue import kind_of, vocabulary
from wipx.identify.parameter_space import effect_parameters

ECCENTRICITY = "eccentricity"
EVERYWHERE = 1e-6  # periods per turn of an error that is the same at all angles
SHIFT = 3.0  # times the sensor noise, by which such an error shows what it does to predictions
TRIED = 16  # numbers of periods between fewest and most
FEWEST = 4.0  # periods per turn of a hinge; fewer look like the bias and the scale error of the vocabulary
PULLEY = 0.05  # [m] radius of the largest pulley of a rail whose wheel is not known
RANGE = 10.0  # most periods over fewest


def tolerances(setting: Setting, fitter: Fitter, predictions: Predictions, fit: Fit) -> dict[str, dict[str, float]]:
    """Laws that every machine follows a little, by "site/kind", with the numbers that no prior holds.

    Args:
        setting: The robot.
        fitter: Of predictions.
        predictions: That it fits.
        fit: Of some effects; encoders have the number of periods that explains most of what it leaves.
    """
    model = fit.hypothesis.model
    found: dict[str, dict[str, float]] = {}
    for name, law in vocabulary(model.plant).items():
        if law.tolerance and setting.looks_at(name):
            numbers = model.effects.get(name) or _usual(name, setting)
            found[name] = {symbol: value for symbol, value in numbers.items() if symbol not in law.tolerance}
    new = tuple(name for name in found if name.endswith(f"/{ECCENTRICITY}") and name not in model.effects)
    return {**found, **_periods(new, fitter, predictions, fit)}


def _usual(name: str, setting: Setting) -> dict[str, float]:
    """Numbers of a law where a search for it begins."""
    numbers = effect_parameters(name, setting.nominal.plant, setting.scales)
    return {number.name.rpartition(".")[2]: number.start for number in numbers}


def _periods(names: tuple[str, ...], fitter: Fitter, predictions: Predictions, fit: Fit) -> dict[str, dict[str, float]]:
    """Number of periods of each eccentric encoder, likeliest by itself."""
    if not names:
        return {}
    model, plant = fit.hypothesis.model, fit.hypothesis.model.plant
    joints = [plant.coordinates.index(name.partition("/")[0].removeprefix("sensor_")) for name in names]
    shifts = [SHIFT * float(predictions.noise[j]) for j in joints]
    errors = [_errors(fitter, fit, model)]
    errors += [_errors(fitter, fit, _shifted(model, name, shift)) for name, shift in zip(names, shifts, strict=True)]
    found: dict[str, dict[str, float]] = {}
    for i, (name, j) in enumerate(zip(names, joints, strict=True)):
        tried = _tried(model, plant.joints[j])
        slopes = _slopes(predictions, j, (errors[i + 1] - errors[0]) / shifts[i], tried)
        tolerance = kind_of(name).tolerance["s"]
        white = fitter.whitened(errors[0] + np.concatenate([np.zeros_like(slopes[:1]), tolerance * slopes]), fit.noise)
        white = white.reshape(len(white), -1)
        changes = (white[1:] - white[0]).reshape(len(tried), 2, -1)
        found[name] = {"n": float(tried[int(np.argmax([_gain(change, white[0]) for change in changes]))])}
    return found


def _errors(fitter: Fitter, fit: Fit, model: Model) -> np.ndarray:
    """Errors of a model in units of the sensor noise, shape (N, E)."""
    return fitter.errors_of(ModelBatch(model, (), np.zeros((1, 0))), fit.levels, model)[0]


def _shifted(model: Model, encoder: str, shift: float) -> Model:
    """A model whose encoder is off by the same amount at all angles [m or rad]."""
    return model.with_effects({encoder: {"s": 0.0, "c": shift * EVERYWHERE, "n": EVERYWHERE}})


def _tried(model: Model, joint: str) -> np.ndarray:
    """Numbers of periods per turn of a hinge, or per 2 pi m of a rail."""
    radius = model.parameters.get("wheel_radius", PULLEY)
    fewest = FEWEST if model.plant.is_angular(joint) else 1.0 / radius
    return np.geomspace(fewest, RANGE * fewest, TRIED)


def _slopes(predictions: Predictions, j: int, response: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Errors by sine and cosine of an eccentric encoder of joint j, shape (2 numbers, N, E).

    An error at the start of a prediction moves it as one of all angles does, but for what the sensor itself shows.

    Args:
        predictions: N of them.
        j: The joint.
        response: Errors by an error of all angles, shape (N, E).
        numbers: As `_tried` has them.
    """
    place = predictions.recorded[..., j]  # (N, 1 + H)
    own = np.zeros((place.shape[1] - 1, len(predictions.noise)))
    own[:, j] = 1.0 / predictions.noise[j]
    found, ahead = [], own.size  # ways by recorded rates do not count
    moved = response - np.pad(own.ravel(), (0, predictions.size - ahead))
    for number in numbers:
        for wave in (np.sin(number * place) / number, np.cos(number * place) / number):
            shown = (wave[:, 1:, None] * own).reshape(len(place), -1)
            found.append(np.pad(shown, ((0, 0), (0, predictions.size - ahead))) + wave[:, :1] * moved)
    return np.array(found)


def _gain(changes: np.ndarray, white: np.ndarray) -> float:
    """Log-likelihood gained by two numbers of prior deviation one, with changes (2, N) of white errors (N,) [nats]."""
    slope = changes @ white
    return 0.5 * float(slope @ np.linalg.solve(changes @ changes.T + np.eye(2), slope))
