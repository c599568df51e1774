"""Screening: what every effect of the vocabulary would explain, estimated with one simulation each.

A score test (Rao 1948): the change that a small dose of an effect makes in the white innovations,
freed of what the numbers already in the model can imitate, is compared with the innovations themselves.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from wipx.core.effect import Effect
from wipx.core.model import ModelBatch
from wipx.core.parameters import Scales
from wipx.diagnosis.candidates.limit_scan import saturations, speed_limits
from wipx.diagnosis.candidates.loose_drive_scan import plays, springs
from wipx.diagnosis.candidates.point_mass_scan import point_masses
from wipx.diagnosis.candidates.position_scan import ripples, sticky_spots
from wipx.diagnosis.likelihood.fitting import Fit, Fitter, damped_step
from wipx.diagnosis.likelihood.hypothesis import Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.effects.catalogue import vocabulary

FURTHEST = 5.0  # times a dose, beyond which its effect is not taken for proportional
FAINTEST = 1e-12  # squared change of the innovations below which a dose does nothing but round
PARTWAY = (1.0, 0.3)  # shares of the way to where an effect fits best if all is proportional; it hardly ever is
CHUNK = 24  # models simulated at once; bounds the memory

Scan = Callable[[InnovationFitter, Fit, np.ndarray, str], np.ndarray]

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

    def candidates(name: str) -> list[Candidate]:
        return candidates_of_effect(fitter, setting, fit, name)

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
    atoms = perturbations(effect, setting.scales[name.partition("/")[0]]).tolist()
    return [dict(zip(names, atom, strict=True)) for atom in atoms]


def candidates_of_effect(fitter: Fitter, setting: Setting, fit: Fit, name: str) -> list[Candidate]:
    """Where to start for one effect that could be added to a fit."""
    effect = vocabulary(setting.nominal.plant)[name]
    names = tuple(f"{name}.{p.name}" for p in effect.parameters)
    model = fit.hypothesis.model.with_effects({name: effect.neutral})
    fit = replace(fit, levels=fitter.spread_for(model, fit.levels))
    base = fit.white.ravel()
    basis = basis_of(fit)
    left = base - basis @ (basis.T @ base)
    if effect.superposes:
        return [_regressed(fitter, setting, fit, name, basis, left)]
    scan = SCANS[effect.scan] if effect.scan else None
    if scan in ON_QUIET_JOINTS and setting.nominal.plant.tree is not None and _is_quiet(fitter, setting, fit, name):
        scan = ON_QUIET_JOINTS[scan]
        if scan is None:
            return []
    atoms = (
        perturbations(effect, setting.scales[name.partition("/")[0]])
        if scan is None
        else _scanned(scan, fitter, fit, name)
    )
    grown = np.array([p.name in effect.linear_in for p in effect.parameters])
    neutral = np.array([p.neutral for p in effect.parameters])
    low, high = _bounds(setting, name, effect)
    found = []
    for begin in range(0, len(atoms), CHUNK):
        part = atoms[begin : begin + CHUNK]
        change = fitter.white_of(fit, ModelBatch(model, names, part)) - base
        beside = _make_room(fit, change)
        change -= (change @ basis) @ basis.T
        slope, size = change @ left, np.sum(change**2, axis=1)
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
            moved = tuple(_with_room(fit, s * dose * beside[i]) | _partway(start, effect, s) for s in shares)
            found.append(Candidate(name, float(gain), start, moved, float(estimate), float(deviation)))
    return found


def _regressed(fitter: Fitter, setting: Setting, fit: Fit, name: str, basis: np.ndarray, left: np.ndarray) -> Candidate:
    """Where to start for an effect whose numbers add up: their regression on what is left, (R m (K + 1),).

    Numbers of which the recordings tell nothing stay neutral: none is likely to be more than `FURTHEST` doses.
    """
    effect = vocabulary(setting.nominal.plant)[name]
    names = tuple(f"{name}.{p.name}" for p in effect.parameters)
    steps = perturbations(effect, setting.scales[name.partition("/")[0]])[0]
    neutral = np.array([p.neutral for p in effect.parameters])
    model = fit.hypothesis.model.with_effects({name: effect.neutral})
    change = fitter.white_of(fit, ModelBatch(model, names, neutral + np.diag(steps))) - fit.white.ravel()
    beside = _make_room(fit, change)
    change -= (change @ basis) @ basis.T
    covariance = np.linalg.inv(change @ change.T + np.eye(len(steps)) / FURTHEST**2)
    slope = change @ left
    amounts = np.clip(-covariance @ slope, -FURTHEST, FURTHEST)
    values = np.clip(neutral + amounts * steps, *_bounds(setting, name, effect))
    gain = -amounts @ slope - 0.5 * np.sum((amounts @ change) ** 2)
    start = dict(zip(names, values.tolist(), strict=True))
    moved = (_with_room(fit, amounts @ beside) | start,)
    return Candidate(name, float(gain), start, moved, float(values[0]), float(steps[0] * np.sqrt(covariance[0, 0])))


def _is_quiet(fitter: Fitter, setting: Setting, fit: Fit, name: str) -> bool:
    """Whether the laws of a fit leave the joint of an effect neither a force to speak of nor coloured errors."""
    plant = setting.nominal.plant
    j = plant.joints.index(plant.joint_at(name.partition("/")[0]))
    by_row, seen = fitter.sketched_by_row(fit)
    white = by_row.foretold(seen)[j] <= fitter.rules.trust.foretold
    return bool(white) and not by_row.asks_for_force(seen.levels, setting.scales)[j]


def _scanned(scan: Scan, fitter: Fitter, fit: Fit, name: str) -> np.ndarray:
    """First guesses of an effect from how innovations answer to forces at single rows."""
    by_row, seen = fitter.sketched_by_row(fit)
    return scan(by_row, seen, basis_of(seen), name)


def _bounds(setting: Setting, name: str, effect: Effect) -> tuple[np.ndarray, np.ndarray]:
    scales = setting.scales[name.partition("/")[0]]
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


def basis_of(fit: Fit) -> np.ndarray:
    """What small changes of a fit's free numbers make of its white innovations, orthonormal, shape (R m (K + 1), D)."""
    jacobian = fit.jacobian[: fit.white.size, fit.free]
    if not jacobian.shape[1]:
        return np.zeros((len(jacobian), 0))
    return np.linalg.qr(jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300))[0]
