"""A race of fits ends as if all of its runners had been fitted to the end."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from diagnosis.recorded import bench

from wipx.diagnosis.candidates.screening import candidates_beside
from wipx.diagnosis.likelihood.fitting import Climb
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.selection import race
from wipx.diagnosis.selection.criteria import score

HIDDEN = {
    "friction": ("linear_axis", {"translation/coulomb": {"F_c": 1.0}}),
    "late commands": ("pendulum", {"actuator/delay": {"tau": 0.02}}),
    "two": ("wip", {"translation/coulomb": {"F_c": 1.0}, "sensor_theta/bias": {"b": 0.02}}),
}
STEPS = 6
FAR = 12.0  # nats that a step is expected to gain


@dataclass(frozen=True)
class Counted(InnovationFitter):
    """A fitter that counts its steps."""

    def stepped(self, climb: Climb) -> Climb:
        """A step, counted by the effect that it is made for."""
        counts[climb.fit.effects[-1]] = counts.get(climb.fit.effects[-1], 0) + 1
        return super().stepped(climb)


counts: dict[str, int] = {}


@pytest.mark.parametrize("hidden", HIDDEN)
def test_the_winner_is_that_of_fits_to_the_end_with_no_more_steps(hidden: str, fresh_seed: int):
    case = bench(*HIDDEN[hidden], fresh_seed)
    fitter = Counted(case.fitter.innovations_model, case.fitter.rules)
    nominal = case.fit()
    starts: dict[str, list[Climb]] = {}
    for candidate in candidates_beside(fitter, case.setting, nominal):
        begin = Hypothesis.of(case.setting, (candidate.effect,), candidate.values)
        own = starts.setdefault(candidate.effect, [])
        if len(own) < 2:
            own.append(fitter.begun(begin, nominal.levels))
    counts.clear()
    raced = race.run(lambda climbs: list(map(fitter.stepped, climbs)), nominal, list(starts.values()), STEPS)
    in_race = dict(counts)
    whole = [
        [fitter.fit(climb.fit.hypothesis, climb.fit.levels, steps=STEPS) for climb in own] for own in starts.values()
    ]
    raced_scores, scores = (np.array([max(score(f, nominal) for f in own) for own in fits]) for fits in (raced, whole))
    assert raced_scores.argmax() == scores.argmax()
    assert raced_scores.max() >= scores.max() - 1.0
    assert sum(in_race.values()) <= sum(counts[name] - in_race.get(name, 0) for name in counts)


@pytest.mark.parametrize(
    ("gain", "expected", "close", "steps"),
    [
        (50.0, 4.0, False, 0),  # reaches 70 of the 100 that half of the best score takes
        (50.0, FAR, False, STEPS),
        (50.0, 4.0, True, 1),  # its slopes cannot be trusted before the first step
        (150.0, 4.0, False, STEPS),
    ],
    ids=["hopeless", "within reach", "not known yet", "close behind"],
)
def test_a_fit_drops_out_once_it_cannot_win(gain: float, expected: float, close: bool, steps: int, fresh_seed: int):
    case = bench("linear_axis", {}, fresh_seed)
    nominal, other = case.fit(), case.fit("translation/coulomb")
    loss = score(other, nominal)
    made: list[float] = []

    def climb(gain: float, expected: float, *, close: bool = False) -> Climb:
        return Climb(
            replace(other, log_likelihood=other.log_likelihood - loss + gain), np.zeros((1, 1)), expected, close
        )

    def stepped(climbs: Sequence[Climb]) -> list[Climb]:
        made.extend(each.fit.log_likelihood for each in climbs)
        return [replace(each, close=False) for each in climbs]

    follower = climb(gain, expected, close=close)
    race.run(stepped, nominal, [[climb(200.0, FAR)], [follower]], STEPS)
    assert made.count(follower.fit.log_likelihood) == steps
