"""What effects of links, joints and drives add to the forces that a recorded motion needs.

All of it is a sum of columns: forces per unit of the inertial numbers of the links (Atkeson, An, Hollerbach 1986, IJRR
5(3)), of gravity's direction, and of what a joint lacks by itself. An effect says how much it takes of each column.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.tree import Link, Tree
from wipx.diagnosis.candidates.point_mass_scan import masses_with
from wipx.effects.catalogue import effect_of
from wipx.identify.inverse_dynamics import Signals, gravity_regressor, missing, numbers, regressor, weight_of
from wipx.sim.tree.equations import NUMBERS
from wipx.sim.tree.inertias import gravity, inertial_numbers

DIRECTION, RATE, ACCELERATION, COORDINATE, MINUS_ONE, NEEDED = range(6)  # columns of a joint
OWN = 6  # of them
SHIFT = 1e-4  # [kg, m, rad], over which slopes are taken
GAIN = 0.2  # usual error of a drive's gain
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
    measured: str = ""
    contains: str = ""
    sizes: Callable[[np.ndarray], np.ndarray] = _same
    slopes: Callable[[np.ndarray], np.ndarray] = _one_to_one
    starts: Callable[[np.ndarray], np.ndarray] = _single

    @property
    def count(self) -> int:
        """How many numbers are fitted."""
        return len(self.low)


@dataclass(frozen=True, eq=False)
class ForceColumns:
    """Forces of the joints per unit of every size, and what they add up to.

    Attributes:
        lacking: That the motion needs and the model does not give, shape (rows, joints).
        inertial: Per inertial number of each link, shape (rows, joints, 10 N).
        tilt: Per roll and pitch of the base, shape (rows, joints, 2).
        own: Of each joint alone, shape (rows, joints, OWN).
    """

    lacking: np.ndarray
    inertial: np.ndarray
    tilt: np.ndarray
    own: np.ndarray

    @classmethod
    def of(cls, model: Model, signals: Signals) -> "ForceColumns":
        """Those of a recorded motion."""
        tree = _tree_of(model)
        constant = np.ones_like(signals.rates)
        inertial = regressor(tree, signals, weight_of(model))
        lacking = missing(model, signals, inertial)
        needed = lacking + signals.forces
        own = [signals.slides, signals.rates, signals.accelerations, signals.coordinates, -constant, needed]
        tilted = gravity_regressor(tree, signals, numbers(model)) @ _tilts(model, tree)
        return cls(lacking, inertial, tilted, np.stack(own, axis=2))

    def extrapolated(self, wider: "ForceColumns") -> "ForceColumns":
        """Without the bias of the filter, from the same columns behind a filter that is wider by the root of two."""
        names = [each.name for each in fields(self)]
        return ForceColumns(*(2.0 * getattr(self, name) - getattr(wider, name) for name in names))

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

    def left(self, sizes: np.ndarray) -> np.ndarray:
        """Force that stays at each joint, shape (rows, joints), for sizes (count,)."""
        ends = np.cumsum([self.inertial.shape[2], self.tilt.shape[2]])
        inertial, tilt, own = np.split(sizes, ends)
        return (
            self.lacking
            + self.inertial @ inertial
            + self.tilt @ tilt
            + np.sum(self.own * own.reshape(self.own.shape[1:]), axis=2)
        )


def force_laws(model: Model) -> dict[str, ForceLaw]:
    """The laws of the effects "site/kind" that are sums of columns."""
    tree = _tree_of(model)
    longest = max(float(np.linalg.norm(link.place)) for link in tree.links) or 1.0
    heaviest = max(link.mass for link in tree.links)
    laws: dict[str, ForceLaw] = {}
    first = NUMBERS * len(tree.links)
    laws["environment/base_tilt"] = ForceLaw(
        np.arange(first, first + 2),
        lambda fitted: dict(zip(("roll", "pitch"), fitted.tolist(), strict=True)),
        np.full(2, -np.inf),
        np.full(2, np.inf),
    )
    for i, link in enumerate(tree.links):
        laws |= _joint_laws(link.joint, first + 2 + OWN * i)
        if link.mass:
            laws |= _link_laws(model, link, NUMBERS * i, longest, heaviest)
    return laws


def _joint_laws(site: str, first: int) -> dict[str, ForceLaw]:
    """The laws of a joint and its drive, whose columns begin at `first`.

    A gain divides the force that the motion needs. If it multiplied the commands, none at all would leave the least.
    """
    offset = f"actuator_{site}/offset"
    return {
        f"{site}/coulomb": _proportional(first + DIRECTION, "F_c"),
        f"{site}/viscous": _proportional(first + RATE, "sigma"),
        f"{site}/rotor_inertia": _proportional(first + ACCELERATION, "J"),
        offset: _proportional(first + MINUS_ONE, "F_0", -np.inf),
        f"{site}/spring": ForceLaw(
            np.array([first + COORDINATE, first + MINUS_ONE]),
            lambda fitted: {"k": float(fitted[0]), "q0": float(fitted[1] / max(fitted[0], 1e-300))},
            np.array([0.0, -np.inf]),
            np.full(2, np.inf),
            "k",
            offset,
        ),
        f"actuator_{site}/gain": ForceLaw(
            np.array([first + NEEDED]),
            lambda fitted: {"k": 1.0 / (1.0 + float(fitted[0]))},
            np.array([STRONGEST]),
            np.array([GAIN]),
        ),
    }


def _proportional(column: int, symbol: str, low: float = 0.0) -> ForceLaw:
    """A law of one number to which its force is proportional."""
    none = np.array([np.inf])
    return ForceLaw(np.array([column]), lambda fitted: {symbol: float(fitted[0])}, np.array([low]), none, symbol)


@dataclass(frozen=True)
class _LinkEffect:
    """What an effect adds to a link's inertial numbers. Fitted are changes of its numbers from the neutral ones."""

    model: Model
    link: Link
    kind: str

    @property
    def name(self) -> str:
        return f"link_{self.link.body}/{self.kind}"

    @cached_property
    def neutral(self) -> dict[str, float]:
        return effect_of(self.name, self.model.plant).neutral

    def numbers(self, fitted: np.ndarray) -> dict[str, float]:
        return dict(zip(self.neutral, (self._about + fitted).tolist(), strict=True))

    def sizes(self, fitted: np.ndarray) -> np.ndarray:
        return self._sizes_of_many(fitted[None])[:, 0]

    def slopes(self, fitted: np.ndarray) -> np.ndarray:
        step = SHIFT * np.eye(len(fitted))
        return (self._sizes_of_many(fitted + step) - self._sizes_of_many(fitted - step)) / (2.0 * SHIFT)

    def _sizes_of_many(self, fitted: np.ndarray) -> np.ndarray:
        """For what is fitted (P, n), shape (10, P)."""
        batch = ModelBatch(self._model, self._names, self._about + fitted)
        return inertial_numbers(batch, self.link) - self._without

    @cached_property
    def _about(self) -> np.ndarray:
        return np.array(list(self.neutral.values()))

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(f"{self.name}.{symbol}" for symbol in self.neutral)

    @cached_property
    def _model(self) -> Model:
        return self.model.with_effects({self.name: self.neutral})

    @cached_property
    def _without(self) -> np.ndarray:
        return inertial_numbers(ModelBatch(self.model), self.link)


def _link_laws(model: Model, link: Link, first: int, longest: float, heaviest: float) -> dict[str, ForceLaw]:
    """The laws of a link, whose columns begin at `first`, of a robot whose links are so long [m] and heavy [kg]."""
    mass, place = model.parameters[f"{link.body}.mass"], np.full(3, longest)

    def off_centre(sizes: np.ndarray) -> np.ndarray:
        return (link.body_rotation.T @ sizes[1:4] / mass)[None]

    def unchanged(sizes: np.ndarray) -> np.ndarray:
        return np.zeros((1, 1))

    def masses(sizes: np.ndarray) -> np.ndarray:
        """Several masses with the same first moment."""
        moment, heavy = sizes[1:4], masses_with(sizes[1:4], float(sizes[0]))[:, None]
        return np.column_stack([heavy, (moment / np.maximum(heavy, 1e-300) - link.body_place) @ link.body_rotation])

    starts = {
        "com_offset": (off_centre, np.full(3, -np.inf), MISPLACED * place),
        "inertia": (unchanged, np.array([-0.9]), np.ones(1)),
        "payload": (masses, np.array([0.0, *np.full(3, -np.inf)]), np.array([heaviest, *place])),
    }
    columns = np.arange(first, first + NUMBERS)
    laws = {}
    for kind, (begins, low, usual) in starts.items():
        own = _LinkEffect(model, link, kind)
        laws[own.name] = ForceLaw(columns, own.numbers, low, usual, sizes=own.sizes, slopes=own.slopes, starts=begins)
    return laws


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
