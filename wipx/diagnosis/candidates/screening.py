"""Screening: what every effect of the vocabulary would explain, estimated with one simulation each.

A score test (Rao 1948): the change that a small dose of an effect makes in the white innovations,
freed of what the numbers already in the model can imitate, is compared with the innovations themselves.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import product

import numpy as np

from wipx.core.effect import Effect
from wipx.core.model import ModelBatch
from wipx.core.parameters import Scales
from wipx.diagnosis.candidates.left_over import LeftOver, LeftOverByRow
from wipx.diagnosis.candidates.limit_scan import saturations, speed_limits
from wipx.diagnosis.candidates.loose_drive_scan import plays, springs
from wipx.diagnosis.candidates.point_mass_scan import point_masses
from wipx.diagnosis.candidates.position_scan import ripples, sticky_spots
from wipx.diagnosis.likelihood.fitting import Fit, Fitter, damped_step
from wipx.diagnosis.likelihood.hypothesis import Setting
from wipx.effects.catalogue import vocabulary

FURTHEST = 5.0  # times a dose, beyond which its effect is not taken for proportional
FAINTEST = 1e-12  # squared change of the innovations below which a dose does nothing but round
PARTWAY = (1.0, 0.3)  # shares of the way to where an effect fits best if all is proportional; it hardly ever is
CHUNK = 24  # models simulated at once; bounds the memory

Scan = Callable[[LeftOverByRow, str], np.ndarray]

SCANS: dict[str, Scan] = {
    "periods": ripples,
    "stretches": sticky_spots,
    "force_limits": saturations,
    "speed_limits": speed_limits,
    "gaps": plays,
    "springs": springs,
    "point_masses": point_masses,
}  # first guesses that take more than a grid, by `Effect.scan`
ON_QUIET_JOINTS: dict[Scan | None, Scan | None] = {  # of effects whose lack a joint shows plainly: none, or rare ones
    plays: None,
    springs: None,
    saturations: partial(saturations, rare=True),
    speed_limits: partial(speed_limits, rare=True),
}


@dataclass(frozen=True)
class Candidate:
    """An effect that may be missing.

    Attributes:
        effect: Its name.
        gain: What adding it is expected to gain, in nats.
        values: Its numbers where a fit should start, by "site/kind.symbol" [SI].
        moved: All numbers, the others moved to suit the effect; and a part of the way there [SI].
        estimate: Its first number, were the effect proportional to it [SI].
        deviation: Standard deviation of that; infinite where the effect has a threshold.
    """

    effect: str
    gain: float
    values: Mapping[str, float]
    moved: tuple[Mapping[str, float], ...]
    estimate: float
    deviation: float


def candidates_beside(
    fitter: Fitter, setting: Setting, fit: Fit, *, outside_vocabulary: bool = False
) -> list[Candidate]:
    """Where to start for every effect that could be added to a fit, best first.

    Args:
        fitter: Fits and simulates.
        setting: The robot.
        fit: What is already explained.
        outside_vocabulary: Whether to look at the effects that contract section 3 lacks instead of those it has.
    """
    names = list(names_beside(fitter, setting, fit, outside_vocabulary=outside_vocabulary))
    candidates = Screening(fitter, setting, fit).candidates
    # Parts of a robot of many joints are side by side already.
    small = setting.nominal.plant.tree is None
    found = fitter.simulator.side_by_side(candidates, names) if small else map(candidates, names)
    return sorted((each for own in found for each in own), key=lambda candidate: -candidate.gain)


def names_beside(fitter: Fitter, setting: Setting, fit: Fit, *, outside_vocabulary: bool = False) -> Iterator[str]:
    """The effects that could be added to a fit, see `candidates_beside`."""
    known = vocabulary(setting.nominal.plant)
    present = set(fit.hypothesis.model.effects)
    for name, effect in known.items():
        wanted = fitter.looks_for(name, effect) != outside_vocabulary and not effect.tolerance
        if wanted and setting.looks_at(name) and not _excluded(name, effect, present, known):
            yield name


def _excluded(name: str, effect: Effect, present: set[str], known: Mapping[str, Effect]) -> bool:
    site = name.partition("/")[0]
    others = {f"{site}/{kind}" for kind in effect.excludes}
    excluding = {
        p for p in present if f"{p.partition('/')[0]}/{effect.kind}" == name and effect.kind in known[p].excludes
    }
    return name in present or bool(others & present) or bool(excluding)


def perturbations(effect: Effect, scales: Scales) -> np.ndarray:
    """Values of an effect's parameters at which it is looked for, shape (atoms, parameters) [SI]."""
    axes = [[g * scales.of(p.dimension) for g in (p.grid or (p.start,))] for p in effect.parameters]
    return np.array(list(product(*axes)))


def unscaled(setting: Setting, name: str) -> list[dict[str, float]]:
    """The doses of an effect as they are, where screening scales all of its numbers; none where it scales not all.

    What an effect does is not always proportional to it: a late sensor also asks for another observer.
    """
    effect = vocabulary(setting.nominal.plant)[name]
    if len(effect.linear_in) < len(effect.parameters):
        return []
    names = [f"{name}.{p.name}" for p in effect.parameters]
    atoms = perturbations(effect, setting.scales[_site(name)]).tolist()
    return [dict(zip(names, atom, strict=True)) for atom in atoms]


def candidates_of_effect(fitter: Fitter, setting: Setting, fit: Fit, name: str) -> list[Candidate]:
    """Where to start for one effect that could be added to a fit."""
    return Screening(fitter, setting, fit).candidates(name)


@dataclass(frozen=True)
class Screening:
    """What effects are compared with.

    Attributes:
        fitter: Fits and simulates.
        setting: The robot.
        fit: What is already explained.
    """

    fitter: Fitter
    setting: Setting
    fit: Fit

    @cached_property
    def left_over(self) -> LeftOver:
        """White errors that the fit leaves over."""
        return LeftOver(self.fitter, self.fit)

    @cached_property
    def by_row(self) -> LeftOverByRow:
        """White innovations that the fit leaves over."""
        return LeftOverByRow(*self.fitter.sketched_by_row(self.fit))

    def candidates(self, name: str) -> list[Candidate]:
        """Where to start for one effect."""
        effect = vocabulary(self.setting.nominal.plant)[name]
        if effect.superposes:
            return [self._regressed(name)]
        return self._compared(name, self._atoms(name))

    def _atoms(self, name: str) -> np.ndarray:
        """Values of an effect's numbers at which it is looked for, shape (A, parameters) [SI]."""
        effect = vocabulary(self.setting.nominal.plant)[name]
        scan = SCANS[effect.scan] if effect.scan else None
        if scan in ON_QUIET_JOINTS and self.setting.nominal.plant.tree is not None and self._is_quiet(name):
            scan = ON_QUIET_JOINTS[scan]
            if scan is None:
                return np.zeros((0, len(effect.parameters)))
        return perturbations(effect, self.setting.scales[_site(name)]) if scan is None else scan(self.by_row, name)

    def _is_quiet(self, name: str) -> bool:
        """Whether the laws of a fit leave the joint of an effect neither a force to speak of nor coloured errors."""
        plant = self.setting.nominal.plant
        j = plant.joints.index(plant.joint_at(_site(name)))
        seen, trust = self.by_row, self.fitter.rules.trust
        asks = seen.fitter.asks_for_force(seen.fit.levels.force, self.setting.scales)
        return bool(seen.foretold[j] <= trust.foretold and not asks[j])

    def _compared(self, name: str, atoms: np.ndarray) -> list[Candidate]:
        """What each of some values, shape (A, parameters) [SI], would gain."""
        effect = vocabulary(self.setting.nominal.plant)[name]
        names = tuple(f"{name}.{p.name}" for p in effect.parameters)
        model = self.fit.hypothesis.model.with_effects({name: effect.neutral})
        grown = np.array([p.name in effect.linear_in for p in effect.parameters])
        neutral = np.array([p.neutral for p in effect.parameters])
        low, high = _bounds(self.setting, name, effect)
        found = []
        for begin in range(0, len(atoms), CHUNK):
            part = atoms[begin : begin + CHUNK]
            change = self.left_over.changes(ModelBatch(model, names, part))
            beside = _make_room(self.fit, change)
            change = self.left_over.freed(change)
            slope, size = change @ self.left_over.errors, np.sum(change**2, axis=1)
            for i, atom in enumerate(part):
                best = float(np.clip(-slope[i] / max(size[i], 1e-12), -FURTHEST, FURTHEST))
                dose = best if grown.any() and effect.non_smooth is None else 1.0  # what a gap does is not proportional
                values = np.where(grown, neutral + dose * (atom - neutral), atom)
                if size[i] < FAINTEST or np.any(values < low) or np.any(values > high):
                    continue
                gain = -dose * slope[i] - 0.5 * dose**2 * size[i]
                estimate = neutral[0] + best * (atom[0] - neutral[0])
                deviation = abs(atom[0] - neutral[0]) / np.sqrt(size[i]) if grown[0] else np.inf
                start = dict(zip(names, values.tolist(), strict=True))
                shares = PARTWAY if grown.all() and effect.non_smooth is None else (1.0,)
                moved = tuple(_with_room(self.fit, s * dose * beside[i]) | _partway(start, effect, s) for s in shares)
                found.append(Candidate(name, float(gain), start, moved, float(estimate), float(deviation)))
        return found

    def _regressed(self, name: str) -> Candidate:
        """Where to start for an effect whose numbers add up: their regression on what is left.

        Numbers of which the recordings tell nothing stay neutral: none is likely to be more than `FURTHEST` doses.
        """
        effect = vocabulary(self.setting.nominal.plant)[name]
        names = tuple(f"{name}.{p.name}" for p in effect.parameters)
        steps = perturbations(effect, self.setting.scales[_site(name)])[0]
        neutral = np.array([p.neutral for p in effect.parameters])
        model = self.fit.hypothesis.model.with_effects({name: effect.neutral})
        change = self.left_over.changes(ModelBatch(model, names, neutral + np.diag(steps)))
        beside = _make_room(self.fit, change)
        change = self.left_over.freed(change)
        covariance = np.linalg.inv(change @ change.T + np.eye(len(steps)) / FURTHEST**2)
        slope = change @ self.left_over.errors
        amounts = np.clip(-covariance @ slope, -FURTHEST, FURTHEST)
        values = np.clip(neutral + amounts * steps, *_bounds(self.setting, name, effect))
        gain = -amounts @ slope - 0.5 * np.sum((amounts @ change) ** 2)
        start = dict(zip(names, values.tolist(), strict=True))
        moved = (_with_room(self.fit, amounts @ beside) | start,)
        return Candidate(name, float(gain), start, moved, float(values[0]), float(steps[0] * np.sqrt(covariance[0, 0])))


def _bounds(setting: Setting, name: str, effect: Effect) -> tuple[np.ndarray, np.ndarray]:
    scales = setting.scales[_site(name)]
    sizes = np.array([scales.of(p.dimension) for p in effect.parameters])
    return np.array([p.low for p in effect.parameters]) * sizes, np.array([p.high for p in effect.parameters]) * sizes


def _partway(start: Mapping[str, float], effect: Effect, share: float) -> dict[str, float]:
    """Numbers a share of the way from where an effect does nothing."""
    neutral = {name: effect.neutral[name.rpartition(".")[2]] for name in start}
    return {name: neutral[name] + share * (value - neutral[name]) for name, value in start.items()}


def _with_room(fit: Fit, step: np.ndarray) -> dict[str, float]:
    """Numbers of a fit a step (D,) away [SI]."""
    return fit.hypothesis.at(np.clip(fit.hypothesis.cube + step, 0.0, 1.0)).values


def _make_room(fit: Fit, changes: np.ndarray) -> np.ndarray:
    """By how much a fit's numbers move to make up for changes (P, N) of its white errors, shape (P, D)."""
    free = np.flatnonzero(fit.free)
    moved = np.zeros((len(changes), len(fit.hypothesis.cube)))
    if len(free):
        slopes = changes @ fit.jacobian[: fit.white.size, free]
        moved[:, free] = damped_step(fit.information[np.ix_(free, free)], slopes.T).T
    return moved


def _site(effect: str) -> str:
    return effect.partition("/")[0]
