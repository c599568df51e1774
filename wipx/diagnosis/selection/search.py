"""Which effects are missing: forward selection, elimination and exchange by penalised likelihood.

Every step compares hypotheses that are fitted to the end, noise included. The penalty is that of the
Bayesian information criterion (Schwarz 1978); evidence is divided by how much scores vary
more than the noise model has it, and a step must also be worth a share of what is explained already, so
that what a law misses is not filled up with further effects.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from wipx.core.diagnosis import ConsideredEffect
from wipx.diagnosis.candidates.screening import Candidate, candidates_beside, candidates_of_effect, unscaled
from wipx.diagnosis.likelihood import nonsmooth_search
from wipx.diagnosis.likelihood.fitting import LEAST_GAIN, Fit, Fitter
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.sandwich import inflation
from wipx.diagnosis.selection.nested_laws import (
    comes_to_rest,
    effects_in_parts,
    reduced_effects,
    reduced_law,
    reduced_values,
)
from wipx.effects.catalogue import kind_of

MOST_EFFECTS = 8
LEAST_SHARE = 0.01  # of what is explained already
STICKING_SHARE = 0.05  # that bristles gain by how a joint comes to rest, where their bending is invisible
LOOKED_AT = 8  # starts of each effect that are simulated
STARTS = 2  # and those from which it is fitted
CLOSE = 0.5  # of the best gain, from which noise levels are searched too
FITTED_TO_THE_END = 3  # effects for which they are, at most
DOUBTED = 4.0  # times what an effect must gain, below which the fit without it is searched by trial too
PAIRED = 2  # effects that were not worth it alone, for which a second is sought
WORTH_PAIRING = 4.0  # nats that they must gain alone
EXCHANGES = 3  # rounds at most
LEAST_LEAD = 4.0  # nats by which a replacement must be better, and a rich law than the simple one that it contains


def always_transfers(smaller: Fit, larger: Fit) -> bool:
    """A transfer that nobody checks."""
    return True


@dataclass
class Selection:
    """The search for the missing effects of one robot.

    Attributes:
        fitter: Fits hypotheses.
        setting: The robot.
        nominal: The fit of the nominal model.
        transfers: Whether a larger fit predicts recordings that it was not fitted to about as well as a smaller one.
        considered: What was looked at, in order.
    """

    fitter: Fitter
    setting: Setting
    nominal: Fit
    transfers: Callable[[Fit, Fit], bool] = always_transfers
    considered: list[ConsideredEffect] = field(default_factory=list)
    _fits: dict[frozenset[str], Fit] = field(default_factory=dict)
    _extensions: dict[frozenset[str], list[Fit]] = field(default_factory=dict)
    _fleeting: set[frozenset[str]] = field(default_factory=set)  # what does not transfer
    _candidates: dict[int, tuple[Fit, list[Candidate]]] = field(default_factory=dict)

    def run(self) -> Fit:
        """The fit of the effects that are missing; `nominal` where none is."""
        current, seen = self.nominal, set()
        while len(current.effects) < MOST_EFFECTS and frozenset(current.effects) not in seen:
            seen.add(frozenset(current.effects))  # elimination may lead back to where the search has been
            extended = self.extensions(current)
            best = self.preferred(extended, current)
            if best is not None:
                current = self.refitted_from(current, best)
                best = self._worth_it(current, [best, *(found for found in extended if found is not best)])
            if best is None:
                self._remember(current, extended, None)
                best = self._pair(current, extended)
                if best is None:
                    break
                added = [effect for effect in best.effects if effect not in current.effects]
                gain = self.evidence(current, best)
                self.considered.append(ConsideredEffect(" + ".join(added), gain, True, "explain most together"))
                current = self.pruned(self.restarted(best))
                continue
            told = len(self.considered)
            self._remember(current, extended, best)
            pruned = self.pruned(self.restarted(best))
            if len(pruned.effects) == len(current.effects) and self.lead(pruned, current) < LEAST_LEAD:
                del self.considered[told:]
                reason = "hardly better in the place of one that is there"
                self.considered.append(ConsideredEffect(best.effects[-1], self.evidence(current, best), False, reason))
                break
            current = pruned
        return self.exchanged(current)

    def evidence(self, smaller: Fit, larger: Fit) -> float:
        """Log-likelihood that one fit has beyond another [nats].

        Forces that the drives report count at most as much as the motion: what only a report shows may be the way in
        which it is made.
        """
        moved = larger.motion_likelihood - smaller.motion_likelihood
        reported = larger.noise.reported - smaller.noise.reported
        return float(moved + min(reported, max(moved, 0.0)))

    def score(self, fit: Fit, base: Fit) -> float:
        """Penalised evidence beyond a base."""
        own = sum(len(fit.hypothesis.parameters_of(effect)) for effect in fit.effects)
        return self.evidence(base, fit) - 0.5 * own * np.log(fit.rows)

    def gains_enough(self, smaller: Fit, larger: Fit) -> bool:
        """Whether the effects that `larger` has beside those of `smaller` are worth it."""
        return self.evidence(smaller, larger) >= self.required_gain(smaller, larger) and self.fitter.holds(
            smaller, larger
        )

    def required_gain(self, smaller: Fit, larger: Fit) -> float:
        """Evidence that the effects which `larger` has beside those of `smaller` must gain [nats]."""
        added = [effect for effect in larger.effects if effect not in smaller.effects]
        indices = [i for effect in added for i in larger.hypothesis.parameters_of(effect)]
        penalty = 0.5 * len(indices) * np.log(larger.rows)
        explained = max(self.evidence(self.nominal, smaller), 0.0)
        overstated = inflation(larger, indices)
        return float(overstated * (penalty + self.fitter.required_beyond_penalty(smaller, larger, explained)))

    def extensions(self, fit: Fit) -> list[Fit]:
        """Fits with one effect more, the best first."""
        key = frozenset(fit.effects)
        if key not in self._extensions:
            self._extensions[key] = self._extended(fit)
        return self._extensions[key]

    def _worth_it(self, current: Fit, extended: list[Fit]) -> Fit | None:
        """The first fit whose further effect is worth it, or the simple law of a rich one that is not; None without.

        Beyond a few effects it must also transfer to held-out recordings.
        """
        for found in extended:
            worth = found if self.gains_enough(current, found) else self.with_reduced_law(found, found.effects[-1])
            if worth is None or not self.gains_enough(current, worth):
                continue
            if len(worth.effects) <= self.fitter.unproven or self.transfers(current, worth):
                return worth
            self._fleeting.add(frozenset(worth.effects))
        return None

    def with_reduced_law(self, fit: Fit, effect: str) -> Fit | None:
        """The fit with the simple law that an effect contains in its place; None where there is none or no room."""
        rest = tuple(e for e in fit.effects if e != effect)
        simple = reduced_law(effect, rest, fit.hypothesis.model.plant)
        return None if simple is None else self.fitted((*rest, simple), fit)

    def _pair(self, current: Fit, extended: list[Fit]) -> Fit | None:
        """The fit with two effects more of which neither is worth it alone, if the two are."""
        if len(current.effects) + 2 > self.fitter.unproven:
            return None
        for one in extended[:PAIRED]:
            if one.log_likelihood - current.log_likelihood >= WORTH_PAIRING:
                two = self.preferred(self.extensions(one), current)
                if two is not None and self.gains_enough(current, two):
                    return two
        return None

    def candidates_for(self, fit: Fit) -> list[Candidate]:
        """Where to start for every effect that could be added, the best first."""
        if id(fit) not in self._candidates:
            self._candidates[id(fit)] = (fit, candidates_beside(self.fitter, self.setting, fit))
        return self._candidates[id(fit)][1]

    def refitted_from(self, fit: Fit, larger: Fit) -> Fit:
        """A fit, or a better one of the same effects that starts from the noise of a larger fit.

        A search over noise levels that stopped early would credit the next effect with finishing it.
        """
        again = self.fitter.fit(fit.hypothesis, larger.levels)
        if again.log_likelihood < fit.log_likelihood + 1.0:
            return fit
        again = self.fitter.converged(again)
        if not fit.effects:
            self.nominal = again
        self._fits[frozenset(fit.effects)] = again
        return again

    def restarted(self, fit: Fit) -> Fit:
        """A fit, or a better one of the same effects that another search leads to.

        Forces that explain a misfit make it hard to leave: louder ones make the likelihood smoother. Where the
        likelihood of an effect has many peaks, the highest may be another one beside further effects.
        """
        found = [self.fitter.converged(self.fitter.fit(fit.hypothesis, self.fitter.escape_levels(fit)))]
        moved = nonsmooth_search.searched_by_trial(self.fitter, fit)
        if moved is not fit:
            found.append(self.fitter.converged(moved))
        if len(fit.effects) > 1:
            found += [self._restarted_without(fit, effect) for effect in fit.effects if kind_of(effect).scan]
        again = max(found, key=lambda each: each.log_likelihood)
        if again.log_likelihood < fit.log_likelihood + 1.0:
            return fit
        self._fits[frozenset(fit.effects)] = again
        return again

    def _restarted_without(self, fit: Fit, effect: str) -> Fit:
        """A fit of the same effects, for which one of them starts from where the others leave it room."""
        base = self.without(fit, effect)
        starts = sorted(candidates_of_effect(self.fitter, self.setting, base, effect), key=lambda start: -start.gain)
        return self.fitter.converged(self._best_start(base, starts[:LOOKED_AT])) if starts else fit

    def preferred(self, fits: list[Fit], base: Fit) -> Fit | None:
        """The fit with the most evidence beyond a base, or a simpler one that is as good."""
        if not fits:
            return None
        best = max(fits, key=lambda fit: self.score(fit, base))
        replaced = reduced_effects(best, self.fitter.data)
        while replaced is not None:
            found = self.fitted(replaced, best)
            if self.score(found, base) < self.score(best, base) - self._tolerance(best, replaced):
                break
            best = found
            replaced = reduced_effects(best, self.fitter.data)
        for effect in best.effects:
            plain = self.with_reduced_law(best, effect)
            if plain is not None and self.score(best, base) - self.score(plain, base) < self.fitter.richer_by:
                return plain
        parts = effects_in_parts(best, self.fitter.data)
        if parts is not None:
            found = self.restarted(self.fitted(parts, best))
            best = found if self.score(found, base) > self.score(best, base) else best
        return best

    def fitted(self, effects: tuple[str, ...], start: Fit) -> Fit:
        """The fit of some effects, from the values and noise of another fit on."""
        key = frozenset(effects)
        if key not in self._fits:
            values = {**reduced_values(start), **start.hypothesis.values}
            hypothesis = Hypothesis.of(self.setting, effects, values)
            self._fits[key] = self.fitter.converged(self.fitter.fit(hypothesis, start.levels))
        return self._fits[key]

    def pruned(self, fit: Fit) -> Fit:
        """Without the effects that the latest one made superfluous."""
        for effect in fit.effects if len(fit.effects) > 1 else ():
            rest = tuple(e for e in fit.effects if e != effect)
            smaller = self.fitted(rest, fit)
            if self.evidence(smaller, fit) < DOUBTED * self.required_gain(smaller, fit):
                smaller = self._searched_by_trial(smaller)
            if not self.gains_enough(smaller, fit):
                self.considered.append(
                    ConsideredEffect(effect, self.evidence(smaller, fit), False, "superfluous beside the others")
                )
                return self.pruned(smaller) if len(rest) > 1 else smaller
        return fit

    def _searched_by_trial(self, fit: Fit) -> Fit:
        """A fit, or a better one of the same effects that a search by trial leads to."""
        moved = nonsmooth_search.searched_by_trial(self.fitter, fit)
        if moved is not fit:
            moved = self._fits[frozenset(fit.effects)] = self.fitter.converged(moved)
        return moved

    def exchanged(self, fit: Fit) -> Fit:
        """Every effect replaced by a better one, or by itself at better values, as long as there is any."""
        for _ in range(EXCHANGES):
            best, most = fit, LEAST_LEAD
            for effect in fit.effects:
                base = self.without(fit, effect)
                found = self.preferred(self.extensions(base), base)
                if found is not None and self.lead(found, fit) > most and self.gains_enough(base, found):
                    best, most = found, self.lead(found, fit)
            if best is fit:
                best = self._with_fewer(fit)
            if best is fit:
                break
            self._fits[frozenset(best.effects)] = best
            fit = self.pruned(self.restarted(best))
        return fit

    def _with_fewer(self, fit: Fit) -> Fit:
        """A fit in which one effect does the work of two that is hardly worse; the fit itself where there is none."""
        for effect in fit.effects if len(fit.effects) > 1 else ():
            for found in self.replacements(fit, effect):
                if set(found.effects) == set(fit.effects) or self._lead(fit, found) > LEAST_LEAD:
                    continue
                told = len(self.considered)
                fewer = self.pruned(found)
                if len(fewer.effects) < len(fit.effects) and self._lead(fit, fewer) < LEAST_GAIN:
                    return fewer
                del self.considered[told:]  # nothing of the answer is superfluous
        return fit

    def replacements(self, fit: Fit, effect: str) -> list[Fit]:
        """Fits with another effect in the place of one, the best first."""
        return self.extensions(self.without(fit, effect))

    def without(self, fit: Fit, effect: str) -> Fit:
        """The fit of the other effects."""
        rest = tuple(e for e in fit.effects if e != effect)
        return self.fitted(rest, fit) if rest else self.nominal

    def _lead(self, fit: Fit, other: Fit) -> float:
        return self.score(fit, self.nominal) - self.score(other, self.nominal)

    def lead(self, fit: Fit, other: Fit) -> float:
        """By how much a fit is better than another one, as the evidence judges it [nats]."""
        return self.fitter.lead(fit, other, self._lead(fit, other))

    def _tolerance(self, best: Fit, simple: tuple[str, ...]) -> float:
        """By how much a fit may be better than one in which a simple law has a rich one's place [nats]."""
        rests = any(comes_to_rest(effect) for effect in best.effects if effect not in simple)
        return max(4.0, (STICKING_SHARE if rests else LEAST_SHARE) * self.evidence(self.nominal, best))

    def _extended(self, fit: Fit) -> list[Fit]:
        ranked = self.candidates_for(fit)
        by_effect: dict[str, list[Candidate]] = {}
        for candidate in ranked:
            by_effect.setdefault(candidate.effect, []).append(candidate)
        best = max((ranked[0].gain if ranked else 0.0), 0.0)
        least = max(self.fitter.promising * best, self.fitter.worthless)
        leading = [name for name in by_effect if by_effect[name][0].gain >= least][: self.fitter.considered]
        leading += [name for name in by_effect if nonsmooth_search.hides(fit, name) and name not in leading]
        fits = [self._best_start(fit, by_effect[name][:LOOKED_AT]) for name in leading]
        fits.sort(key=lambda f: -self.score(f, fit))
        gains = [self.evidence(fit, f) for f in fits]
        polished = []
        for i, (found, gain) in enumerate(zip(fits, gains, strict=True)):
            close = gain >= CLOSE * max(gains) and i < FITTED_TO_THE_END
            polished.append(self.fitter.converged(found) if close else found)
            if close:
                self._fits.setdefault(frozenset(found.effects), polished[-1])
        return sorted(polished, key=lambda f: -self.score(f, fit))

    def _best_start(self, fit: Fit, starts: list[Candidate]) -> Fit:
        effects = (*fit.effects, starts[0].effect)
        own = [start.values for start in starts] + unscaled(self.setting, starts[0].effect)
        values = [{**others, **start} for others in nonsmooth_search.beside(fit, starts[0].effect) for start in own]
        begins = [Hypothesis.of(self.setting, effects, each) for each in values]
        levels = self.fitter.spread_for(begins[0].model, fit.levels)
        count = STARTS
        if starts[0].effect == nonsmooth_search.DELAY:
            begins += [
                guess for begin in begins[:: len(own)] for guess in nonsmooth_search.delays(self.fitter, begin, levels)
            ]
            count = nonsmooth_search.PEAKS
        likeliest = self.fitter.likeliest(begins, levels, count)
        fits = [self.fitter.fit(begin, levels, steps=self.fitter.steps) for begin in likeliest]
        if kind_of(starts[0].effect).non_smooth:
            fits = [nonsmooth_search.searched_by_trial(self.fitter, found) for found in fits]
        return max(fits, key=lambda f: f.log_likelihood)

    def _remember(self, current: Fit, extended: list[Fit], chosen: Fit | None) -> None:
        if chosen is not None and all(found.effects != chosen.effects for found in extended):
            extended = [chosen, *extended]
        best = None if chosen is None else _added(current, chosen)
        for found in extended:
            gain = self.evidence(current, found)
            taken = chosen is not None and found.effects == chosen.effects
            fleeting = frozenset(found.effects) in self._fleeting
            reason = "predicts held-out recordings worse" if fleeting else _reason(best, gain, taken=taken)
            self.considered.append(ConsideredEffect(_added(current, found), gain, taken, reason))


def _added(current: Fit, larger: Fit) -> str:
    """The effects that a fit has more than the current one, in words."""
    return " + ".join(effect for effect in larger.effects if effect not in current.effects)


def _reason(best: str | None, gain: float, *, taken: bool) -> str:
    if taken:
        return "explains most"
    if best is None:
        return "gains too little: it may be chance, or what another law leaves"
    return f"explains less than {best}" if gain > 0.0 else "explains nothing"
