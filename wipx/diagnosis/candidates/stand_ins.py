"""Which effects may do what an effect of a fit does, told without another fit.

The motion of a slide shows a payload on its link and the inertia of its rotor alike; a tilted base turns gravity as an
offset of the first joint's sensor does. What an effect adds to the white errors is compared with what other effects
would add, both beside all other numbers of the fit (the partial correlation of their responses).
"""

from collections.abc import Sequence

import numpy as np

from wipx.core.model import ModelBatch
from wipx.diagnosis.candidates.point_mass_scan import probes
from wipx.diagnosis.candidates.screening import CHUNK, names_beside, perturbations
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.hypothesis import Setting
from wipx.effects.catalogue import effect_of

CLOSE_SHARE = 0.1  # of what an effect gains, within which a rival is worth a fit to the end
DEPENDENT = 1e-9  # relative size below which a response adds no direction to others


def stand_ins(
    fitter: Fitter, setting: Setting, fit: Fit, parts: Sequence[frozenset[str]]
) -> dict[str, tuple[str, ...]]:
    """Effects at other parts of a robot that may do what an effect of a fit does, by the effect of the fit.

    Args:
        fitter: Fits and simulates.
        setting: The robot.
        fit: Of all its effects.
        parts: Sites of its parts.
    """
    if not fit.effects:
        return {}
    basis, slopes = np.linalg.qr(fit.jacobian)
    found: dict[str, list[str]] = {effect: [] for effect in fit.effects}
    for name in names_beside(fitter, setting, fit):
        steps = _steps(setting, fit, name)
        if not len(steps):
            continue
        part = next(sites for sites in parts if _site(name) in sites)
        change = np.zeros((len(steps), len(basis)))
        change[:, : fit.white.size] = _responses(fitter, fit, name, steps)
        shared = change @ basis
        own = change @ change.T - shared @ shared.T
        for effect in fit.effects:
            if _site(effect) not in part:
                lost, regained = swap(fit, effect, slopes, shared, own)
                if lost - regained < CLOSE_SHARE * lost:
                    found[effect].append(name)
    return {effect: tuple(names) for effect, names in found.items()}


def swap(fit: Fit, effect: str, slopes: np.ndarray, shared: np.ndarray, own: np.ndarray) -> tuple[float, float]:
    """What a fit loses without an effect, and how much of that another effect could regain at most [nats].

    Were white errors linear in all numbers. Of several responses of the other effect, any mixture counts.

    Args:
        fit: With the effect.
        effect: That is taken away.
        slopes: Of white errors by the numbers of the fit, in an orthonormal basis, shape (D, D).
        shared: Responses to the other effect in that basis, shape (A, D).
        own: Inner products of what lies outside of it, shape (A, A).
    """
    numbers, law = fit.hypothesis.parameters_of(effect), effect_of(effect, fit.hypothesis.model.plant)
    names = fit.hypothesis.space.names
    grows = [i for i in numbers if names[i].rpartition(".")[2] in law.linear_in] or numbers
    others = [i for i in range(len(names)) if i not in numbers and fit.free[i]]
    directions, sizes, _ = np.linalg.svd(slopes[:, others], full_matrices=False)
    beside = directions[:, sizes > DEPENDENT * sizes.max(initial=0.0)]
    gone = slopes[:, grows] @ (fit.hypothesis.cube - fit.hypothesis.space.neutral)[grows]
    gone = gone - beside @ (beside.T @ gone)
    shared = shared - (shared @ beside) @ beside.T
    along = shared @ gone
    regained = along @ np.linalg.pinv(shared @ shared.T + own, DEPENDENT, hermitian=True) @ along
    return 0.5 * float(gone @ gone), 0.5 * float(regained)


def _steps(setting: Setting, fit: Fit, name: str) -> np.ndarray:
    """Values at which the response to an effect is taken, shape (A, parameters) [SI]; none where that needs a scan."""
    effect = effect_of(name, setting.nominal.plant)
    if effect.scan == "point_masses":
        return probes(fit.hypothesis.model, name)
    return np.zeros((0, 0)) if effect.scan else perturbations(effect, setting.scales[_site(name)])


def _responses(fitter: Fitter, fit: Fit, name: str, steps: np.ndarray) -> np.ndarray:
    """Change of the white errors at every step, shape (A, N)."""
    effect = effect_of(name, fit.hypothesis.model.plant)
    model = fit.hypothesis.model.with_effects({name: effect.neutral})
    names = tuple(f"{name}.{p.name}" for p in effect.parameters)
    base = fitter.white_of(fit, ModelBatch(model))[0]
    parts = np.split(steps, range(CHUNK, len(steps), CHUNK))
    return np.concatenate([fitter.white_of(fit, ModelBatch(model, names, part)) - base for part in parts])


def _site(effect: str) -> str:
    return effect.partition("/")[0]
