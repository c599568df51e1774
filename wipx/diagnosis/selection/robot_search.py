"""A robot of many joints searched part by part.

On an arm every joint has friction. Effects of different joints hardly compete: what one joint lacks, the observer takes
for noise of the forces on that joint. So each joint, with its drive and its sensor, is searched by itself, beside what
has been found elsewhere (block coordinate descent; Bertsekas 1999, Nonlinear Programming, sec. 2.7). Links and base,
whose effects act on several joints at once, are one more part. The search begins with the laws that recorded forces ask
for (`torque_regression`). Then each part looks for one further effect. A load and the rotors of motors that carry it
may explain the same motion. So what all parts have found is fitted together, and effects that others make superfluous
are dropped before the next ones are looked for. At the end the parts exchange effects for better ones.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from wipx.core.plant import Plant
from wipx.diagnosis.candidates.stand_ins import stand_ins
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.held_out import HeldOut
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.selection.criteria import Criteria, evidence, score
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.search import DOUBTED, Chosen, ConsideredEffect, History, Search, named_effects
from wipx.effects.catalogue import effect_of, kind_of, vocabulary

LOOSE_DRIVES = ("gaps", "springs")  # scans for drives that move on their own
TRIED = 3  # weakest effects of the whole robot, without which it is fitted


def parts_of(plant: Plant) -> tuple[frozenset[str], ...]:
    """Sites of the parts of a robot: links, base and what all drives share; then each joint, its drive, its sensor."""
    joints = tuple(
        frozenset({joint, f"actuator_{joint}", f"sensor_{column}"}) for joint, column in plant.columns.items()
    )
    return (frozenset(plant.sites).difference(*joints), *joints)


def expected_loss(fit: Fit, effect: str) -> float:
    """What a fit loses without an effect at the same noise, were its likelihood a parabola (Wald 1943) [nats]."""
    own = np.array(fit.hypothesis.parameters_of(effect))
    others = np.setdiff1d(np.arange(len(fit.information)), own)
    shift = (fit.hypothesis.cube - fit.hypothesis.space.neutral)[own]
    across = fit.information[np.ix_(others, own)]
    beside = np.linalg.lstsq(fit.information[np.ix_(others, others)], across)[0]  # how the others would make up for it
    return 0.5 * float(shift @ (fit.information[np.ix_(own, own)] - across.T @ beside) @ shift)


@dataclass(frozen=True)
class Held:
    """What a robot has outside of the part that is searched.

    Attributes:
        effects: All that have been found, those of the part included.
        values: Numbers of these effects, and uncertain ones of the robot [SI].
        levels: What fits hold fixed.
        extra: What the model has beside them: effects of the owner's model, and curves that stand in for what is left.
    """

    effects: tuple[str, ...]
    values: Mapping[str, float]
    levels: Any
    extra: Mapping[str, Mapping[str, float]]

    @classmethod
    def of(cls, fit: Fit) -> "Held":
        """That of a fit."""
        found = fit.hypothesis.model.effects
        return cls(
            fit.effects,
            fit.hypothesis.values,
            fit.levels,
            {name: values for name, values in found.items() if name not in fit.effects},
        )

    def with_part(self, sites: frozenset[str], fit: Fit) -> "Held":
        """The same with what a fit has found at the sites of a part."""
        others = tuple(effect for effect in self.effects if _site(effect) not in sites)
        effects = tuple(dict.fromkeys((*others, *fit.effects)))
        return replace(self, effects=effects, values={**self.values, **fit.hypothesis.values}, levels=fit.levels)


def _site(effect: str) -> str:
    return effect.partition("/")[0]


def _effects_at(fit: Fit, sites: frozenset[str]) -> tuple[str, ...]:
    return tuple(effect for effect in fit.effects if _site(effect) in sites)


def _considered(found: Mapping[frozenset[str], Chosen]) -> History:
    """What the searches of some parts looked at."""
    return tuple(each for chosen in found.values() for each in chosen.considered)


def _has_changed(whole: Fit, sites: frozenset[str], found: Chosen) -> bool:
    """Whether a part has other effects than in the fit of a whole robot."""
    return set(found.fit.effects) != set(_effects_at(whole, sites))


@dataclass(frozen=True)
class PartSearch(Search):
    """The search for the missing effects of one part."""

    exchanges = 1

    def is_worth_pairing(self, current: Fit, one: Fit) -> bool:
        """Whether it gains a good part of what it must: less, in one of many parts, is mostly chance."""
        return evidence(current, one) >= self.rules.expected_share * self.criteria.required_gain(current, one)

    def with_better_links(self, fit: Fit) -> Fit:
        """A fit in which no other law of the mass of a link suits that link better.

        A payload, a shifted centre of mass and a wrong inertia imitate each other while much else is missing.
        """
        plant = self.store.setting.nominal.plant
        of_links = [name for name in fit.effects if plant.class_of(_site(name)) == "link"]
        others = [
            (name, other)
            for name in of_links
            for other in vocabulary(plant)
            if _site(other) == _site(name) and other not in fit.effects
        ]
        found = self.store.side_by_side(lambda pair: self.store.with_other_law(fit, *pair), others)
        best = max(found, key=lambda each: self.criteria.score_lead(each, fit), default=fit)
        if best is fit or self.criteria.lead(best, fit) <= self.rules.least_lead:
            return fit
        return self.with_better_links(best)


@dataclass(frozen=True)
class RobotSearch(Search):
    """The search for the missing effects of a robot, part by part."""

    _known: dict[tuple[int, frozenset[str]], tuple[Fit, FitStore, Fit]] = field(
        default_factory=dict, compare=False, repr=False
    )
    _elsewhere: dict[int, tuple[Fit, Mapping[str, tuple[str, ...]]]] = field(
        default_factory=dict, compare=False, repr=False
    )

    @classmethod
    def of(cls, store: FitStore, nominal: Fit, held_out: HeldOut | None = None) -> "RobotSearch":
        """A search that begins at the nominal model."""
        return cls(store, Criteria(store.fitter, nominal), None, held_out)

    def knowing(self, tolerances: Mapping[str, Mapping[str, float]]) -> "RobotSearch":
        """The same with laws that every machine follows a little."""
        return replace(super().knowing(tolerances), _known={}, _elsewhere={})

    @property
    def plant(self) -> Plant:
        """The robot's."""
        return self.store.setting.nominal.plant

    def run(self, begin: Fit | None = None) -> Chosen:
        """The fit of the effects that are missing; `nominal` where none is."""
        whole = self._finished(self.grown(begin))
        for _ in range(self.store.fitter.exchanges):
            found = self._exchanged_by_parts(whole.fit)
            other = Chosen(self._with_parts(whole.fit, found), _considered(found))
            if other.fit is whole.fit:
                other = Chosen(self._exchanged_across(whole.fit), other.considered)
            fewer = len(other.fit.effects) < len(whole.fit.effects)
            least = -self.rules.least_gain if fewer else 0.0
            if other.fit is whole.fit or self.criteria.lead(other.fit, whole.fit) <= least:
                return Chosen(whole.fit, whole.considered + other.considered)
            whole = self._finished(self.grown(other.fit)).after(whole.considered + other.considered)
        return whole

    def _finished(self, grown: Chosen) -> Chosen:
        """A search's end without what is superfluous; its numbers, found part by part, are looked for once more."""
        pruned = self.pruned(grown.fit).after(grown.considered)
        return Chosen(self.store.escaped(pruned.fit), pruned.considered)

    def grown(self, begin: Fit | None = None, steps: int | None = None) -> Chosen:
        """The fit with further effects, one at a time of each part, as often as `steps` says or as any gains enough.

        A part that finds nothing rests until the others find nothing more.
        """
        whole = Chosen(begin or self.begun())
        every = awake = parts_of(self.plant)
        asked = set[frozenset[str]]()  # beside the effects that there are now
        seen = {frozenset(whole.fit.effects)}
        while awake and len(seen) - 1 != steps:
            found = self._grown_by_parts(whole.fit, awake)
            larger = self.pruned(self.freed(whole.fit, self._with_parts(whole.fit, found)))
            larger = larger.after(whole.considered + _considered(found))
            if frozenset(larger.fit.effects) in seen:
                asked |= set(awake)
                awake = tuple(sites for sites in every if sites not in asked)
                whole = Chosen(whole.fit, larger.considered)
            else:
                asked = set()
                seen.add(frozenset(larger.fit.effects))
                awake = tuple(sites for sites in awake if _has_changed(whole.fit, sites, found[sites]))
                whole = larger
        return whole

    def freed(self, whole: Fit, larger: Fit) -> Fit:
        """A larger fit; only what is new in it where a drive proves to be loose and that explains more than all before.

        What recorded forces ask for takes drives for rigid. Laws that imitate a loose one are hard to get rid of.
        """
        new = tuple(effect for effect in larger.effects if effect not in whole.effects)
        if not whole.effects or not any(kind_of(effect).scan in LOOSE_DRIVES for effect in new):
            return larger
        alone = self._first_fit(new, larger.hypothesis.values)
        return alone if score(alone, self.nominal) > score(whole, self.nominal) else larger

    def _grown_by_parts(self, whole: Fit, parts: Sequence[frozenset[str]]) -> dict[frozenset[str], Chosen]:
        """What some parts of a fit become with a further effect each, beside all that the others have."""
        found = self.store.fitter.simulator.side_by_side(lambda sites: self._grown_in(*self._part(whole, sites)), parts)
        return dict(zip(parts, found, strict=True))

    def _grown_in(self, store: FitStore, own: Fit) -> Chosen:
        """A part with a further effect, where any may gain enough.

        Before, laws that need no longer be rich become simple, and those of links the ones that suit them best.
        """
        if not store.is_promising(own):
            return Chosen(own)
        search = self._search_in(store, own)
        if own.effects:
            own = search.with_better_links(search.preferred([own], store.nominal) or own)
        return search.grown(own, steps=1)

    def _exchanged_by_parts(self, whole: Fit) -> dict[frozenset[str], Chosen]:
        """What the parts that have effects become with better ones in their place."""
        parts = self.split(whole, with_stand_ins=True)
        found = self.store.fitter.simulator.side_by_side(lambda part: part[0].exchanged(part[1]), parts)
        return dict(zip(self._parts_with_effects(whole), found, strict=True))

    def _exchanged_across(self, whole: Fit) -> Fit:
        """A fit with the best effect of another part in the place of one, the numbers of both parts free."""
        pairs = [(effect, other) for effect, others in self._stand_ins(whole).items() for other in others]
        found = self.store.side_by_side(lambda pair: self.replaced_across(whole, *pair), pairs)
        lead, held = max(found, key=lambda each: each[0], default=(0.0, Held.of(whole)))
        return self._together(held) if lead > self.rules.least_lead else whole

    def replaced_across(self, whole: Fit, effect: str, other: str) -> tuple[float, Held]:
        """By how much an effect of another part is better in the place of one, and the robot with it."""
        sites = self._sites_beside(effect) | self._sites_beside(other)
        store, own = self._part(whole, sites)
        base, held = store.without(own, effect), Held.of(whole)
        found = store.extended_by(base, other)
        criteria = self._search_in(store, own).criteria
        if found is None or not criteria.gains_enough(base, found):
            return 0.0, held
        return criteria.lead(found, own), held.with_part(sites, found)

    def _sites_beside(self, effect: str) -> frozenset[str]:
        """Sites of the part that has the site of an effect."""
        return next(part for part in parts_of(self.plant) if _site(effect) in part)

    def _with_parts(self, whole: Fit, found: Mapping[frozenset[str], Chosen]) -> Fit:
        """A fit with what some parts have become; the same fit where none has other effects."""
        held = Held.of(whole)
        for sites, chosen in found.items():
            if _has_changed(whole, sites, chosen):
                held = held.with_part(sites, chosen.fit)
        return whole if set(held.effects) == set(whole.effects) else self._together(held)

    def begun(self) -> Fit:
        """The fit of the effects that recorded forces ask for, as far as they are worth it."""
        expected = self.store.setting.asked_for
        effects = tuple(dict.fromkeys(name.rpartition(".")[0] for name in expected))
        if not effects:
            return self.nominal
        fit = self._first_fit(effects, expected)
        return self._rather_loose(fit) if self.criteria.gains_enough(self.nominal, fit) else self.nominal

    def _rather_loose(self, fit: Fit) -> Fit:
        """The fit of what recorded forces ask for, or that of one loose drive alone if it explains more.

        Where a drive is loose, the forces ask for several laws that imitate it, beside usual friction.
        """
        unusual = [effect for effect in fit.effects if not kind_of(effect).usual]
        several = [part for part in parts_of(self.plant) if sum(_site(effect) in part for effect in unusual) > 1]
        loose = [
            name
            for name, effect in vocabulary(self.plant).items()
            if effect.scan in LOOSE_DRIVES and any(_site(name) in part for part in several)
        ]
        found = self.store.side_by_side(lambda name: self.store.extended_by(self.nominal, name), loose)
        alone = max(filter(None, found), key=lambda each: score(each, self.nominal), default=fit)
        return alone if score(alone, self.nominal) > score(fit, self.nominal) else fit

    def fit_from(self, other: Fit) -> Fit:
        """The fit of the effects of the vocabulary that another kind of evidence has found."""
        effects = tuple(name for name in other.effects if not effect_of(name, self.plant).is_outside(self.plant))
        return self._first_fit(effects, other.hypothesis.values) if effects else self.nominal

    def _first_fit(self, effects: tuple[str, ...], values: Mapping[str, float]) -> Fit:
        """The fit of effects that were found without this search."""
        hypothesis = Hypothesis.of(self.store.setting, effects, {**self.nominal.hypothesis.values, **values})
        return self.store.keep(self.store.fitter.first_fit(hypothesis, self.nominal.levels))

    def exchanged(self, fit: Fit) -> Chosen:
        """Every part searched again, from the effects of a fit on."""
        return self.run(fit)

    def pruned(self, fit: Fit) -> Chosen:
        """Without the effects that those of other parts make superfluous, looked for among the weakest ones.

        What is explained elsewhere does not raise what an effect must gain.
        """
        losses = {effect: expected_loss(fit, effect) for effect in named_effects(fit)} if len(fit.effects) > 1 else {}
        doubted = [each for each in losses if losses[each] < DOUBTED * self.criteria.most_required(fit, each)]
        for effect in sorted(doubted, key=lambda effect: losses[effect])[:TRIED]:
            smaller = self.store.without(fit, effect)
            if not self._criteria_beside(fit, effect).gains_enough(smaller, fit):
                considered = ConsideredEffect(effect, evidence(smaller, fit), False, "superfluous beside other joints'")
                return self.pruned(smaller).after((considered,))
        return Chosen(fit)

    def _criteria_beside(self, fit: Fit, effect: str) -> Criteria:
        """Criteria that count what the part of an effect explains beside all that a fit has elsewhere."""
        return Criteria(self.store.fitter, self._part(fit, self._sites_beside(effect))[0].nominal)

    def split(self, fit: Fit, *, with_stand_ins: bool = False) -> tuple[tuple[Search, Fit], ...]:
        """The searches of the parts that have effects, and the fit as each of them sees it."""
        elsewhere = self._stand_ins(fit) if with_stand_ins else {}
        parts = self.store.fitter.simulator.side_by_side(
            lambda sites: self._part(fit, sites), self._parts_with_effects(fit)
        )
        return tuple((self._search_in(replace(store, elsewhere=elsewhere), own), own) for store, own in parts)

    def _stand_ins(self, fit: Fit) -> Mapping[str, tuple[str, ...]]:
        """Effects of other parts that may take the place of one, by that effect."""
        if id(fit) not in self._elsewhere:
            found = stand_ins(self.store.fitter, self.store.setting, fit, parts_of(self.plant))
            self._elsewhere[id(fit)] = (fit, found)
        return self._elsewhere[id(fit)][1]

    def _parts_with_effects(self, fit: Fit) -> list[frozenset[str]]:
        return [sites for sites in parts_of(self.plant) if _effects_at(fit, sites)]

    def joined(self, fit: Fit, parts: tuple[Fit, ...]) -> Fit:
        """The fit of a robot, with the effects that its parts have now."""
        held = Held.of(fit)
        for sites, part in zip(self._parts_with_effects(fit), parts, strict=True):
            held = held.with_part(sites, part)
        return self._together(held)

    def _together(self, held: Held) -> Fit:
        """The fit of all effects, from the values of the parts on."""
        hypothesis = Hypothesis.of(self.store.setting, held.effects, held.values)
        return self.store.keep(self.store.fitter.converged(self.store.fitter.fit(hypothesis, held.levels)))

    def _part(self, fit: Fit, sites: frozenset[str]) -> tuple[FitStore, Fit]:
        """Fits of a part beside what a fit has elsewhere, and the one where its search begins."""
        key = (id(fit), sites)
        if key not in self._known:
            self._known[key] = (fit, *self._beside(Held.of(fit), sites))
        return self._known[key][1:]

    def _beside(self, held: Held, sites: frozenset[str]) -> tuple[FitStore, Fit]:
        whole = self.store.setting
        own = tuple(effect for effect in held.effects if _site(effect) in sites)
        given: dict[str, dict[str, float]] = {name: dict(values) for name, values in held.extra.items()}
        for name, value in held.values.items():
            effect, _, symbol = name.rpartition(".")
            if effect in held.effects and effect not in own:
                given.setdefault(effect, dict(whole.tolerances.get(effect, {})))[symbol] = value
        setting = replace(whole, nominal=whole.nominal.with_effects(given), sites=sites)
        fitter = self.store.fitter.beside(setting)
        nominal = self._without_own(fitter, Hypothesis.of(setting, (), held.values), held)
        store = FitStore.of(fitter, setting, nominal)
        return store, store.keep(fitter.fit(Hypothesis.of(setting, own, held.values), held.levels)) if own else nominal

    def _without_own(self, fitter: Fitter, others: Hypothesis, held: Held) -> Fit:
        """The fit of a part without its effects, also from the noise of the nominal model where it got stuck.

        It got stuck if it is less likely than the nominal model: noise that suits all effects may be far too quiet.
        """
        found = fitter.converged(fitter.fit(others, held.levels))
        if found.log_likelihood >= self.nominal.log_likelihood:
            return found
        again = fitter.converged(fitter.fit(others, self.nominal.levels))
        return max(found, again, key=lambda fit: fit.log_likelihood)

    def _search_in(self, store: FitStore, begun: Fit) -> PartSearch:
        """The search of a part that begins at a fit."""
        if not begun.effects:
            return PartSearch.of(store, store.nominal, self.held_out)
        return PartSearch(store, Criteria(store.fitter, store.nominal), None, self.held_out)


def search_of(store: FitStore, nominal: Fit, held_out: HeldOut | None = None) -> Search:
    """The search that suits a robot: over all its sites at once, or part by part for a tree.

    Args:
        store: Of fits.
        nominal: The fit of the nominal model.
        held_out: Judges whether many effects transfer to held-out recordings; None if nobody asks.
    """
    kind = Search if store.setting.nominal.plant.tree is None else RobotSearch
    return kind.of(store, nominal, held_out)
