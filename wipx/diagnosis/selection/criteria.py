"""When one fit is preferred to another: evidence, what an effect must gain, and by how much one answer leads another.

The penalty is that of the Bayesian information criterion (Schwarz 1978). Evidence is divided by how much scores vary
more than the noise model has it.
"""

from dataclasses import dataclass

import numpy as np

from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.sandwich import inflation
from wipx.diagnosis.selection.nested_laws import comes_to_rest


def evidence(smaller: Fit, larger: Fit) -> float:
    """Log-likelihood that one fit has beyond another [nats].

    Forces that the drives report count at most as much as the motion: what only a report shows may be the way in
    which it is made.
    """
    moved = larger.motion_likelihood - smaller.motion_likelihood
    reported = larger.noise.reported - smaller.noise.reported
    return float(moved + min(reported, max(moved, 0.0)))


def score(fit: Fit, base: Fit) -> float:
    """Penalised evidence beyond a base, with the odds that the effects have beforehand [nats]."""
    own = sum(len(fit.hypothesis.parameters_of(effect)) for effect in fit.effects)
    return evidence(base, fit) - 0.5 * own * np.log(fit.rows) + fit.odds


@dataclass(frozen=True)
class Criteria:
    """What decides between fits of one robot.

    Attributes:
        fitter: The kind of evidence.
        nominal: The fit of the nominal model, from which on evidence is counted.
    """

    fitter: Fitter
    nominal: Fit

    def gains_enough(self, smaller: Fit, larger: Fit) -> bool:
        """Whether the effects that `larger` has beside those of `smaller` gain what they must."""
        return evidence(smaller, larger) >= self.required_gain(smaller, larger) and self.fitter.holds(smaller, larger)

    def required_gain(self, smaller: Fit, larger: Fit) -> float:
        """Evidence that the effects which `larger` has beside those of `smaller` must gain [nats]."""
        added = [effect for effect in larger.effects if effect not in smaller.effects]
        return self._required(smaller, larger, [i for effect in added for i in larger.hypothesis.parameters_of(effect)])

    def most_required(self, fit: Fit, effect: str) -> float:
        """Evidence that an effect of a fit must gain beside the others, at most [nats]."""
        return self._required(fit, fit, fit.hypothesis.parameters_of(effect))

    def _required(self, smaller: Fit, larger: Fit, numbers: list[int]) -> float:
        penalty = 0.5 * len(numbers) * np.log(larger.rows)
        explained = max(evidence(self.nominal, smaller), 0.0)
        overstated = inflation(larger, numbers)
        return float(overstated * (penalty + self.fitter.required_beyond_penalty(smaller, larger, explained)))

    def score_lead(self, fit: Fit, other: Fit) -> float:
        """Penalised evidence that a fit has beyond another one [nats]."""
        return score(fit, self.nominal) - score(other, self.nominal)

    def lead(self, fit: Fit, other: Fit) -> float:
        """By how much a fit is better than another one, as the kind of evidence judges it [nats]."""
        return self.fitter.lead(fit, other, self.score_lead(fit, other))

    def tells_apart(self, rich: Fit, plain: Fit) -> bool:
        """Whether recordings tell a rich law from the simple one that it contains, each that of a fit."""
        own = [
            i for effect in rich.effects if effect not in plain.effects for i in rich.hypothesis.parameters_of(effect)
        ]
        apart = self.fitter.separation(rich, plain, evidence(plain, rich), inflation(rich, own))
        return self.score_lead(rich, plain) > 0.0 and apart >= self.fitter.rules.answer.told_apart

    def tolerance(self, best: Fit, simple: tuple[str, ...]) -> float:
        """By how much a fit may be better than one in which a simple law has a rich one's place [nats]."""
        rests = any(comes_to_rest(effect) for effect in best.effects if effect not in simple)
        rules = self.fitter.rules.selection
        share = rules.sticking_share if rests else rules.least_share
        return max(rules.least_lead, share * evidence(self.nominal, best))
