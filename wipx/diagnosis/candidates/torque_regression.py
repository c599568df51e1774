"""First guesses for a robot of many joints: laws of each joint and drive, by least squares on its force.

The equation of motion of one joint holds its own friction and drive beside the recorded motion of all: what other
joints lack does not enter. So all joints are looked at side by side, as in the identification of industrial robots
(Swevers, Verdonck, De Schutter 2007, IEEE CSM 27(5)). What is proposed here is judged elsewhere.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.effects.catalogue import vocabulary
from wipx.identify.inverse_dynamics import Signals, missing, regressor, signals_of, weight_of
from wipx.identify.motion import independent_rows, motions
from wipx.identify.noise import sensor_noise


@dataclass(frozen=True)
class Law:
    """What an effect takes from the force of its joint.

    Attributes:
        columns: Force per unit of each of its sizes, shape (rows, C).
        least: Lower bounds of the sizes, shape (C,).
        numbers: Its numbers by symbol [SI], from the sizes.
        contains: Effect that it has as a special case; empty for none.
    """

    columns: np.ndarray
    least: tuple[float, ...]
    numbers: Callable[[np.ndarray], dict[str, float]]
    contains: str = ""


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
        laws = {name: law for name, law in _laws(signals, j, site).items() if name in known}
        for name, sizes in _selected(lacking[:, j], laws).items():
            found |= {f"{name}.{symbol}": value for symbol, value in laws[name].numbers(sizes).items()}
    return found


def _laws(signals: Signals, j: int, site: str) -> dict[str, Law]:
    """The laws that are tried on joint j.

    A wrong gain is not among them: least squares takes dry friction, most of the force of a slow joint, for one.
    """
    constant = np.ones(len(signals.rates))
    offset = f"actuator_{site}/offset"
    return {
        f"{site}/coulomb": _proportional("F_c", signals.slides[:, j]),
        f"{site}/viscous": _proportional("sigma", signals.rates[:, j]),
        f"{site}/rotor_inertia": _proportional("J", signals.accelerations[:, j]),
        offset: replace(_proportional("F_0", -constant), least=(-np.inf,)),
        f"{site}/spring": Law(
            np.stack([signals.coordinates[:, j], -constant], axis=1),
            (0.0, -np.inf),
            lambda sizes: {"k": float(sizes[0]), "q0": float(sizes[1] / max(sizes[0], 1e-300))},
            contains=offset,
        ),
    }


def _proportional(symbol: str, force: np.ndarray) -> Law:
    """A law of one number, not negative, to which its force (rows,) is proportional."""
    return Law(force[:, None], (0.0,), lambda sizes: {symbol: float(sizes[0])})


def _selected(lacking: np.ndarray, laws: Mapping[str, Law]) -> dict[str, np.ndarray]:
    """Sizes of the effects that least squares chooses one by one, as long as the criterion of Schwarz (1978) falls.

    Args:
        lacking: Force that the joint needs and is not given, shape (rows,).
        laws: Of the effects.
    """
    chosen: dict[str, np.ndarray] = {}
    left = lacking
    while True:
        rows = max(independent_rows(left[:, None]), 2.0)
        trials = [_fitted(lacking, laws, names) for names in _larger(list(chosen), laws)]
        gains = [
            rows * np.log(np.sum(left**2) / max(np.sum(rest**2), 1e-300))
            - np.log(rows) * (_count(sizes) - _count(chosen))
            for sizes, rest in trials
        ]
        if max(gains, default=0.0) <= 0.0:
            return chosen
        chosen, left = trials[int(np.argmax(gains))]


def _larger(chosen: list[str], laws: Mapping[str, Law]) -> list[list[str]]:
    """The chosen effects with each one more, none beside another that contains it."""
    contained = {laws[name].contains for name in chosen}
    return [
        [*(name for name in chosen if name != law.contains), added]
        for added, law in laws.items()
        if added not in chosen and added not in contained
    ]


def _count(sizes: Mapping[str, np.ndarray]) -> int:
    return sum(map(len, sizes.values()))


def _fitted(lacking: np.ndarray, laws: Mapping[str, Law], names: list[str]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Sizes of some effects within their bounds, and the force that they leave, shape (rows,)."""
    own = np.concatenate([laws[name].columns for name in names], axis=1)
    low = np.concatenate([laws[name].least for name in names])
    sizes = lsq_linear(own, -lacking, (low, np.inf)).x
    ends = np.cumsum([len(laws[name].least) for name in names])[:-1]
    return dict(zip(names, np.split(sizes, ends), strict=True)), lacking + own @ sizes
