"""What effects of links, joints, drives and sensors add to the forces that a recorded motion needs.

All of it is a sum of columns: forces per unit of the inertial numbers of the links (Atkeson, An, Hollerbach 1986, IJRR
5(3)), of gravity's direction, of sensor errors, and of what a joint lacks by itself. An effect says how much it takes
of each column.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.tree import Link
from wipx.diagnosis.candidates.force_columns import (
    ACCELERATION,
    BUMPS,
    CLIPPED,
    COORDINATE,
    DELAYED,
    DELAYS,
    DIRECTION,
    DRAG,
    LAGGED,
    LAGS,
    LOAD_SHARES,
    MINUS_ONE,
    NEEDED,
    OWN,
    RATE,
    RUBBED,
    SENSOR,
    SHIFT,
    STIFFNESS,
    Ranges,
    tree_of,
)
from wipx.diagnosis.candidates.point_mass_scan import masses_with
from wipx.effects.catalogue import effect_of
from wipx.sim.tree.equations import NUMBERS
from wipx.sim.tree.inertias import body_numbers, body_of

GAIN = 0.2  # usual error of a drive's gain or stiffness, or a sensor's scale
LOST = 0.2  # usual share of a force that gears lose to friction; those of servos lose up to 0.4 (Duclusaud 2025)
STRONGEST = -0.8  # change of the needed force by a gain of five
MISPLACED = 0.1  # of the longest link: usual error of a centre of mass


def _same(fitted: np.ndarray) -> np.ndarray:
    return fitted


def _one_to_one(fitted: np.ndarray) -> np.ndarray:
    return np.eye(len(fitted))


def _single(sizes: np.ndarray) -> np.ndarray:
    return sizes[None]


@dataclass(frozen=True)
class ForceLaw:
    """What an effect takes from the forces of the joints.

    Attributes:
        columns: Which columns it takes, shape (C,).
        numbers: Its numbers by symbol [SI], from what is fitted, shape (n,).
        low: Lower bounds of what is fitted, shape (n,).
        usual: Its standard deviations about zero beforehand, shape (n,); infinite where any is as likely.
        high: Upper bounds of what is fitted, shape (n,); None for none.
        measured: Symbol of the number that is fitted first; empty for none.
        contains: Effect that it has as a special case; empty for none.
        sizes: Of the columns, shape (C,), from what is fitted.
        slopes: Of the sizes by what is fitted, shape (C, n), there.
        starts: Where a fit may start, shape (S, n), from the sizes that fit best without the effect's law.
    """

    columns: np.ndarray
    numbers: Callable[[np.ndarray], dict[str, float]]
    low: np.ndarray
    usual: np.ndarray
    high: np.ndarray | None = None
    measured: str = ""
    contains: str = ""
    sizes: Callable[[np.ndarray], np.ndarray] = _same
    slopes: Callable[[np.ndarray], np.ndarray] = _one_to_one
    starts: Callable[[np.ndarray], np.ndarray] = _single

    @property
    def count(self) -> int:
        """How many numbers are fitted."""
        return len(self.low)


@dataclass(frozen=True)
class _Nodes:
    """Values of a number at which its law has a column, and zero, where it does nothing.

    Attributes:
        at: Rising, shape (K,) [SI].
    """

    at: np.ndarray

    def weights(self, value: float) -> np.ndarray:
        """Of the columns, shape (K,), by linear interpolation."""
        hats = np.eye(len(self.at) + 1)[1:]
        return np.array([np.interp(value, [0.0, *self.at], hat) for hat in hats])

    def slopes(self, value: float) -> np.ndarray:
        """Of the weights by the value, shape (K,)."""
        places = np.array([0.0, *self.at])
        k = int(np.clip(np.searchsorted(places, value, side="right"), 1, len(self.at)))
        steep = np.zeros(len(places))
        steep[[k - 1, k]] = np.array([-1.0, 1.0]) / (places[k] - places[k - 1])
        return steep[1:]


def force_laws(model: Model, ranges: Ranges) -> dict[str, ForceLaw]:
    """The laws of the effects "site/kind" that are sums of columns."""
    tree = tree_of(model)
    longest = max(float(np.linalg.norm(link.place)) for link in tree.links) or 1.0
    heaviest = max(link.mass for link in tree.links)
    tilt = NUMBERS * len(tree.links)
    sensors = tilt + 2
    joints = sensors + SENSOR * len(tree.links)
    laws = {"environment/base_tilt": _linear(tilt + np.arange(2), ("roll", "pitch"))}
    delays, timed = _Nodes(np.array(DELAYS)), []
    for i, link in enumerate(tree.links):
        first, drive = joints + OWN * i, f"actuator_{link.joint}"
        laws |= _joint_laws(link.joint, first, _Nodes(ranges.stribeck_speeds[:, i]))
        laws |= _drive_laws(drive, first, _Nodes(ranges.limits[:, i]))
        laws[f"{drive}/delay"] = _interpolated(first + DELAYED, "tau", delays)
        timed.append(first + DELAYED)
        laws |= _sensor_laws(f"sensor_{model.plant.columns[link.joint]}", sensors + SENSOR * i)
        if link.mass:
            laws |= _link_laws(model, link, NUMBERS * i, longest, heaviest)
    laws["actuator/delay"] = _interpolated(np.stack(timed), "tau", delays)
    return laws


def _joint_laws(site: str, first: int, speeds: _Nodes) -> dict[str, ForceLaw]:
    """The laws of a joint, whose columns begin at `first`."""

    def stribeck(fitted: np.ndarray) -> np.ndarray:
        level, peak, speed = fitted
        return np.array([level, *peak * speeds.weights(speed)])

    def stribeck_slopes(fitted: np.ndarray) -> np.ndarray:
        _, peak, speed = fitted
        slopes = np.zeros((1 + len(BUMPS), 3))
        slopes[0, 0] = 1.0
        slopes[1:, 1], slopes[1:, 2] = speeds.weights(speed), peak * speeds.slopes(speed)
        return slopes

    def stribeck_starts(sizes: np.ndarray) -> np.ndarray:
        level, peak = max(sizes[0], 0.0), max(sizes[1:].sum(), 0.1 * abs(sizes[0]))
        return np.array([[level, peak, speed] for speed in speeds.at])

    return {
        f"{site}/coulomb": _proportional(first + DIRECTION, "F_c"),
        f"{site}/viscous": _proportional(first + RATE, "sigma"),
        f"{site}/rotor_inertia": _proportional(first + ACCELERATION, "J"),
        f"{site}/quadratic_drag": _proportional(first + DRAG, "c"),
        f"{site}/load_friction": _load_friction_law(first),
        f"{site}/spring": ForceLaw(
            np.array([first + COORDINATE, first + MINUS_ONE]),
            lambda fitted: {"k": float(fitted[0]), "q0": float(fitted[1] / max(fitted[0], 1e-300))},
            np.array([0.0, -np.inf]),
            np.full(2, np.inf),
            measured="k",
            contains=f"actuator_{site}/offset",
        ),
        f"{site}/stribeck": ForceLaw(
            np.array([first + DIRECTION, *first + BUMPS]),
            lambda fitted: {"F_c": fitted[0], "F_s": fitted[0] + fitted[1], "v_s": fitted[2]},
            np.array([0.0, 0.0, 0.5 * speeds.at[0]]),
            np.full(3, np.inf),
            high=np.array([np.inf, np.inf, speeds.at[-1]]),
            contains=f"{site}/coulomb",
            sizes=stribeck,
            slopes=stribeck_slopes,
            starts=stribeck_starts,
        ),
    }


def _load_friction_law(first: int) -> ForceLaw:
    """Friction that grows with the motor's force and with the load, on the joint whose columns begin at `first`.

    Its columns hold the friction where the load's number is some share of the sum of both.
    """
    shares = _Nodes(np.array(LOAD_SHARES[1:]))

    def share(fitted: np.ndarray) -> float:
        return float(fitted[1] / max(fitted.sum(), 1e-300))

    def weights(fitted: np.ndarray) -> np.ndarray:
        own = shares.weights(share(fitted))
        return np.array([1.0 - own.sum(), *own])

    def slopes(fitted: np.ndarray) -> np.ndarray:
        own = shares.slopes(share(fitted))
        by_share = np.array([-own.sum(), *own])
        at = weights(fitted)
        return np.stack([at - share(fitted) * by_share, at + (1.0 - share(fitted)) * by_share], axis=1)

    def starts(sizes: np.ndarray) -> np.ndarray:
        both = np.clip(sizes.sum(), 0.0, LOST)
        return both * np.stack([1.0 - np.array(LOAD_SHARES), LOAD_SHARES], axis=1)

    return ForceLaw(
        first + RUBBED,
        lambda fitted: dict(zip(("K_motor", "K_external"), fitted.tolist(), strict=True)),
        np.zeros(2),
        np.full(2, LOST),
        sizes=lambda fitted: fitted.sum() * weights(fitted),
        slopes=slopes,
        starts=starts,
    )


def _drive_laws(site: str, first: int, limits: _Nodes) -> dict[str, ForceLaw]:
    """The laws of a drive, the columns of whose joint begin at `first`.

    A gain divides the force that the motion needs. If it multiplied the commands, none at all would leave the least.
    """
    whole = np.eye(len(limits.at))[-1]
    return {
        f"{site}/offset": _proportional(first + MINUS_ONE, "F_0", -np.inf),
        f"{site}/gain": ForceLaw(
            np.array([first + NEEDED]),
            lambda fitted: {"k": 1.0 / (1.0 + float(fitted[0]))},
            np.array([STRONGEST]),
            np.array([GAIN]),
        ),
        f"{site}/kp": ForceLaw(
            first + STIFFNESS,
            lambda fitted: {"factor": 1.0 + float(fitted[0])},
            np.array([STRONGEST]),
            np.array([GAIN]),
        ),
        f"{site}/lag": _interpolated(first + LAGGED, "tau", _Nodes(np.array(LAGS))),
        f"{site}/dead_zone": _interpolated(first + CLIPPED, "band", limits),
        f"{site}/saturation": _interpolated(first + CLIPPED, "F_max", limits, taken_from=whole),
    }


def _sensor_laws(site: str, first: int) -> dict[str, ForceLaw]:
    """The laws of a sensor, whose columns begin at `first`."""
    return {
        f"{site}/bias": _linear(np.array([first]), ("b",)),
        f"{site}/scale": replace(_linear(np.array([first + 1]), ("e",)), usual=np.array([GAIN])),
        f"{site}/delay": _linear(np.array([first + 2]), ("tau",), 0.0),
    }


def _linear(columns: np.ndarray, symbols: tuple[str, ...], low: float = -np.inf) -> ForceLaw:
    """A law whose force is proportional to each of its numbers."""
    return ForceLaw(
        columns,
        lambda fitted: dict(zip(symbols, fitted.tolist(), strict=True)),
        np.full(len(columns), low),
        np.full(len(columns), np.inf),
    )


def _proportional(column: int, symbol: str, low: float = 0.0) -> ForceLaw:
    """A law of one number that is known beside other laws too."""
    return replace(_linear(np.array([column]), (symbol,), low), measured=symbol)


def _interpolated(columns: np.ndarray, symbol: str, nodes: _Nodes, taken_from: np.ndarray | None = None) -> ForceLaw:
    """A law of one number between those at which it has a column.

    Args:
        columns: Shape (K,); of several joints that share the number, shape (joints, K).
        symbol: Of the number.
        nodes: Where the columns are.
        taken_from: Sizes of the columns, from which the weights are subtracted; None where the weights are the sizes.
    """
    joints = columns.size // len(nodes.at)
    sign, least = (1.0, np.zeros(len(nodes.at))) if taken_from is None else (-1.0, taken_from)
    return ForceLaw(
        columns.ravel(),
        lambda fitted: {symbol: float(fitted[0])},
        np.zeros(1),
        np.full(1, np.inf),
        high=nodes.at[-1:],
        sizes=lambda fitted: np.tile(least + sign * nodes.weights(fitted[0]), joints),
        slopes=lambda fitted: sign * np.tile(nodes.slopes(fitted[0]), joints)[:, None],
        starts=lambda _: nodes.at[:-1, None],
    )


def _link_laws(model: Model, link: Link, first: int, longest: float, heaviest: float) -> dict[str, ForceLaw]:
    """The laws of a link, whose columns begin at `first`, of a robot whose links are so long [m] and heavy [kg].

    Fitted are changes of an effect's numbers from the neutral ones.
    """
    mass, com, scale = body_of(ModelBatch(model), link)
    known, place = body_numbers(link, mass, com, scale), np.full(3, longest)

    def moved(fitted: np.ndarray) -> np.ndarray:
        return body_numbers(link, mass, com + fitted.T, scale) - known

    def scaled(fitted: np.ndarray) -> np.ndarray:
        return body_numbers(link, mass, com, scale * (1.0 + fitted[:, 0])) - known

    def loaded(fitted: np.ndarray) -> np.ndarray:
        return body_numbers(link, fitted[:, 0], fitted[:, 1:].T, np.zeros(1))

    def off_centre(sizes: np.ndarray) -> np.ndarray:
        return (link.body_rotation.T @ sizes[1:4] / mass)[None]

    def unchanged(sizes: np.ndarray) -> np.ndarray:
        return np.zeros((1, 1))

    def masses(sizes: np.ndarray) -> np.ndarray:
        """Several masses with the same first moment."""
        moment, heavy = sizes[1:4], masses_with(sizes[1:4], float(sizes[0]))[:, None]
        return np.column_stack([heavy, (moment / np.maximum(heavy, 1e-300) - link.body_place) @ link.body_rotation])

    laws = (
        ("com_offset", moved, off_centre, np.full(3, -np.inf), MISPLACED * place),
        ("inertia", scaled, unchanged, np.array([-0.9]), np.ones(1)),
        ("payload", loaded, masses, np.array([0.0, *np.full(3, -np.inf)]), np.array([heaviest, *place])),
    )
    columns = np.arange(first, first + NUMBERS)
    return {
        f"link_{link.body}/{kind}": ForceLaw(
            columns,
            partial(_beside_neutral, effect_of(f"link_{link.body}/{kind}", model.plant).neutral),
            low,
            usual,
            sizes=partial(_sizes, change),
            slopes=partial(_slopes, change),
            starts=starts,
        )
        for kind, change, starts, low, usual in laws
    }


def _beside_neutral(neutral: Mapping[str, float], fitted: np.ndarray) -> dict[str, float]:
    return {symbol: value + change for (symbol, value), change in zip(neutral.items(), fitted.tolist(), strict=True)}


def _sizes(change: Callable[[np.ndarray], np.ndarray], fitted: np.ndarray) -> np.ndarray:
    """Sizes of columns, of a law that has them for many points (P, n) at once, shape (C, P)."""
    return change(fitted[None])[:, 0]


def _slopes(change: Callable[[np.ndarray], np.ndarray], fitted: np.ndarray) -> np.ndarray:
    """Their slopes by central differences."""
    step = SHIFT * np.eye(len(fitted))
    up, down = np.split(change(np.concatenate([fitted + step, fitted - step])), 2, axis=1)
    return (up - down) / (2.0 * SHIFT)
