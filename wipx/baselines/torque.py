"""The torque residual of a model: what the recorded motion needs beyond what the model gives.

    M(q) q'' + c(q, q') + g(q) - forces,    zero for a perfect model and noiseless recordings

The laws are those of contract section 3, as functions of smoothed signals: a joint is sliding or at rest by its
smoothed rate. Backlash, elasticity and everything beyond the contract are not among them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numba
import numpy as np
from scipy.signal import lfilter

from wipx.baselines.rigid_body import RigidBody
from wipx.core.model import Model
from wipx.identify.motion import Motion

Values = Mapping[str, float]


@dataclass(frozen=True)
class TorqueData:
    """Smoothed recordings.

    Attributes:
        motions: One for each recording.
    """

    motions: tuple[Motion, ...]

    @property
    def shortest_delay(self) -> float:
        """Delays and lags up to half a row get no name [s]: a log that is interpolated knows time no better."""
        return 0.5 * self.motions[0].step

    def residual(self, model: Model) -> np.ndarray:
        """What the torque residual means as acceleration, at the kept rows, shape (rows, joints) [m/s^2, rad/s^2].

        Noise sits in the recorded accelerations. In forces a model could shrink it by less inertia, less gain and
        larger sensor scales at once.
        """
        scales = [model.effects.get(f"sensor_{c}/scale", {"e": 0.0})["e"] for c in model.plant.coordinates]
        body = RigidBody(model)
        parts = []
        for motion in self.motions:
            kept = motion.kept
            forces = residual(body, motion)[kept]
            mass = body.mass_matrix(motion.t[kept], motion.coordinates[kept])
            parts.append(np.linalg.solve(mass, forces[..., None])[..., 0])
        return np.concatenate(parts) * (1.0 + np.array(scales))


def residual(body: RigidBody, motion: Motion) -> np.ndarray:
    """Forces of one recording that the body's model does not explain, shape (N, joints) [N or N m]."""
    model = body.model
    seen = _true_motion(model, motion)
    forces = joint_forces(model, seen.t, seen.coordinates, seen.rates, motion.rest_speeds)
    for site, values in _of_kind(model, "presliding").items():
        j = model.plant.joints.index(site)
        v = seen.rates[:, j]
        bent = dahl(v, seen.step, values["F_c"] / values["stiffness"])
        forces[:, j] -= values["F_c"] * bent + values["damping"] * (v - np.abs(v) * bent)
    forces += _driven(model, seen)
    return body.forces(seen.t, seen.coordinates, seen.rates, seen.accelerations) - motion.filtered(forces)


def joint_forces(model: Model, t: np.ndarray, q: np.ndarray, rates: np.ndarray, rest_speeds: np.ndarray) -> np.ndarray:
    """Forces of the environment and of joints without memory, shape (N, joints) [N or N m].

    Dry friction builds up over `rest_speeds`, shape (joints,) [m/s or rad/s].
    """
    forces = np.zeros_like(q)
    for j, site in enumerate(model.plant.joints):
        v = rates[:, j]
        slides = np.clip(v / rest_speeds[j], -1.0, 1.0)
        for kind, law in _JOINT_LAWS.items():
            values = model.effects.get(f"{site}/{kind}")
            if values is not None:
                forces[:, j] -= law(v, slides, values)
        spot = model.effects.get(f"{site}/sticky_spot")
        if spot is not None:
            forces[:, j] -= spot["F_c"] * slides * ((q[:, j] >= spot["lo"]) & (q[:, j] <= spot["hi"]))
    spring = model.effects.get("environment/spring")
    if spring is not None:
        forces[:, 0] -= spring["k"] * (q[:, 0] - spring["x0"])
    return forces


def _stribeck(v: np.ndarray, slides: np.ndarray, p: Values) -> np.ndarray:
    return slides * (p["F_c"] + max(p["F_s"] - p["F_c"], 0.0) * np.exp(-((v / p["v_s"]) ** 2)))


_JOINT_LAWS: dict[str, Callable[[np.ndarray, np.ndarray, Values], np.ndarray]] = {
    "viscous": lambda v, slides, p: p["sigma"] * v,
    "coulomb": lambda v, slides, p: p["F_c"] * slides,
    "stribeck": _stribeck,
    "quadratic_drag": lambda v, slides, p: p["c"] * v * np.abs(v),
}


def _driven(model: Model, motion: Motion) -> np.ndarray:
    """Forces of the actuators, in the order of contract section 3, shape (N, joints) [N or N m]."""
    delay = model.effects.get("actuator/delay", {"tau": 0.0})["tau"]
    commanded = motion.commands(delay) * model.parameters["input_gain"]
    forces = np.zeros_like(motion.coordinates)
    for i, site in enumerate(model.plant.actuated):
        j = model.plant.joints.index(site)
        force = actuated(model, commanded[:, i], motion.rates[:, j])
        lag = model.effects.get("actuator/lag")
        if lag is not None and lag["tau"] > 0.0:
            kept = np.exp(-motion.step / lag["tau"])
            force = lfilter([1.0 - kept], [1.0, -kept], force, zi=[kept * force[0]])[0]
        forces[:, j] = force + _ripple(model, motion.coordinates[:, j])
    return forces


def actuated(model: Model, force: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """A commanded force after dead zone, gain, saturation and speed limit, shape (N,) [N or N m]."""
    effects = model.effects
    if "actuator/dead_zone" in effects:
        band = effects["actuator/dead_zone"]["band"]
        force = force - np.clip(force, -band, band)
    if "actuator/gain" in effects:
        force = effects["actuator/gain"]["k"] * force
    if "actuator/saturation" in effects:
        highest = effects["actuator/saturation"]["F_max"]
        force = np.clip(force, -highest, highest)
    if "actuator/speed_limit" in effects:
        limit = effects["actuator/speed_limit"]
        driving = limit["F_stall"] * np.maximum(1.0 - np.abs(rate) / limit["v_free"], 0.0)
        high = np.where(rate > 0.0, driving, limit["F_stall"])
        low = np.where(rate > 0.0, limit["F_stall"], driving)
        force = np.clip(force, -low, high)
    return force


def _ripple(model: Model, q: np.ndarray) -> np.ndarray:
    values = model.effects.get("actuator/ripple")
    if values is None:
        return np.zeros_like(q)
    radius = model.parameters.get("wheel_radius", 1.0)
    return values["A"] * np.cos(values["n"] * q / radius + values["phase"])


@numba.njit
def dahl(rate: np.ndarray, step: float, reach: float) -> np.ndarray:
    """Force of a Dahl bristle as a share of its level, shape (N,): y' = (v - |v| y) / reach.

    Args:
        rate: Of the joint, shape (N,) [m/s or rad/s].
        step: Between rows [s].
        reach: Way on which the bristle bends, F_c / stiffness [m or rad].
    """
    share = np.empty(len(rate))
    bent = 0.0
    for i in range(len(rate)):
        kept = np.exp(-abs(rate[i]) * step / reach)
        bent = bent * kept + np.sign(rate[i]) * (1.0 - kept)
        share[i] = bent
    return share


def _true_motion(model: Model, motion: Motion) -> Motion:
    """What was behind the sensors: bias, scale and delay undone."""
    signals = [motion.coordinates, motion.rates, motion.accelerations]
    for j, column in enumerate(model.plant.coordinates):
        site = f"sensor_{column}"
        if not any(name.startswith(f"{site}/") for name in model.effects):
            continue
        tau = model.effects.get(f"{site}/delay", {"tau": 0.0})["tau"]
        e = model.effects.get(f"{site}/scale", {"e": 0.0})["e"]
        b = model.effects.get(f"{site}/bias", {"b": 0.0})["b"]
        for order, signal in enumerate(signals):
            shown = np.interp(motion.t + tau, motion.t, signal[:, j]) - (b if order == 0 else 0.0)
            signals[order] = np.column_stack([*signal.T[:j], shown / (1.0 + e), *signal.T[j + 1 :]])
    coordinates, rates, accelerations = signals
    return replace(motion, coordinates=coordinates, rates=rates, accelerations=accelerations)


def _of_kind(model: Model, kind: str) -> dict[str, Values]:
    """Effects of one kind at joints, by site; absent where they have no size."""
    found = {site: model.effects.get(f"{site}/{kind}") for site in model.plant.joints}
    return {site: values for site, values in found.items() if values is not None and values["F_c"] > 0.0}
