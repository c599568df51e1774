"""First guesses for a robot of many joints: laws of each joint and drive, by least squares on its force.

The equation of motion of one joint holds its own friction and drive beside the recorded motion of all: what other
joints lack does not enter. So all joints are looked at side by side, as in the identification of industrial robots
(Swevers, Verdonck, De Schutter 2007, IEEE CSM 27(5)). What is proposed here is judged elsewhere.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import lsq_linear

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.effects.catalogue import vocabulary
from wipx.identify.inverse_dynamics import Signals, missing, regressor, signals_of, weight_of
from wipx.identify.motion import independent_rows, motions
from wipx.identify.noise import sensor_noise

SYMBOLS = {"coulomb": "F_c", "viscous": "sigma", "rotor_inertia": "J", "offset": "F_0"}


def expected_effects(model: Model, recordings: Sequence[Recording]) -> dict[str, float]:
    """Numbers, by "site/kind.symbol" [SI], of effects of joints and drives that recorded forces ask for.

    Args:
        model: A robot from a model file, as its owner believes it to be.
        recordings: Of it.
    """
    tree = model.plant.tree
    assert tree is not None
    smoothed = motions(tuple(recordings), model.plant, sensor_noise(tuple(recordings), model.plant))
    signals = signals_of(model, smoothed)
    lacking = missing(model, signals, regressor(tree, signals, weight_of(model)))
    known = vocabulary(model.plant).keys() - model.effects.keys()
    found: dict[str, float] = {}
    for j, site in enumerate(model.plant.joints):
        columns = {name: column for name, column in _columns(signals, j, site).items() if name in known}
        found |= _selected(lacking[:, j], columns)
    return {f"{name}.{SYMBOLS[name.partition('/')[2]]}": size for name, size in found.items()}


def _columns(signals: Signals, j: int, site: str) -> dict[str, np.ndarray]:
    """Force that each law of joint j takes from it per unit, shape (rows,) each.

    A wrong gain is not among them: least squares takes dry friction, most of the force of a slow joint, for one.
    """
    return {
        f"{site}/coulomb": signals.slides[:, j],
        f"{site}/viscous": signals.rates[:, j],
        f"{site}/rotor_inertia": signals.accelerations[:, j],
        f"actuator_{site}/offset": -np.ones(len(signals.rates)),
    }


def _selected(lacking: np.ndarray, columns: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Sizes of the effects that least squares chooses one by one, as long as the criterion of Schwarz (1978) falls.

    Args:
        lacking: Force that the joint needs and is not given, shape (rows,).
        columns: Force that each effect takes per unit.
    """
    chosen: list[str] = []
    left, sizes = lacking, np.zeros(0)
    while len(chosen) < len(columns):
        trials = {name: _fitted(lacking, columns, [*chosen, name]) for name in columns if name not in chosen}
        best = min(trials, key=lambda name: float(np.sum(trials[name][1] ** 2)))
        rows = independent_rows(left[:, None])
        ratio = float(np.sum(left**2) / max(np.sum(trials[best][1] ** 2), 1e-300))
        if rows * np.log(ratio) <= np.log(max(rows, 2.0)):
            break
        chosen.append(best)
        sizes, left = trials[best]
    return dict(zip(chosen, sizes.tolist(), strict=True))


def _fitted(lacking: np.ndarray, columns: Mapping[str, np.ndarray], names: list[str]) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of some effects, all but offsets above zero, and the force that they leave, shape (rows,)."""
    own = np.stack([columns[name] for name in names], axis=1)
    low = [-np.inf if name.endswith("/offset") else 0.0 for name in names]
    sizes = lsq_linear(own, -lacking, (low, np.inf)).x
    return sizes, lacking + own @ sizes
