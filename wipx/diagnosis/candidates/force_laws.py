"""What effects of links, joints and drives add to the forces that a recorded motion needs.

All of it is a sum of columns: forces per unit of the inertial numbers of the links (Atkeson, An, Hollerbach 1986, IJRR
5(3)), of gravity's direction, and of what a joint lacks by itself. An effect says how much it takes of each column.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.tree import Link, Tree
from wipx.identify.inverse_dynamics import Signals, gravity_regressor, numbers, regressor, weight_of
from wipx.sim.tree.equations import NUMBERS
from wipx.sim.tree.inertias import gravity, inertial_numbers

OWN = 5  # columns of a joint: direction of motion, rate, acceleration, coordinate, minus one
SHIFT = 1e-4  # [kg, m, rad], over which slopes are taken
MISPLACED = 0.1  # of the longest link: usual error of a centre of mass
ARMS = (0.1, 0.2, 0.4, 0.8)  # of the longest link: distances of a mass that are tried


@dataclass(frozen=True)
class ForceLaw:
    """What an effect takes from the forces of the joints.

    Attributes:
        columns: Which columns it takes, shape (C,).
        sizes: Of the columns, shape (C,), from what is fitted, shape (n,).
        slopes: Of the sizes by what is fitted, shape (C, n), there.
        starts: Where a fit may start, shape (S, n), from the sizes that fit best without the effect's law.
        numbers: Its numbers by symbol [SI], from what is fitted.
        low: Lower bounds of what is fitted, shape (n,).
        usual: Its standard deviations beforehand, shape (n,); infinite where any is as likely.
        measured: Symbol of the number that is fitted first; empty for none.
        contains: Effect that it has as a special case; empty for none.
    """

    columns: np.ndarray
    sizes: Callable[[np.ndarray], np.ndarray]
    slopes: Callable[[np.ndarray], np.ndarray]
    starts: Callable[[np.ndarray], np.ndarray]
    numbers: Callable[[np.ndarray], dict[str, float]]
    low: np.ndarray
    usual: np.ndarray
    measured: str = ""
    contains: str = ""

    @property
    def count(self) -> int:
        """How many numbers are fitted."""
        return len(self.low)


@dataclass(frozen=True, eq=False)
class ForceColumns:
    """Forces of the joints per unit of every size.

    Attributes:
        inertial: Per inertial number of each link, shape (rows, joints, 10 N).
        tilt: Per roll and pitch of the base, shape (rows, joints, 2).
        own: Of each joint alone, shape (rows, joints, 5).
    """

    inertial: np.ndarray
    tilt: np.ndarray
    own: np.ndarray

    @classmethod
    def of(cls, model: Model, signals: Signals) -> "ForceColumns":
        """Those of a recorded motion."""
        tree = _tree_of(model)
        constant = np.ones_like(signals.rates)
        own = [signals.slides, signals.rates, signals.accelerations, signals.coordinates, -constant]
        tilted = gravity_regressor(tree, signals, numbers(model)) @ _tilts(model, tree)
        return cls(regressor(tree, signals, weight_of(model)), tilted, np.stack(own, axis=2))

    def extrapolated(self, wider: "ForceColumns") -> "ForceColumns":
        """Without the bias of the filter, from the same columns behind a filter that is wider by the root of two."""
        pairs = ((self.inertial, wider.inertial), (self.tilt, wider.tilt), (self.own, wider.own))
        return ForceColumns(*(2.0 * one - other for one, other in pairs))

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.inertial.shape[2] + self.tilt.shape[2] + self.own.shape[1] * self.own.shape[2]

    @property
    def sizes(self) -> np.ndarray:
        """Sum of squares of every column, shape (count,)."""
        parts = (np.sum(each**2, axis=(0, 1)).ravel() for each in (self.inertial, self.tilt))
        return np.concatenate([*parts, np.sum(self.own**2, axis=0).ravel()])

    def of_joint(self, j: int) -> np.ndarray:
        """All columns in the force of one joint, shape (rows, count)."""
        alone = np.zeros((len(self.own), *self.own.shape[1:]))
        alone[:, j] = self.own[:, j]
        return np.concatenate([self.inertial[:, j], self.tilt[:, j], alone.reshape(len(alone), -1)], axis=1)

    def forces(self, sizes: np.ndarray) -> np.ndarray:
        """Forces of all joints, shape (rows, joints), for sizes (count,)."""
        ends = np.cumsum([self.inertial.shape[2], self.tilt.shape[2]])
        inertial, tilt, own = np.split(sizes, ends)
        return self.inertial @ inertial + self.tilt @ tilt + np.sum(self.own * own.reshape(self.own.shape[1:]), axis=2)


def force_laws(model: Model) -> dict[str, ForceLaw]:
    """The laws of the effects "site/kind" that are sums of columns.

    A wrong gain is not among them: least squares takes dry friction, most of the force of a slow joint, for one.
    """
    tree = _tree_of(model)
    longest = max(float(np.linalg.norm(link.place)) for link in tree.links) or 1.0
    laws: dict[str, ForceLaw] = {}
    first = NUMBERS * len(tree.links)
    laws["environment/base_tilt"] = ForceLaw(
        np.arange(first, first + 2),
        _same,
        _one_to_one,
        _single,
        lambda fitted: dict(zip(("roll", "pitch"), fitted.tolist(), strict=True)),
        np.full(2, -np.inf),
        np.full(2, np.inf),
    )
    for i, link in enumerate(tree.links):
        laws |= _joint_laws(link.joint, first + 2 + OWN * i)
        if link.mass:
            laws |= _link_laws(model, link, np.arange(NUMBERS * i, NUMBERS * (i + 1)), longest)
    return laws


def _joint_laws(site: str, first: int) -> dict[str, ForceLaw]:
    """The laws of a joint and its drive, whose columns begin at `first`."""
    offset = f"actuator_{site}/offset"
    spring = ForceLaw(
        np.array([first + 3, first + 4]),
        _same,
        _one_to_one,
        _single,
        lambda fitted: {"k": float(fitted[0]), "q0": float(fitted[1] / max(fitted[0], 1e-300))},
        np.array([0.0, -np.inf]),
        np.full(2, np.inf),
        "k",
        offset,
    )
    return {
        f"{site}/coulomb": _proportional(first, "F_c"),
        f"{site}/viscous": _proportional(first + 1, "sigma"),
        f"{site}/rotor_inertia": _proportional(first + 2, "J"),
        offset: _proportional(first + 4, "F_0", -np.inf),
        f"{site}/spring": spring,
    }


def _proportional(column: int, symbol: str, low: float = 0.0) -> ForceLaw:
    """A law of one number to which its force is proportional."""
    return ForceLaw(
        np.array([column]),
        _same,
        _one_to_one,
        _single,
        lambda fitted: {symbol: float(fitted[0])},
        np.array([low]),
        np.array([np.inf]),
        symbol,
    )


def _same(fitted: np.ndarray) -> np.ndarray:
    return fitted


def _one_to_one(fitted: np.ndarray) -> np.ndarray:
    return np.eye(len(fitted))


def _single(sizes: np.ndarray) -> np.ndarray:
    return sizes[None]


def _link_laws(model: Model, link: Link, columns: np.ndarray, longest: float) -> dict[str, ForceLaw]:
    """The laws of a link."""
    mass = model.parameters[f"{link.body}.mass"]

    def moved(moment: np.ndarray, heavy: float) -> np.ndarray:
        """Place in the body's frame of a mass with a first moment in the link's frame, each shape (3,)."""
        return link.body_rotation.T @ (moment / heavy - link.body_place)

    def off_centre(sizes: np.ndarray) -> np.ndarray:
        return (link.body_rotation.T @ sizes[1:4] / mass)[None]

    def masses(sizes: np.ndarray) -> np.ndarray:
        moment = sizes[1:4]
        tried = [float(np.linalg.norm(moment)) / (share * longest) for share in ARMS]
        heavy = [each for each in (*tried, float(sizes[0])) if each > 0.0]
        return np.array([[each, *moved(moment, each)] for each in heavy]).reshape(-1, 4)

    def law(kind: str, names: Sequence[str], starts: Callable, low: np.ndarray, usual: np.ndarray) -> ForceLaw:
        effect = f"link_{link.body}/{kind}"

        def named(fitted: np.ndarray) -> dict[str, float]:
            return dict(zip(names, fitted.tolist(), strict=True))

        def sizes(fitted: np.ndarray) -> np.ndarray:
            return of_many(fitted[None])[:, 0]

        def slopes(fitted: np.ndarray) -> np.ndarray:
            step = SHIFT * np.eye(len(fitted))
            return (of_many(fitted + step) - of_many(fitted - step)) / (2.0 * SHIFT)

        def of_many(fitted: np.ndarray) -> np.ndarray:
            """Sizes (10, P) for what is fitted (P, n)."""
            batch = ModelBatch(loaded, tuple(f"{effect}.{name}" for name in names), fitted)
            return inertial_numbers(batch, link) - plain

        loaded = model.with_effects({effect: named(np.zeros(len(low)))})
        return ForceLaw(columns, sizes, slopes, starts, named, low, usual)

    plain, place = inertial_numbers(ModelBatch(model), link), np.full(3, longest)
    return {
        f"link_{link.body}/com_offset": law("com_offset", "xyz", off_centre, np.full(3, -np.inf), MISPLACED * place),
        f"link_{link.body}/inertia": law(
            "inertia", ("scale",), lambda sizes: np.ones((1, 1)), np.array([0.1]), np.array([np.inf])
        ),
        f"link_{link.body}/payload": law(
            "payload", ("mass", *"xyz"), masses, np.array([0.0, *np.full(3, -np.inf)]), np.array([np.inf, *place])
        ),
    }


def _tilts(model: Model, tree: Tree) -> np.ndarray:
    """Change of gravity in the frame of the base per roll and pitch, shape (3, 2)."""
    tilt = model.effects.get("environment/base_tilt", {"roll": 0.0, "pitch": 0.0})
    here = weight_of(model)
    slopes = []
    for name in ("roll", "pitch"):
        moved = model.with_effects({"environment/base_tilt": {**tilt, name: tilt[name] + SHIFT}})
        slopes.append((gravity(ModelBatch(moved), tree)[:, 0] - here) / SHIFT)
    return np.stack(slopes, axis=1)


def _tree_of(model: Model) -> Tree:
    assert model.plant.tree is not None
    return model.plant.tree
