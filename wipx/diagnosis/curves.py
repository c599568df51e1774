"""The law of an effect as a curve over one signal, and the force that the recordings themselves ask for."""

from collections.abc import Callable, Mapping

import numpy as np

from wipx.core.diagnosis import Curve
from wipx.core.words import effect_in_words
from wipx.diagnosis.fitting import Fit
from wipx.diagnosis.innovations import InnovationFitter
from wipx.diagnosis.leftover import Shape, leftovers
from wipx.diagnosis.stand_in import process_mean

POINTS = 201
OVER_RATE = (
    "viscous",
    "coulomb",
    "stribeck",
    "presliding",
    "quadratic_drag",
    "asymmetric_coulomb",
    "lugre",
    "back_emf",
)
OVER_COMMAND = ("gain", "dead_zone", "saturation", "offset")
OVER_COORDINATE = ("spring", "ripple", "rail_tilt")


def law_curve(fitter: InnovationFitter, reduced: Fit, completed: Fit, effect: str, shapes: list[Shape]) -> Curve | None:
    """The law of an effect beside the force that the model without it lacks; None where no curve shows it."""
    plant = fitter.log.plant
    site, _, kind = effect.partition("/")
    joint = site if site in plant.joints else plant.actuated[0]
    signal = _abscissa(kind, plant.joints.index(joint), fitter)
    shape = next(
        (s for s in shapes if s.kind == "force" and (s.joint, s.signal) == (plant.joints.index(joint), signal)), None
    )
    if shape is None:
        return None
    model = completed.hypothesis.model
    at = np.unique(np.concatenate([np.linspace(shape.knots[0], shape.knots[-1], POINTS), [-1e-9, 1e-9]]))
    law = _force(kind, model.effects[effect], at, _wheel(model.parameters), model.parameters)
    left = leftovers(fitter, reduced, [shape])[0]
    force, spread = process_mean(left.slopes, reduced.white.ravel(), shape.knots)
    return Curve(
        effect_in_words(effect, plant.kind),
        shape.signal,
        plant.unit_of(shape.signal),
        "N m" if plant.is_angular(joint) else "N",
        at,
        law,
        shape.knots,
        force,
        spread,
    )


def _abscissa(kind: str, joint: int, fitter: InnovationFitter) -> str | None:
    plant = fitter.log.plant
    if kind in OVER_RATE:
        return plant.rates[joint]
    if kind in OVER_COORDINATE:
        return plant.coordinates[joint]
    if kind in OVER_COMMAND:
        return plant.commands[0 if len(plant.commands) == 1 else joint]
    return None


def _wheel(parameters: Mapping[str, float]) -> float:
    return parameters.get("wheel_radius", 1.0)


def _force(kind: str, p: Mapping[str, float], at: np.ndarray, radius: float, body: Mapping[str, float]) -> np.ndarray:
    """Force that an effect adds over its signal; the laws of contract section 3 in steady motion."""
    weight = (body.get("body_mass", 0.0) + body.get("wheel_mass", 0.0)) * body["gravity"]
    laws: dict[str, Callable[[], np.ndarray]] = {
        "viscous": lambda: -p["sigma"] * at,
        "back_emf": lambda: -p["k_e"] * at,
        "coulomb": lambda: -p["F_c"] * np.sign(at),
        "presliding": lambda: -p["F_c"] * np.sign(at),
        "stribeck": lambda: -np.sign(at) * (p["F_c"] + (p["F_s"] - p["F_c"]) * np.exp(-((at / p["v_s"]) ** 2))),
        "lugre": lambda: -np.sign(at) * (p["F_c"] + (p["F_s"] - p["F_c"]) * np.exp(-((at / p["v_s"]) ** 2))),
        "quadratic_drag": lambda: -p["c"] * at * np.abs(at),
        "asymmetric_coulomb": lambda: np.where(at > 0.0, -p["F_plus"], np.where(at < 0.0, p["F_minus"], 0.0)),
        "gain": lambda: (p["k"] - 1.0) * at,
        "dead_zone": lambda: -np.clip(at, -p["band"], p["band"]),
        "saturation": lambda: np.clip(at, -p["F_max"], p["F_max"]) - at,
        "offset": lambda: np.full_like(at, p["F_0"]),
        "spring": lambda: -p["k"] * (at - p["x0"]),
        "ripple": lambda: p["A"] * np.cos(p["n"] * at / radius + p["phase"]),
        "rail_tilt": lambda: np.full_like(at, -weight * np.sin(p["angle"])),
    }
    return laws[kind]()
