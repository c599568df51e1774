"""What recorded forces say of a robot of many joints: laws of each joint, its drive and its link, by least squares.

The equation of motion of one joint holds its own friction and drive beside the recorded motion of all: what other
joints lack does not enter, except that a link is felt by all joints that carry it. So joints are looked at one by one,
from the tips to the base, as in the identification of industrial robots (Swevers, Verdonck, De Schutter 2007, IEEE CSM
27(5)). A search begins with the effects that are asked for here. Where no law holds exactly, the numbers are priors of
what is fitted to predictions.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import lsq_linear

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.tree import Link
from wipx.diagnosis.likelihood.hypothesis import ByForces
from wipx.effects.catalogue import vocabulary
from wipx.identify.inverse_dynamics import Signals, missing, numbers, regressor, signals_of, weight_of
from wipx.identify.motion import independent_rows, motions
from wipx.identify.noise import sensor_noise

SHIFT = 1e-3  # [m], over which slopes by a centre of mass are taken
ALIKE = 1e-9  # relative, of the normal equations of columns that are nearly alike
MISPLACED = 0.1  # of the longest link: usual error of a centre of mass


@dataclass(frozen=True)
class Law:
    """What an effect takes from the force of its joint.

    Attributes:
        columns: Force per unit of each of its sizes, shape (rows, C).
        numbers: Its numbers by symbol [SI], from the sizes.
        measured: Symbol of the number that the first size is; empty for none.
        least: Lower bound of the first size; the others have none.
        usual: Standard deviation of the sizes beforehand; None where any is as likely.
        contains: Effect that it has as a special case; empty for none.
    """

    columns: np.ndarray
    numbers: Callable[[np.ndarray], dict[str, float]]
    measured: str = ""
    least: float = 0.0
    usual: float | None = None
    contains: str = ""

    @property
    def count(self) -> int:
        """Number of sizes."""
        return self.columns.shape[1]


@dataclass(frozen=True)
class Fitted:
    """Laws that are fitted to the force of a joint.

    Attributes:
        left: Force that they leave, shape (rows,).
        sizes: Of each law.
        deviations: Standard deviation of the first size of each law.
        surprise: Of the sizes beforehand, half the sum of their squares in standard deviations.
    """

    left: np.ndarray
    sizes: dict[str, np.ndarray] = field(default_factory=dict)
    deviations: dict[str, float] = field(default_factory=dict)
    surprise: float = 0.0

    @property
    def rows(self) -> float:
        """Number of rows of what is left that are independent."""
        return max(independent_rows(self.left[:, None]), 2.0)

    def score(self, rows: float) -> float:
        """Penalised log-likelihood (Schwarz 1978) of so many independent rows, up to a constant [nats]."""
        count = sum(map(len, self.sizes.values()))
        power = max(float(np.mean(self.left**2)), 1e-300)
        return -0.5 * rows * np.log(power) - self.surprise - 0.5 * count * np.log(rows)


def numbers_by_forces(model: Model, recordings: Sequence[Recording]) -> dict[str, ByForces]:
    """Numbers of effects of joints, drives and links, by "site/kind.symbol", as recorded forces have them.

    Of effects that are not asked for, the number that they would have beside the others.

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
    found: dict[str, ByForces] = {}
    for j, link in reversed(list(enumerate(tree.links))):
        laws = _laws(signals, j, link.joint)
        shifted = np.zeros((*lacking.shape, 2))
        if link.mass:
            shifted = carried @ _centre_shifts(model, link)  # (rows, joints, 2)
            laws[_off_centre(link)] = Law(
                shifted[:, j],
                lambda sizes, link=link: _place(sizes @ _across(link)),
                least=-np.inf,
                usual=MISPLACED * longest,
            )
        laws = {name: law for name, law in laws.items() if name in known}
        chosen = _selected(lacking[:, j], laws)
        for name, law in laws.items():
            own = chosen if name in chosen.sizes else _fitted(lacking[:, j], laws, _with(chosen, name, laws), chosen)
            for symbol, value in law.numbers(own.sizes[name]).items():
                deviation = own.deviations[name] if symbol == law.measured else np.inf
                found[f"{name}.{symbol}"] = ByForces(value, deviation, asked=own is chosen)
        lacking = lacking + shifted @ chosen.sizes.get(_off_centre(link), np.zeros(2))
    return found


def _off_centre(link: Link) -> str:
    return f"link_{link.body}/com_offset"


def _across(link: Link) -> np.ndarray:
    """Two directions across the axis of a link's joint, in the body's frame, shape (2, 3): along it no force shows."""
    return link.body_rotation[:2]


def _centre_shifts(model: Model, link: Link) -> np.ndarray:
    """Change of all inertial numbers per shift of a link's centre of mass across its joint, shape (10 N, 2)."""
    effect = _off_centre(link)
    own = model.effects.get(effect, _place(np.zeros(3)))
    here = np.array([own[axis] for axis in "xyz"])
    moved = [numbers(model.with_effects({effect: _place(here + SHIFT * each)})) for each in _across(link)]
    return np.stack([(each - numbers(model)) / SHIFT for each in moved], axis=1)


def _place(where: np.ndarray) -> dict[str, float]:
    return dict(zip("xyz", where.tolist(), strict=True))


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
            measured="k",
            contains=offset,
        ),
    }


def _proportional(symbol: str, force: np.ndarray, least: float = 0.0) -> Law:
    """A law of one number to which its force (rows,) is proportional."""
    return Law(force[:, None], lambda sizes: {symbol: float(sizes[0])}, symbol, least)


def _selected(lacking: np.ndarray, laws: Mapping[str, Law]) -> Fitted:
    """The effects that least squares chooses one by one, as long as each is worth its penalty.

    Args:
        lacking: Force that the joint needs and is not given, shape (rows,).
        laws: Of the effects.
    """
    chosen = Fitted(lacking)
    while True:
        contained = {laws[name].contains for name in chosen.sizes}
        more = [name for name in laws if name not in chosen.sizes and name not in contained]
        trials = [_fitted(lacking, laws, _with(chosen, name, laws), chosen) for name in more]
        rows = chosen.rows
        best = max(trials, key=lambda trial: trial.score(rows), default=chosen)
        if best.score(rows) <= chosen.score(rows):
            return chosen
        chosen = best


def _with(chosen: Fitted, added: str, laws: Mapping[str, Law]) -> list[str]:
    """The chosen effects and one more, without those that it contains or that contain it."""
    apart = (added, laws[added].contains)
    return [*(name for name in chosen.sizes if name not in apart and laws[name].contains != added), added]


def _fitted(lacking: np.ndarray, laws: Mapping[str, Law], names: list[str], before: Fitted) -> Fitted:
    """The likeliest sizes of some effects within their bounds.

    Args:
        lacking: Force that the joint needs and is not given, shape (rows,).
        laws: Of the effects.
        names: Of those that are fitted.
        before: A fit of fewer effects: what it leaves counts as noise.
    """
    noise = float(np.sum(before.left**2)) / before.rows  # rows that are not independent count together
    own = np.concatenate([laws[name].columns for name in names], axis=1)
    low = np.concatenate([[laws[name].least, *[-np.inf] * (laws[name].count - 1)] for name in names])
    sure = np.concatenate([np.full(laws[name].count, 1.0 / (laws[name].usual or np.inf)) for name in names])
    beforehand = np.sqrt(noise) * np.diag(sure)
    sizes = lsq_linear(np.concatenate([own, beforehand]), np.concatenate([-lacking, 0.0 * sure]), (low, np.inf)).x
    left = lacking + own @ sizes
    first = np.cumsum([0, *(laws[name].count for name in names)])
    spread = _deviations(own.T @ own + beforehand**2, noise)
    return Fitted(
        left,
        dict(zip(names, np.split(sizes, first[1:-1]), strict=True)),
        dict(zip(names, spread[first[:-1]].tolist(), strict=True)),
        0.5 * float(np.sum((sure * sizes) ** 2)),
    )


def _deviations(normal: np.ndarray, noise: float) -> np.ndarray:
    """Standard deviations by the normal equations (D, D); infinite for what no row shows, shape (D,)."""
    size = np.sqrt(np.diag(normal))
    shown = size > 0.0
    found = np.full(len(size), np.inf)
    scaled = normal[np.ix_(shown, shown)] / np.outer(size[shown], size[shown])
    found[shown] = np.sqrt(noise * np.diag(np.linalg.inv(scaled + ALIKE * np.eye(len(scaled))))) / size[shown]
    return found
