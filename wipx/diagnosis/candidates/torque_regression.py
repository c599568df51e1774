"""What recorded forces say of a robot of many joints: laws of joints, drives and links, by least squares.

The equations of motion of all joints hold together, each with a noise of its own, as in the identification of
industrial robots (Swevers, Verdonck, De Schutter 2007, IEEE CSM 27(5)). What a joint lacks and no law explains yet
counts as its noise. Friction of all joints comes first; then effects are chosen one by one, and those that have become
superfluous are dropped. A search begins with the effects that are asked for here. Where no law holds exactly, the
numbers are priors of what is fitted to predictions.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.diagnosis.candidates.force_columns import ForceColumns, force_columns
from wipx.diagnosis.candidates.force_laws import ForceLaw, force_laws
from wipx.diagnosis.likelihood.hypothesis import ByForces
from wipx.effects.catalogue import kind_of, vocabulary
from wipx.identify.motion import independent_rows

ALIKE = 1e-9  # relative, of the normal equations of columns that are nearly alike
STARTS = 2  # from which a law is fitted
LIGHTEST = 1e-3  # of the inertia that a joint feels
WORTH = 0.05  # an effect must take a tenth of what is left at some joint [nats a row]
TRIALS = 40  # evaluations of a fit at most


@dataclass(frozen=True)
class Fitted:
    """Laws that are fitted to the forces of all joints.

    Attributes:
        numbers: What is fitted of each law, by effect.
        sizes: Of all columns, shape (C,).
        likelihood: Log-likelihood of the forces that are left, and of the numbers beforehand, up to a constant [nats].
        penalty: For its numbers (Schwarz 1978) [nats].
    """

    numbers: Mapping[str, np.ndarray]
    sizes: np.ndarray
    likelihood: float
    penalty: float

    @property
    def score(self) -> float:
        """Penalised log-likelihood [nats]."""
        return self.likelihood - self.penalty


class Regression:
    """Least squares on the forces of all joints at once. What a fit leaves of a joint's force counts as its noise."""

    def __init__(self, columns: ForceColumns, laws: Mapping[str, ForceLaw]) -> None:
        self.laws, self._columns = laws, columns
        joints = range(columns.lacking.shape[1])
        both = (np.column_stack([columns.lacking[:, j], columns.of_joint(j)]) for j in joints)
        self._grams = np.stack([each.T @ each / len(each) for each in both])
        felt = np.diagonal(self._grams, axis1=1, axis2=2)[:, 1:] > 0.0  # by which joints, (joints, C)
        self._felt = {effect: felt[:, law.columns].any(axis=1) for effect, law in laws.items()}
        self._noise_of(np.zeros(columns.count))

    def beside(self, fit: Fitted) -> Fitted:
        """Let what a fit leaves count as noise, and judge the fit by that."""
        self._noise_of(fit.sizes)
        return self._judged(fit.numbers, fit.sizes)

    def fit(self, start: Mapping[str, np.ndarray]) -> Fitted:
        """The likeliest numbers of some effects within their bounds, from a start on."""
        if not start:
            return self._judged({}, np.zeros(self._columns.count))
        laws = [self.laws[effect] for effect in start]
        low = np.concatenate([law.low for law in laws])
        high = np.concatenate([np.full(law.count, np.inf) if law.high is None else law.high for law in laws])
        sure = 1.0 / np.concatenate([law.usual for law in laws])
        ends = np.cumsum([law.count for law in laws])[:-1]

        def errors(fitted: np.ndarray) -> np.ndarray:
            left = self._root[:, 0].copy()
            for law, own in zip(laws, np.split(fitted, ends), strict=True):
                left += self._root[:, 1 + law.columns] @ law.sizes(own)
            return np.concatenate([left, sure * fitted])

        def slopes(fitted: np.ndarray) -> np.ndarray:
            parts = zip(laws, np.split(fitted, ends), strict=True)
            of_left = [self._root[:, 1 + law.columns] @ law.slopes(own) for law, own in parts]
            return np.concatenate([np.concatenate(of_left, axis=1), np.diag(sure)])

        begin = np.clip(np.concatenate(list(start.values())), low + 1e-12, high - 1e-12)
        best = least_squares(errors, begin, slopes, (low, high), x_scale="jac", max_nfev=TRIALS).x  # pyright: ignore
        numbers = dict(zip(start, np.split(best, ends), strict=True))
        return self._judged(numbers, self._sizes(numbers))

    def at_most(self, effects: Sequence[str]) -> tuple[np.ndarray, float]:
        """Sizes of the columns of some effects, whatever their laws, and the score of a fit that would reach them."""
        taken = np.unique(np.concatenate([self.laws[effect].columns for effect in effects]))
        own = self._root[:, 1 + taken]
        norm = np.linalg.norm(own, axis=0)
        scale = np.where(norm > 0.0, norm, np.inf)
        held = np.concatenate([own / scale, np.sqrt(ALIKE) * np.eye(len(taken))])
        sizes = np.zeros(self._columns.count)
        sizes[taken] = np.linalg.lstsq(held, np.concatenate([-self._root[:, 0], np.zeros(len(taken))]))[0] / scale
        return sizes, self._likelihood(sizes) - self._penalty(effects)

    def starts_with(self, fit: Fitted, effect: str) -> list[dict[str, np.ndarray]]:
        """Where a fit with one effect more may start, the best first; without what it contains or is contained in."""
        kept = self._beside(fit, effect)
        law = self.laws[effect]
        sizes, _ = self.at_most([*kept, effect])
        starts = [{**kept, effect: start} for start in law.starts(sizes[law.columns])]
        return sorted(starts, key=lambda start: -self._likelihood(self._sizes(start)))

    def is_felt_by_several(self, effect: str) -> bool:
        """Whether several joints feel an effect."""
        return int(self._felt[effect].sum()) > 1

    def most_with(self, fit: Fitted, effect: str) -> float:
        """Score that a fit with one effect more reaches at most."""
        return self.at_most([*self._beside(fit, effect), effect])[1]

    def deviation(self, fit: Fitted, effect: str) -> float:
        """Standard deviation of the first number of an effect that the fit has; infinite where no row shows it."""
        laws = [self.laws[name] for name in fit.numbers]
        parts = zip(laws, fit.numbers.values(), strict=True)
        slopes = np.concatenate([self._root[:, 1 + law.columns] @ law.slopes(own) for law, own in parts], axis=1)
        first = sum(self.laws[name].count for name in list(fit.numbers)[: list(fit.numbers).index(effect)])
        size = np.linalg.norm(slopes, axis=0)
        if size[first] == 0.0:
            return np.inf
        scaled = slopes / np.where(size > 0.0, size, 1.0)
        inverse = np.linalg.inv(scaled.T @ scaled + ALIKE * np.eye(len(size)))
        return float(np.sqrt(inverse[first, first]) / size[first])

    def _beside(self, fit: Fitted, effect: str) -> dict[str, np.ndarray]:
        apart = (effect, self.laws[effect].contains)
        return {n: own for n, own in fit.numbers.items() if n not in apart and self.laws[n].contains != effect}

    def _noise_of(self, sizes: np.ndarray) -> None:
        left = self._columns.left(sizes)
        self._rows = np.array([max(independent_rows(each[:, None]), 2.0) for each in left.T])
        powers = self._powers(sizes)
        weights = np.where(powers > 0.0, self._rows / np.maximum(powers, 1e-300), 0.0)
        normal = np.tensordot(weights, self._grams, 1)
        scale = np.sqrt(np.diag(normal))
        shown = np.where(scale > 0.0, scale, np.inf)
        values, vectors = np.linalg.eigh(normal / np.outer(shown, shown))
        self._root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T * scale  # (C + 1, C + 1)

    def _judged(self, numbers: Mapping[str, np.ndarray], sizes: np.ndarray) -> Fitted:
        surprise = sum(0.5 * float(np.sum((own / self.laws[name].usual) ** 2)) for name, own in numbers.items())
        return Fitted(numbers, sizes, self._likelihood(sizes) - surprise, self._penalty(numbers))

    def _likelihood(self, sizes: np.ndarray) -> float:
        """Of accelerations, for whose noise a force counts by the inertia that it moves."""
        inertia = np.maximum(1.0 + self._columns.inertia @ sizes, LIGHTEST)
        return -0.5 * float(self._rows @ np.log(np.maximum(self._powers(sizes), 1e-300) / inertia**2))

    def _penalty(self, effects: Iterable[str]) -> float:
        rows = {effect: float(self._rows[self._felt[effect]].sum()) for effect in effects}  # that can tell of it
        worth = {effect: WORTH * float(self._rows[self._felt[effect]].max()) for effect in effects}
        return sum(0.5 * self.laws[e].count * float(np.log(rows[e])) + worth[e] for e in rows)

    def _sizes(self, numbers: Mapping[str, np.ndarray]) -> np.ndarray:
        sizes = np.zeros(self._columns.count)
        for effect, own in numbers.items():
            sizes[self.laws[effect].columns] += self.laws[effect].sizes(own)
        return sizes

    def _powers(self, sizes: np.ndarray) -> np.ndarray:
        """Mean square of the force that is left at each joint, shape (joints,)."""
        whole = np.concatenate([[1.0], sizes])
        used = np.flatnonzero(whole)
        return np.einsum("jab,a,b->j", self._grams[:, used][:, :, used], whole[used], whole[used])


def numbers_by_forces(model: Model, recordings: Sequence[Recording]) -> dict[str, ByForces]:
    """Numbers of effects of joints, drives, links and base, by "site/kind.symbol", as recorded forces have them.

    Of effects of one joint that are not asked for, the number that they would have beside the others. Effects that no
    row would show are left out.

    Args:
        model: A robot from a model file, as its owner believes it to be.
        recordings: Of it.
    """
    columns, ranges = force_columns(model, tuple(recordings))
    known = vocabulary(model.plant).keys() - model.effects.keys()
    shown = np.flatnonzero(columns.sizes)
    laws = {n: law for n, law in force_laws(model, ranges).items() if n in known and np.isin(law.columns, shown).any()}
    regression = Regression(columns, laws)
    chosen = _selected(regression)
    found: dict[str, ByForces] = {}
    for name, law in laws.items():
        asked = name in chosen.numbers
        if not asked and not law.measured:
            continue
        fit = chosen if asked else regression.fit(regression.starts_with(chosen, name)[0])
        for symbol, value in law.numbers(fit.numbers[name]).items():
            if symbol == law.measured:
                gain = _gain_beside(regression, fit, name)
                found[f"{name}.{symbol}"] = ByForces(gain * value, gain * regression.deviation(fit, name), asked=asked)
            else:
                found[f"{name}.{symbol}"] = ByForces(value, np.inf, asked=asked)
    return found


def _gain_beside(regression: Regression, fit: Fitted, effect: str) -> float:
    """Gain of the drive of the joint at which an effect acts: a regression has forces as the drive is commanded."""
    drive = f"actuator_{effect.partition('/')[0]}/gain"
    return regression.laws[drive].numbers(fit.numbers[drive])["k"] if drive in fit.numbers else 1.0


def _selected(regression: Regression) -> Fitted:
    """The effects that are chosen one by one, as long as each is worth its penalty beside what is then noise."""
    chosen, seen = _pruned(regression, _begun(regression)), set[frozenset[str]]()
    while frozenset(chosen.numbers) not in seen:
        seen.add(frozenset(chosen.numbers))
        chosen = regression.beside(chosen)
        larger = _with_one_more(regression, chosen)
        chosen = _pruned(regression, larger) if larger is not chosen else _exchanged(regression, chosen)
    return chosen


def _begun(regression: Regression) -> Fitted:
    """The laws that the joints of nearly every machine follow.

    If friction counted as noise, the fit would prefer joints that are too heavy for it to matter.
    """
    usual = [name for name in regression.laws if kind_of(name).usual]
    sizes, _ = regression.at_most(usual) if usual else (np.zeros(0), 0.0)
    starts = {name: regression.laws[name].starts(sizes[regression.laws[name].columns])[0] for name in usual}
    return regression.beside(regression.fit(starts))


def _with_one_more(regression: Regression, chosen: Fitted) -> Fitted:
    """The best fit with one effect more, or a simpler law in the place of one; the same where none is worth it."""
    more = [name for name in regression.laws if name not in chosen.numbers]
    most = {name: regression.most_with(chosen, name) for name in more}
    best = chosen
    for name in sorted(more, key=lambda name: -most[name]):
        if most[name] <= best.score:
            break
        trials = [regression.fit(start) for start in regression.starts_with(chosen, name)[:STARTS]]
        best = max((best, *trials), key=lambda fit: fit.score)
    return best


def _exchanged(regression: Regression, chosen: Fitted) -> Fitted:
    """The best fit in which one effect that several joints feel takes the place of others; the same without any."""
    best = chosen
    for name in regression.laws:
        if name not in chosen.numbers and regression.is_felt_by_several(name):
            larger = [regression.fit(start) for start in regression.starts_with(chosen, name)[:1]]
            best = max((best, *(_pruned(regression, fit) for fit in larger)), key=lambda fit: fit.score)
    return best


def _pruned(regression: Regression, chosen: Fitted) -> Fitted:
    """Without the effects that others make superfluous, the least worthy one first."""
    fewer = [{name: own for name, own in chosen.numbers.items() if name != gone} for gone in chosen.numbers]
    hopeful = [start for start in fewer if not start or regression.at_most([*start])[1] >= chosen.score]
    best = max(map(regression.fit, hopeful), key=lambda fit: fit.score, default=chosen)
    return _pruned(regression, best) if best.score >= chosen.score and best is not chosen else chosen
