"""Which effects are missing: forward selection, elimination and exchange by penalised likelihood.

Every step compares hypotheses that are fitted to the end, noise included. A step must also be worth a share of what
is explained already, so that what a law misses is not filled up with further effects. A search returns what it chose
and what it considered; fits are kept in a `FitStore`, and `Criteria` decide between them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from wipx.core.diagnosis import ConsideredEffect
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.held_out import HeldOut
from wipx.diagnosis.rules import SelectionRules
from wipx.diagnosis.selection.criteria import Criteria, evidence, score
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.nested_laws import effects_in_parts, laws_with_constants, reduced_effects
from wipx.effects.catalogue import effect_of, kind_of

DOUBTED = 4.0  # times what an effect must gain, below which the fit without it is searched by trial too
PAIRED = 2  # effects that were not worth it alone, for which a second is sought

History = tuple[ConsideredEffect, ...]


@dataclass(frozen=True)
class Chosen:
    """What a search ends with.

    Attributes:
        fit: Of the effects that it chose.
        considered: What it looked at, in order.
    """

    fit: Fit
    considered: History = ()

    def after(self, history: History) -> "Chosen":
        """The same, with what was considered before."""
        return Chosen(self.fit, history + self.considered)


@dataclass(frozen=True)
class Search:
    """The search for the missing effects of one robot.

    Attributes:
        store: Its fits.
        criteria: Decide between them.
        first: The best fit with one effect; None where there is none.
        held_out: Judges whether many effects transfer to held-out recordings; None if nobody asks.
    """

    store: FitStore
    criteria: Criteria
    first: Fit | None
    held_out: HeldOut | None = None
    exchanges: ClassVar[int] = 3  # rounds at most

    @classmethod
    def of(cls, store: FitStore, nominal: Fit, held_out: HeldOut | None = None) -> Self:
        """A search that begins at the nominal model, whose noise is fitted to the end first."""
        begun = cls(store, Criteria(store.fitter, nominal), None)
        first = begun.preferred(store.extensions(nominal), nominal)
        base = nominal if first is None else store.refitted_from(nominal, first)
        return cls(store, Criteria(store.fitter, base), first, held_out)

    def knowing(self, tolerances: Mapping[str, Mapping[str, float]]) -> Self:
        """The same with laws that every machine follows a little."""
        setting = replace(self.store.setting, tolerances=tolerances)
        return replace(self, store=replace(self.store, setting=setting))

    @property
    def rules(self) -> SelectionRules:
        """What decides."""
        return self.store.fitter.rules.selection

    @property
    def nominal(self) -> Fit:
        """The fit of the nominal model."""
        return self.criteria.nominal

    def run(self, begin: Fit | None = None) -> Chosen:
        """The fit of the effects that are missing; `nominal` where none is.

        Args:
            begin: A fit whose effects are the first ones; None for none.
        """
        grown = self.grown(begin)
        return self.exchanged(grown.fit).after(grown.considered)

    def grown(self, begin: Fit | None = None, steps: int | None = None) -> Chosen:
        """The fit with further effects, each of which was the best beside those before.

        Args:
            begin: A fit whose effects are the first ones; None for none.
            steps: At most; None for as many as are worth it.
        """
        current, best = (begin, None) if begin is not None and begin.effects else (self.nominal, self.first)
        considered: History = ()
        seen, fleeting = set[frozenset[str]](), set[frozenset[str]]()
        while len(current.effects) < self.rules.most_effects and frozenset(current.effects) not in seen:
            if len(seen) == steps:
                break
            seen.add(frozenset(current.effects))  # elimination may lead back to where the search has been
            extended = self.store.extensions(current)
            if current.effects:
                best = self.preferred(extended, current)
                current = current if best is None else self.store.refitted_from(current, best)
            if best is not None:
                choices = [best, *(found for found in extended if found is not best)]
                best = self._worth_it(current, choices, fleeting)
            if best is None:
                considered += _step(current, extended, None, fleeting)
                best = self._pair(current, extended)
                if best is None:
                    break
                gain = evidence(current, best)
                considered += (ConsideredEffect(_added(current, best), gain, True, "explain most together"),)
                pruned = self.pruned(self.store.restarted(best, best.effects[-1])).after(considered)
                current, considered = pruned.fit, pruned.considered
                continue
            pruned = self.pruned(self.store.restarted(best, best.effects[-1]))
            if (
                len(pruned.fit.effects) == len(current.effects)
                and self.criteria.lead(pruned.fit, current) < self.rules.least_lead
            ):
                reason = "hardly better in the place of one that is there"
                considered += (ConsideredEffect(best.effects[-1], evidence(current, best), False, reason),)
                break
            considered += _step(current, extended, best, fleeting) + pruned.considered
            current = pruned.fit
        return Chosen(current, considered)

    def split(self, fit: Fit, *, with_stand_ins: bool = False) -> "tuple[tuple[Search, Fit], ...]":
        """The searches by which a robot is searched part by part, and the fit as each sees it: itself.

        Args:
            fit: Of the whole robot.
            with_stand_ins: Whether effects of other parts may take the place of those of a part.
        """
        return ((self, fit),)

    def joined(self, fit: Fit, parts: tuple[Fit, ...]) -> Fit:
        """The fit of a robot, with the effects that its parts have now."""
        return parts[0]

    def preferred(self, fits: list[Fit], base: Fit) -> Fit | None:
        """The fit with the most evidence beyond a base, or a simpler one that is as good."""
        if not fits:
            return None
        fitter = self.store.fitter
        best = max(fits, key=lambda fit: score(fit, base))
        replaced = reduced_effects(best, fitter.data)
        while replaced is not None:
            found = self.store.fitted(replaced, best)
            if score(found, base) < score(best, base) - self.criteria.tolerance(best, replaced):
                break
            best = found
            replaced = reduced_effects(best, fitter.data)
        for effect in best.effects:
            plain = self.store.with_reduced_law(best, effect)
            if plain is not None and not self.criteria.tells_apart(best, plain):
                return plain
        parts = effects_in_parts(best, fitter.data)
        if parts is not None:
            found = self.store.restarted(self.store.fitted(parts, best))
            best = found if score(found, base) > score(best, base) else best
        return best

    def simplified(self, fit: Fit) -> Chosen:
        """A fit in which rich laws give way to the simple ones that they contain, where nothing tells them apart.

        What tells them apart while a search goes on may be gone beside the effects that it ends with.
        """
        for effect in named_effects(fit):
            reduced = self.store.with_reduced_law(fit, effect)
            plain = self.store.escaped(reduced) if reduced is not None else fit
            if plain is not fit and not self.criteria.tells_apart(fit, plain):
                reason = "nothing tells it from the simple law that it contains"
                considered = (ConsideredEffect(effect, evidence(plain, fit), False, reason),)
                return self.simplified(plain).after(considered)
        return Chosen(fit)

    def pruned(self, fit: Fit) -> Chosen:
        """Without the effects that the latest one made superfluous."""
        for effect in named_effects(fit) if len(fit.effects) > 1 else ():
            smaller = self.store.without(fit, effect)
            if evidence(smaller, fit) < DOUBTED * self.criteria.required_gain(smaller, fit):
                smaller = self.store.searched_by_trial(smaller)
            if not self.criteria.gains_enough(smaller, fit):
                gain = evidence(smaller, fit)
                considered = (ConsideredEffect(effect, gain, False, "superfluous beside the others"),)
                return self.pruned(smaller).after(considered)
        return Chosen(fit)

    def exchanged(self, fit: Fit) -> Chosen:
        """Every effect replaced by a better one, or by itself at better values, as long as there is any."""
        considered: History = ()
        for _ in range(self.exchanges):
            best, most = fit, self.rules.least_lead
            for base, found in self._each_replaced(fit):
                lead = most if found is None else self.criteria.lead(found, fit)
                if found is not None and lead > most and self.criteria.gains_enough(base, found):
                    best, most = found, lead
            if best is fit:
                fewer = self._with_fewer(fit)
                best, considered = fewer.fit, considered + fewer.considered
            if best is fit:
                break
            pruned = self.pruned(self.store.restarted(self.store.keep(best), best.effects[-1]))
            fit, considered = pruned.fit, considered + pruned.considered
        return Chosen(fit, considered)

    def _each_replaced(self, fit: Fit) -> list[tuple[Fit, Fit | None]]:
        """What `_replaced` tells of each effect, whichever is done first."""
        branches = [replace(self, store=self.store.branch()) for _ in named_effects(fit)]
        pairs = list(zip(branches, named_effects(fit), strict=True))
        found = self.store.side_by_side(lambda pair: pair[0]._replaced(fit, pair[1]), pairs)
        for branch in branches:
            self.store.adopt(branch.store)
        return found

    def _replaced(self, fit: Fit, effect: str) -> tuple[Fit, Fit | None]:
        """The fit without an effect, and the best one with another in its place; None where there is none."""
        base = self.store.without(fit, effect)
        return base, self.preferred(self.store.replacements(fit, effect), base)

    def _worth_it(self, current: Fit, extended: list[Fit], fleeting: set[frozenset[str]]) -> Fit | None:
        """The first fit whose further effect is worth it, or the simple law of a rich one that is not; None without.

        Beyond a few effects it must also transfer to held-out recordings; those that do not join `fleeting`.
        """
        for found in extended:
            enough = self.criteria.gains_enough(current, found)
            worth = found if enough else self.store.with_reduced_law(found, found.effects[-1])
            if worth is None or not self.criteria.gains_enough(current, worth):
                continue
            if self._transfers(current, worth):
                return worth
            fleeting.add(frozenset(worth.effects))
        return None

    def _transfers(self, smaller: Fit, larger: Fit) -> bool:
        """Whether a fit has few effects, or predicts held-out recordings about as well as a smaller one."""
        fitter = self.store.fitter
        if self.held_out is None or len(larger.effects) <= fitter.own_rules.unproven:
            return True
        return self.held_out.transfers(fitter, smaller, larger)

    def is_worth_pairing(self, current: Fit, one: Fit) -> bool:
        """Whether an effect that is not worth it alone gains enough for a second one to be sought beside it."""
        return one.log_likelihood - current.log_likelihood >= self.rules.expected_share * self.rules.least_gain

    def _pair(self, current: Fit, extended: list[Fit]) -> Fit | None:
        """The fit with two effects more of which neither is worth it alone, if the two are."""
        if len(current.effects) + 2 > self.store.fitter.own_rules.unproven:
            return None
        for one in extended[:PAIRED]:
            if self.is_worth_pairing(current, one):
                two = self.preferred(self.store.extensions(one), current)
                if two is not None and self.criteria.gains_enough(current, two):
                    return two
        return None

    def _with_fewer(self, fit: Fit) -> Chosen:
        """A fit in which one effect does the work of two that is hardly worse; the fit itself where there is none."""
        for found in self._in_one_law(fit):
            if self.criteria.score_lead(fit, found) < self.rules.least_lead:
                return Chosen(found)
        for effect in named_effects(fit) if len(fit.effects) > 1 else ():
            for found in self.store.replacements(fit, effect):
                if (
                    set(found.effects) == set(fit.effects)
                    or self.criteria.score_lead(fit, found) > self.rules.least_lead
                ):
                    continue
                fewer = self.pruned(found)
                less = len(fewer.fit.effects) < len(fit.effects)
                if less and self.criteria.score_lead(fit, fewer.fit) < self.rules.least_gain:
                    return fewer
        return Chosen(fit)

    def _in_one_law(self, fit: Fit) -> Iterator[Fit]:
        """Fits in which one law has the place of a law and a constant force, where that law may be named."""
        fitter, plant = self.store.fitter, self.store.setting.nominal.plant
        for effect, law, _ in laws_with_constants(fit):
            for constant in (other for other in fit.effects if kind_of(other).constant_force):
                if fitter.looks_for(law, effect_of(law, plant)):
                    rest = tuple(other for other in fit.effects if other not in (effect, constant))
                    yield self.store.escaped(self.store.fitted((*rest, law), fit))


def is_everywhere(effect: str) -> bool:
    """Whether every machine has a little of an effect "site/kind"."""
    return bool(kind_of(effect).tolerance)


def named_effects(fit: Fit) -> tuple[str, ...]:
    """Effects of a fit without those that every machine has a little of: these stay as they are."""
    return tuple(effect for effect in fit.effects if not is_everywhere(effect))


def _step(current: Fit, extended: list[Fit], chosen: Fit | None, fleeting: set[frozenset[str]]) -> History:
    """What one step of a search considered."""
    if chosen is not None and all(found.effects != chosen.effects for found in extended):
        extended = [chosen, *extended]
    best = None if chosen is None else _added(current, chosen)
    considered = []
    for found in extended:
        gain = evidence(current, found)
        taken = chosen is not None and found.effects == chosen.effects
        reason = _reason(best, gain, taken=taken)
        if frozenset(found.effects) in fleeting:
            reason = "predicts held-out recordings worse"
        considered.append(ConsideredEffect(_added(current, found), gain, taken, reason))
    return tuple(considered)


def _added(current: Fit, larger: Fit) -> str:
    """The effects that a fit has more than the current one, in words."""
    return " + ".join(effect for effect in larger.effects if effect not in current.effects)


def _reason(best: str | None, gain: float, *, taken: bool) -> str:
    if taken:
        return "explains most"
    if best is None:
        return "gains too little: it may be chance, or what another law leaves"
    return f"explains less than {best}" if gain > 0.0 else "explains nothing"
