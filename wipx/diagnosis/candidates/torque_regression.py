"""First guesses for a robot of many joints: laws of each joint, its drive and its link, by least squares on its force.

The equation of motion of one joint holds its own friction and drive beside the recorded motion of all: what other
joints lack does not enter, except that a link is felt by all joints that carry it. So joints are looked at one by one,
from the tips to the base, as in the identification of industrial robots (Swevers, Verdonck, De Schutter 2007, IEEE CSM
27(5)). What is proposed here is judged elsewhere.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.tree import Link
from wipx.effects.catalogue import vocabulary
from wipx.identify.inverse_dynamics import Signals, missing, numbers, regressor, signals_of, weight_of
from wipx.identify.motion import independent_rows, motions
from wipx.identify.noise import sensor_noise

SHIFT = 1e-3  # [m], over which slopes by a centre of mass are taken
MISPLACED = 0.1  # of the longest link: usual error of a centre of mass


@dataclass(frozen=True)
class Law:
    """What an effect takes from the force of its joint.

    Attributes:
        columns: Force per unit of each of its sizes, shape (rows, C).
        numbers: Its numbers by symbol [SI], from the sizes.
        least: Lower bound of the first size; the others have none.
        usual: Standard deviation of the sizes beforehand; None where any is as likely.
        contains: Effect that it has as a special case; empty for none.
    """

    columns: np.ndarray
    numbers: Callable[[np.ndarray], dict[str, float]]
    least: float = 0.0
    usual: float | None = None
    contains: str = ""

    @property
    def count(self) -> int:
        """Number of sizes."""
        return self.columns.shape[1]


@dataclass(frozen=True)
class Chosen:
    """Laws that are fitted to the force of a joint.

    Attributes:
        sizes: Of each law.
        left: Force that they leave, shape (rows,).
        surprise: Of the sizes beforehand, half the sum of their squares in standard deviations.
    """

    sizes: dict[str, np.ndarray]
    left: np.ndarray
    surprise: float = 0.0

    def score(self, rows: float) -> float:
        """Penalised log-likelihood (Schwarz 1978) of so many independent rows, up to a constant [nats]."""
        count = sum(map(len, self.sizes.values()))
        power = max(float(np.mean(self.left**2)), 1e-300)
        return -0.5 * rows * np.log(power) - self.surprise - 0.5 * count * np.log(rows)


def expected_effects(model: Model, recordings: Sequence[Recording]) -> dict[str, float]:
    """Numbers, by "site/kind.symbol" [SI], of effects of joints, drives and links that recorded forces ask for.

    Args:
        model: A robot from a model file, as its owner believes it to be.
        recordings: Of it.
    """
    tree = model.plant.tree
    assert tree is not None
    smoothed = motions(tuple(recordings), model.plant, sensor_noise(tuple(recordings), model.plant))
    signals = signals_of(model, smoothed)
    carried = regressor(tree, signals, weight_of(model))
    lacking = missing(model, signals, carried)
    known = vocabulary(model.plant).keys() - model.effects.keys()
    longest = max(float(np.linalg.norm(link.place)) for link in tree.links)
    found: dict[str, float] = {}
    for j, link in reversed(list(enumerate(tree.links))):
        laws = _laws(signals, j, link.joint)
        if link.mass:
            shifted = carried @ _centre_shifts(model, link)  # (rows, joints, 2)
            laws[f"link_{link.body}/com_offset"] = Law(
                shifted[:, j], lambda sizes, of=link: _along(sizes @ across(of)), -np.inf, MISPLACED * longest
            )
        chosen = _selected(lacking[:, j], {name: law for name, law in laws.items() if name in known})
        for name, sizes in chosen.items():
            found |= {f"{name}.{symbol}": value for symbol, value in laws[name].numbers(sizes).items()}
            if name.startswith("link_"):
                lacking = lacking + shifted @ sizes
    return found


def across(link: Link) -> np.ndarray:
    """Two directions across the axis of a link's joint, in the body's frame, shape (2, 3): along it no force shows."""
    return link.body_rotation[:2]


def _centre_shifts(model: Model, link: Link) -> np.ndarray:
    """Change of all inertial numbers per shift of a link's centre of mass across its joint, shape (10 N, 2)."""
    effect = f"link_{link.body}/com_offset"
    own = model.effects.get(effect, _along(np.zeros(3)))
    here = np.array([own[axis] for axis in "xyz"])
    moved = [numbers(model.with_effects({effect: _along(here + SHIFT * each)})) for each in across(link)]
    return np.stack([(each - numbers(model)) / SHIFT for each in moved], axis=1)


def _along(place: np.ndarray) -> dict[str, float]:
    return dict(zip("xyz", place.tolist(), strict=True))


def _laws(signals: Signals, j: int, site: str) -> dict[str, Law]:
    """The laws of joint j and its drive.

    A wrong gain is not among them: least squares takes dry friction, most of the force of a slow joint, for one.
    """
    constant = np.ones(len(signals.rates))
    offset = f"actuator_{site}/offset"
    return {
        f"{site}/coulomb": _proportional("F_c", signals.slides[:, j]),
        f"{site}/viscous": _proportional("sigma", signals.rates[:, j]),
        f"{site}/rotor_inertia": _proportional("J", signals.accelerations[:, j]),
        offset: _proportional("F_0", -constant, -np.inf),
        f"{site}/spring": Law(
            np.stack([signals.coordinates[:, j], -constant], axis=1),
            lambda sizes: {"k": float(sizes[0]), "q0": float(sizes[1] / max(sizes[0], 1e-300))},
            contains=offset,
        ),
    }


def _proportional(symbol: str, force: np.ndarray, least: float = 0.0) -> Law:
    """A law of one number to which its force (rows,) is proportional."""
    return Law(force[:, None], lambda sizes: {symbol: float(sizes[0])}, least)


def _selected(lacking: np.ndarray, laws: Mapping[str, Law]) -> dict[str, np.ndarray]:
    """Sizes of the effects that least squares chooses one by one, as long as each is worth its penalty.

    Args:
        lacking: Force that the joint needs and is not given, shape (rows,).
        laws: Of the effects.
    """
    chosen = Chosen({}, lacking)
    while True:
        rows = max(independent_rows(chosen.left[:, None]), 2.0)
        noise = float(np.sum(chosen.left**2)) / rows
        trials = [_fitted(lacking, laws, names, noise) for names in _larger(list(chosen.sizes), laws)]
        best = max(trials, key=lambda trial: trial.score(rows), default=chosen)
        if best.score(rows) <= chosen.score(rows):
            return chosen.sizes
        chosen = best


def _larger(chosen: list[str], laws: Mapping[str, Law]) -> list[list[str]]:
    """The chosen effects with each one more, none beside another that contains it."""
    contained = {laws[name].contains for name in chosen}
    return [
        [*(name for name in chosen if name != law.contains), added]
        for added, law in laws.items()
        if added not in chosen and added not in contained
    ]


def _fitted(lacking: np.ndarray, laws: Mapping[str, Law], names: list[str], noise: float) -> Chosen:
    """The likeliest sizes of some effects within their bounds.

    Args:
        lacking: Force that the joint needs and is not given, shape (rows,).
        laws: Of the effects.
        names: Of those that are fitted.
        noise: Square of a force over all rows that counts as one standard deviation squared.
    """
    own = np.concatenate([laws[name].columns for name in names], axis=1)
    low = np.concatenate([[laws[name].least, *[-np.inf] * (laws[name].count - 1)] for name in names])
    sure = np.concatenate([np.full(laws[name].count, 1.0 / (laws[name].usual or np.inf)) for name in names])
    beforehand = np.sqrt(noise) * np.diag(sure)[sure > 0.0]
    rows = np.concatenate([own, beforehand])
    sizes = lsq_linear(rows, np.concatenate([-lacking, np.zeros(len(beforehand))]), (low, np.inf)).x
    parts = np.split(sizes, np.cumsum([laws[name].count for name in names])[:-1])
    return Chosen(dict(zip(names, parts, strict=True)), lacking + own @ sizes, 0.5 * float(np.sum((sure * sizes) ** 2)))
