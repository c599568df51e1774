"""The fits of one robot, by their sets of effects: each is fitted once, and again where a better start is known.

What is preferred is decided elsewhere (`criteria`, `search`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from wipx.diagnosis.candidates.screening import Candidate, candidates_beside, candidates_of_effect, unscaled
from wipx.diagnosis.likelihood import nonsmooth_search
from wipx.diagnosis.likelihood.fitting import Climb, Fit, Fitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.selection import race
from wipx.diagnosis.selection.criteria import evidence, score
from wipx.diagnosis.selection.nested_laws import reduced_law, reduced_values
from wipx.effects.catalogue import kind_of

Item = TypeVar("Item")
Result = TypeVar("Result")

LOOKED_AT = 8  # starts of each effect that are simulated
STARTS = 2  # and those from which it is fitted
WORTH_TRIALS = 0.25  # of the best score, from which a rough effect is searched by trial; all that won so had half
FITTED_TO_THE_END = 3  # effects for which they are, at most
CONSIDERED = 6  # effects that are fitted in each step, at most
CONSIDERED_IN_PART = 4  # and of one of many parts


@dataclass(frozen=True)
class EffectStarts:
    """Where fits with one effect more begin.

    Attributes:
        effect: Its name.
        hypotheses: With it, each at the numbers of a start.
        levels: Held fixed in the fits.
        log_likelihood: Of the likeliest of them.
    """

    effect: str
    hypotheses: list[Hypothesis]
    levels: Any
    log_likelihood: float


@dataclass(frozen=True)
class FitStore:
    """Fits hypotheses and keeps the best fit of every set of effects.

    Attributes:
        fitter: Fits hypotheses.
        setting: The robot.
        nominal: The fit without any effect.
        elsewhere: Effects at other sites that may take the place of an effect, by that effect.
    """

    fitter: Fitter
    setting: Setting
    nominal: Fit
    elsewhere: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    _fits: dict[frozenset[str], Fit] = field(default_factory=dict)
    _extensions: dict[frozenset[str], list[Fit]] = field(default_factory=dict)
    _candidates: dict[int, tuple[Fit, list[Candidate]]] = field(default_factory=dict)

    @classmethod
    def of(cls, fitter: Fitter, setting: Setting, nominal: Fit) -> "FitStore":
        """A store that holds the fit of the nominal model."""
        return cls(fitter, setting, nominal, _fits={frozenset(nominal.effects): nominal})

    @property
    def is_of_part(self) -> bool:
        """Whether effects are looked for at some of the sites only: what is considered there is mostly chance."""
        return self.setting.sites is not None

    def least_expected(self, fit: Fit) -> float:
        """Expected gain below which an effect of one of many parts is not worth a fit [nats]."""
        explained = max(evidence(self.nominal, fit), 0.0)
        required = self.fitter.required_beyond_penalty(fit, fit, explained)
        rules = self.fitter.rules.selection
        return rules.expected_share * (max(rules.least_gain, required) + 0.5 * float(np.log(fit.rows)))

    def is_promising(self, fit: Fit) -> bool:
        """Whether another effect may gain a good part of what it must."""
        least = self.least_expected(self.nominal)
        return any(each.gain > least for each in self.candidates_for(fit))

    def keep(self, fit: Fit) -> Fit:
        """Keep a fit as the best of its effects, and return it."""
        self._fits[frozenset(fit.effects)] = fit
        return fit

    def branch(self) -> "FitStore":
        """A store that knows the same fits; further ones it keeps to itself until they are adopted.

        Where a fit starts depends on what is known. So work that is done side by side must not share what it finds.
        """
        return replace(
            self, _fits=dict(self._fits), _extensions=dict(self._extensions), _candidates=dict(self._candidates)
        )

    def adopt(self, branch: "FitStore") -> None:
        """Take what a branch has found, and the better one of two fits of the same effects."""
        for effects, fit in branch._fits.items():
            known = self._fits.get(effects, fit)
            self._fits[effects] = fit if fit.log_likelihood > known.log_likelihood else known
        for effects, extensions in branch._extensions.items():
            self._extensions.setdefault(effects, extensions)
        for key, candidates in branch._candidates.items():
            self._candidates.setdefault(key, candidates)

    def fitted(self, effects: tuple[str, ...], start: Fit) -> Fit:
        """The fit of some effects; where there is none yet, from the values and noise of another fit on."""
        key = frozenset(effects)
        if key not in self._fits:
            values = {**reduced_values(start), **start.hypothesis.values}
            hypothesis = Hypothesis.of(self.setting, effects, values)
            found = self.fitter.fit(hypothesis, start.levels, near=start)
            self._fits[key] = self.fitter.converged(found, rounds=2 if self.is_of_part else 4)
        return self._fits[key]

    def without(self, fit: Fit, effect: str) -> Fit:
        """The fit of the other effects."""
        return self.fitted(tuple(e for e in fit.effects if e != effect), fit)

    def reduced(self, fit: Fit, *gone: str) -> Fit:
        """The fit without some of its effects; the curve that stands in for the rest is kept."""
        rest = tuple(e for e in fit.effects if e not in gone)
        setting = self.setting.with_curve_of(fit.hypothesis)
        if setting is self.setting:
            return self.fitted(rest, fit)
        hypothesis = Hypothesis.of(setting, rest, fit.hypothesis.values)
        return self.fitter.converged(self.fitter.fit(hypothesis, fit.levels, near=fit), rounds=2)

    def with_reduced_law(self, fit: Fit, effect: str) -> Fit | None:
        """The fit with the simple law that an effect contains in its place; None where there is none or no room."""
        rest = tuple(e for e in fit.effects if e != effect)
        simple = reduced_law(effect, rest, fit.hypothesis.model.plant)
        return None if simple is None else self.fitted((*rest, simple), fit)

    def with_other_law(self, fit: Fit, effect: str, other: str) -> Fit:
        """The fit with another effect in the place of one, from the noise of the first on.

        Without either the noise is too loud for what tells them apart.
        """
        effects = tuple(other if each == effect else each for each in fit.effects)
        hypothesis = Hypothesis.of(self.setting, effects, fit.hypothesis.values)
        found = self.fitter.converged(self.fitter.fit(hypothesis, fit.levels), rounds=2)
        known = self._fits.get(frozenset(effects), found)
        return self.keep(max(found, known, key=lambda each: each.log_likelihood))

    def candidates_for(self, fit: Fit) -> list[Candidate]:
        """Where to start for every effect that could be added, the best first."""
        if id(fit) not in self._candidates:
            self._candidates[id(fit)] = (fit, candidates_beside(self.fitter, self.setting, fit))
        return self._candidates[id(fit)][1]

    def extensions(self, fit: Fit) -> list[Fit]:
        """Fits with one effect more, the best first."""
        key = frozenset(fit.effects)
        if key not in self._extensions:
            self._extensions[key] = self._extended(fit)
        return self._extensions[key]

    def replacements(self, fit: Fit, effect: str) -> list[Fit]:
        """Fits with another effect in the place of one, the best first."""
        base = self.without(fit, effect)
        found = list(self.extensions(base))
        known = {*base.effects, *(other.effects[-1] for other in found)}
        names = {*self.elsewhere.get(effect, ()), *self.fitter.alike.get(effect, ())} - known
        found += filter(None, (self.extended_by(base, name) for name in sorted(names)))
        return sorted(found, key=lambda other: -score(other, base))

    def extended_by(self, base: Fit, name: str) -> Fit | None:
        """A fit with one certain effect more; None where the others leave nothing for it to explain."""
        known = self._fits.get(frozenset((*base.effects, name)))
        found = known or self._started(base, name)
        return self.keep(found) if found else None

    def refitted_from(self, fit: Fit, larger: Fit) -> Fit:
        """A fit, or a better one of the same effects that starts from the noise of a larger fit.

        A search over noise levels that stopped early would credit the next effect with finishing it.
        """
        again = self.fitter.refit(fit, larger.levels)
        if again.log_likelihood < fit.log_likelihood + 1.0:
            return fit
        return self.keep(self.fitter.converged(again))

    def searched_by_trial(self, fit: Fit) -> Fit:
        """A fit, or a better one of the same effects that a search by trial leads to."""
        moved = nonsmooth_search.searched_by_trial(self.fitter, fit)
        return fit if moved is fit else self.keep(self.fitter.converged(moved))

    def restarted(self, fit: Fit, latest: str = "") -> Fit:
        """A fit, or a better one of the same effects that another search leads to.

        Where the likelihood of an effect has many peaks, the highest may be another one beside further effects.

        Args:
            fit: Of all effects.
            latest: Effect that has just been looked for beside all others; empty for none.
        """
        found = self._escaped(fit)
        again = [e for e in fit.effects if kind_of(e).scan and e != latest] if len(fit.effects) > 1 else []
        found += [self._restarted_without(fit, effect) for effect in again]
        return self._best_of(fit, found)

    def escaped(self, fit: Fit) -> Fit:
        """The same from near the fit only, as long as it gets better."""
        better = self._best_of(fit, self._escaped(fit))
        return fit if better is fit else self.escaped(better)

    def side_by_side(self, work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """What some work makes of each item, several at the same time; parts of a robot are side by side already."""
        return [work(item) for item in items] if self.is_of_part else self.fitter.simulator.side_by_side(work, items)

    def _escaped(self, fit: Fit) -> list[Fit]:
        """Fits from near one: forces that explain a misfit make it hard to leave, louder ones smooth the likelihood."""
        found = [self.fitter.converged(self.fitter.refit(fit, self.fitter.escape_levels(fit)))]
        moved = nonsmooth_search.searched_by_trial(self.fitter, fit)
        return found if moved is fit else [*found, self.fitter.converged(moved)]

    def _best_of(self, fit: Fit, found: list[Fit]) -> Fit:
        """The best of some fits, if it is better than one of the same effects."""
        again = max(found, key=lambda each: each.log_likelihood)
        return fit if again.log_likelihood < fit.log_likelihood + 1.0 else self.keep(again)

    def _restarted_without(self, fit: Fit, effect: str) -> Fit:
        """A fit of the same effects, for which one of them starts from where the others leave it room."""
        return self._started(self.without(fit, effect), effect) or fit

    def _started(self, base: Fit, effect: str) -> Fit | None:
        """A fit with one effect more that starts from where the others leave it room; None where they leave none."""
        starts = sorted(candidates_of_effect(self.fitter, self.setting, base, effect), key=lambda start: -start.gain)
        if not starts:
            return None
        return self.fitter.converged(self._raced(base, [self._starts(base, starts[:LOOKED_AT])])[0])

    def _extended(self, fit: Fit) -> list[Fit]:
        ranked = self.candidates_for(fit)
        by_effect: dict[str, list[Candidate]] = {}
        for candidate in ranked:
            by_effect.setdefault(candidate.effect, []).append(candidate)
        best = max((ranked[0].gain if ranked else 0.0), 0.0)
        rules = self.fitter.own_rules
        least = max(rules.promising * best, rules.worthless)
        if self.is_of_part:
            least = max(least, self.least_expected(fit), self.fitter.rules.selection.expected_share * best)
        most = CONSIDERED_IN_PART if self.is_of_part else CONSIDERED
        hidden = [name for name in by_effect if nonsmooth_search.hides(fit, name)]
        names = [name for name in by_effect if by_effect[name][0].gain >= least or name in hidden]
        begun = self.side_by_side(lambda name: self._starts(fit, by_effect[name][:LOOKED_AT]), names)
        begun.sort(key=lambda start: -start.log_likelihood)
        # The start of a rough effect does not tell how far a search by trial leads.
        rough = [start for start in begun[most:] if start.effect in hidden or kind_of(start.effect).non_smooth]
        fits = self._raced(fit, begun[:most] + rough)
        fits.sort(key=lambda f: -score(f, fit))
        least = race.CLOSE * max((evidence(fit, f) for f in fits), default=0.0)
        close = [f for f in fits[:FITTED_TO_THE_END] if evidence(fit, f) >= least]
        rest = [f for f in fits if all(f is not other for other in close)]
        rounds = 1 if self.is_of_part else 4
        ends = self.side_by_side(lambda f: self.fitter.converged(f, rounds=rounds), close)
        for end in ends:
            self._fits.setdefault(frozenset(end.effects), end)
        return sorted([*ends, *rest], key=lambda f: -score(f, fit))

    def _raced(self, fit: Fit, starts: Sequence[EffectStarts]) -> list[Fit]:
        """The best fit with each of some effects more, as far as it is worth following."""
        fits = race.run(self._stepped, fit, self.side_by_side(self._begun, starts), self.fitter.steps)
        least = race.least_score([each for own in fits for each in own], fit, WORTH_TRIALS)

        def searched(each: Fit) -> Fit:
            rough = kind_of(each.effects[-1]).non_smooth is not None and score(each, fit) >= least
            return nonsmooth_search.searched_by_trial(self.fitter, each) if rough else each

        ends = self.side_by_side(lambda own: [searched(each) for each in own], fits)
        return [max(own, key=lambda each: each.log_likelihood) for own in ends]

    def _stepped(self, climbs: Sequence[Climb]) -> list[Climb]:
        """Fits on their way, one step further each."""
        return self.side_by_side(self.fitter.stepped, climbs)

    def _starts(self, fit: Fit, candidates: list[Candidate]) -> EffectStarts:
        """Where fits with one effect more begin: at the likeliest of its candidates.

        One of them, at least, begins where the other numbers have made room for the effect.
        """
        name = candidates[0].effect
        own = [start.values for start in candidates] + unscaled(self.setting, name)
        beside = nonsmooth_search.beside(fit, name)
        alone = self._with(fit, name, [{**others, **start} for others in beside for start in own])
        roomy = self._with(fit, name, [values for start in candidates for values in start.moved])
        count = 1 if self.is_of_part else STARTS
        if nonsmooth_search.is_drive_delay(name):
            first = alone[:: len(own)]
            alone += [late for begin in first for late in nonsmooth_search.delays(self.fitter, begin, name, fit.levels)]
            count = nonsmooth_search.PEAKS
        every = [*roomy, *alone]
        likelihoods = self.fitter.likelihoods_of(every, fit.levels)
        ranked = [every[i] for i in np.argsort(-likelihoods)]
        chosen = ranked[:1] if count == 1 else _first_of(ranked, roomy, 1) + _first_of(ranked, alone, count - 1)
        return EffectStarts(name, chosen, fit.levels, float(likelihoods.max()))

    def _begun(self, starts: EffectStarts) -> list[Climb]:
        return [self.fitter.begun(begin, starts.levels) for begin in starts.hypotheses]

    def _with(self, fit: Fit, effect: str, values: Sequence[Mapping[str, float]]) -> list[Hypothesis]:
        """The effects of a fit and one more, at several values."""
        return [Hypothesis.of(self.setting, (*fit.effects, effect), each) for each in values]


def _first_of(ranked: list[Hypothesis], some: list[Hypothesis], count: int) -> list[Hypothesis]:
    """The first few of some hypotheses in the order of all."""
    return [each for each in ranked if any(each is one for one in some)][:count]
