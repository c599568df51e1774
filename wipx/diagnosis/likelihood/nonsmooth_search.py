"""Search by trial where the likelihood is rough.

A drive that meets its flank a step earlier or later makes small kinks in the likelihood, between which slopes over
small steps lead nowhere. Trials at random distances, ever smaller, see what the kinks hide (an evolution strategy with
a given schedule: Beyer, Schwefel 2002, Natural Computing 1). Noisy commands that change with every row make the
likelihood of a delay ripple too, with peaks closer than the rows; fits start from the highest ones.
"""

from collections.abc import Sequence

import numpy as np

from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.effects.catalogue import kind_of

WIDTHS = (0.3, 0.3, 0.2, 0.2, 0.12, 0.12, 0.07, 0.04, 0.02)  # of a number's size, in turn
ALONG = 2.0  # times that, along the ridge
LONGEST = 0.04  # [s] of a delay that is guessed closely; longer ones must show from afar
FASTEST = 1e-3  # [s] between rows; in faster logs the guesses are no closer
PER_ROW = 8  # guesses over one row
TOGETHER = 24  # guesses that are simulated at once; bounds the memory
PEAKS = 4  # from which a fit starts
LEAST = 0.02  # of the search interval, that a number counts at least
TRIALS = 40  # at each width
FACTORS = np.geomspace(1.0 / 8.0, 8.0, 10)  # along the ridge, that are looked at for as good a fit


def leaves_open(fit: Fit, added: Sequence[str]) -> bool:
    """Whether what the laws of a fit follow roughly only may look like further effects.

    It looks like others at the same site, but for those whose place these laws can take themselves.
    """
    for name in fit.effects:
        if kind_of(name).non_smooth:
            beside = [effect for effect in added if effect.partition("/")[0] == name.partition("/")[0]]
            if not set(beside) <= set(_imitating(name).values()):
                return True
    return False


def beside(fit: Fit, effect: str) -> list[dict[str, float]]:
    """Values of a fit beside which a further effect is tried: its own, and those that do without what hides it."""
    values = fit.hypothesis.values
    late = _hiding(fit, effect)
    return [values, {**values, **dict.fromkeys(late, 0.0)}] if late else [values]


def hides(fit: Fit, effect: str) -> bool:
    """Whether slopes do not show what an effect would explain, since a rough one has its place."""
    return bool(_hiding(fit, effect))


def is_drive_delay(effect: str) -> bool:
    """Whether an effect is the delay of one or all drives."""
    site, _, kind = effect.partition("/")
    return kind == "delay" and site.startswith("actuator")


def delays(fitter: Fitter, begin: Hypothesis, effect: str, levels: NoiseLevels) -> list[Hypothesis]:
    """A hypothesis with the delays of a drive at which its likelihood has the highest peaks."""
    intervals = fitter.data.intervals
    row = max(float(np.median(intervals[intervals > 0.0])), FASTEST)
    guesses = np.arange(row, max(PER_ROW * LONGEST, 2.0 * row), row) / PER_ROW
    values = np.repeat(begin.space.to_values(begin.cube[None]), len(guesses), axis=0)
    values[:, begin.parameters_of(effect)[0]] = guesses
    tried = [begin.at(cube) for cube in begin.space.to_cube(values)]
    parts = [tried[i : i + TOGETHER] for i in range(0, len(tried), TOGETHER)]
    found = np.concatenate([fitter.likelihoods_of(part, levels) for part in parts])
    padded = np.concatenate([[-np.inf], found, [-np.inf]])
    peak = (found > padded[:-2]) & (found >= padded[2:])
    highest = sorted(np.flatnonzero(peak), key=lambda i: -found[i])[:PEAKS]
    return [tried[i] for i in highest]


def is_non_smooth(fit: Fit) -> bool:
    """Whether a fit has an effect that makes the likelihood rough."""
    return any(kind_of(effect).non_smooth for effect in fit.effects)


def searched_by_trial(fitter: Fitter, fit: Fit) -> Fit:
    """A fit, or a better one at the same noise with other numbers of its rough effects, where it has any."""
    if not is_non_smooth(fit):
        return fit
    space = fit.hypothesis.space
    rough, ridge, powers = _numbers(fit)
    least = np.array([LEAST * (space.free[i].high - space.free[i].low) for i in rough])
    rng = np.random.default_rng(0)
    best, cost = fit.hypothesis.cube, _costs(fitter, fit, fit.hypothesis.cube[None])[0]
    for width in WIDTHS:
        values = np.repeat(space.to_values(best[None]), TRIALS, axis=0)
        size = width * np.maximum(np.abs(values[:, rough]), least)
        values[:, rough] += size * rng.standard_normal(size.shape)
        values[:, ridge] *= np.exp(ALONG * width * rng.standard_normal((TRIALS, 1)) * powers)
        trials = space.to_cube(np.maximum(values, space.to_values(np.zeros(len(best)))))
        costs = _costs(fitter, fit, trials)
        if costs.min() < cost:
            best, cost = trials[int(costs.argmin())], float(costs.min())
    found = fitter.fit(fit.hypothesis.at(best), fit.levels)
    return found if found.log_likelihood > fit.log_likelihood else fit


def alike(fitter: Fitter, fit: Fit, explained: float) -> np.ndarray:
    """Positions in the cube along the ridge that explain the recordings about as well as a fit, itself included.

    Args:
        fitter: Of the fit.
        fit: The fit.
        explained: What it explains [nats].

    Returns:
        Shape (at least 1, D).
    """
    found = [fit.hypothesis.cube]
    if is_non_smooth(fit):
        space = fit.hypothesis.space
        _, ridge, powers = _numbers(fit)
        rules, chance = fitter.rules.selection, fitter.rules.answer.as_good
        least = fit.log_likelihood - float(np.clip(rules.nonsmooth_share * explained, chance, rules.most_asked))
        for factor in FACTORS:
            values = space.to_values(fit.hypothesis.cube)
            values[ridge] *= factor**powers
            there = fitter.fit(fit.hypothesis.at(space.to_cube(values)), fit.levels, steps=3)
            if there.log_likelihood >= least:
                found.append(there.hypothesis.cube)
    return np.array(found)


def _numbers(fit: Fit) -> tuple[list[int], list[int], np.ndarray]:
    """Indices of the rough effects' numbers, of those along the ridge, and the powers with which these change there."""
    names = fit.hypothesis.space.names
    laws = {effect: law for effect in fit.effects if (law := kind_of(effect).non_smooth) is not None}
    rough = [i for effect in laws for i in fit.hypothesis.parameters_of(effect)]
    powers = {f"{effect}.{symbol}": power for effect, law in laws.items() for symbol, power in law.ridge.items()}
    ridge = [i for i in rough if names[i] in powers]
    return rough, ridge, np.array([powers[names[i]] for i in ridge])


def _hiding(fit: Fit, effect: str) -> list[str]:
    """Numbers of a fit's rough effects that can take the place of an effect."""
    found = [number for name in fit.effects for number, kind in _imitating(name).items() if kind == effect]
    return [number for number in found if number in fit.hypothesis.values]


def _imitating(name: str) -> dict[str, str]:
    """Effects whose place the numbers of one can take, by number."""
    law = kind_of(name).non_smooth
    site = name.partition("/")[0]
    return {f"{name}.{symbol}": f"{site}/{kind}" for symbol, kind in law.imitates.items()} if law else {}


def _costs(fitter: Fitter, fit: Fit, cubes: np.ndarray) -> np.ndarray:
    """Negative log-likelihoods, up to a constant [nats]."""
    space = fit.hypothesis.space
    priors = np.sum(space.prior_residuals(cubes) ** 2, axis=1)
    return 0.5 * (np.sum(fitter.white_of(fit, space.batch(cubes)) ** 2, axis=1) + priors)
