"""The diagnosis: nominal model and recordings in, verdict, location, names, numbers and what is open out."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from threadpoolctl import threadpool_limits

from wipx.core.diagnosis import Diagnosis
from wipx.core.limits import JointLimits
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.diagnosis.answer.answer import answered, proposed
from wipx.diagnosis.answer.caveats import caveats, implausible
from wipx.diagnosis.answer.suspects import asked, check_suspects
from wipx.diagnosis.candidates.torque_regression import numbers_by_forces
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.decision.evidence import Watcher, found
from wipx.diagnosis.decision.plausibility import check_plausible
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.rules import USUAL, Rules
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.robot_search import search_of
from wipx.identify.parameter_space import scales_of
from wipx.identify.windows import check_long_enough
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.simulator import StateFeedback

SHORTEST_HALVED = 2.0  # [s]


def in_two(recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
    """Recordings as they are; one alone in two halves, each of which can be held out from the other."""
    if len(recordings) != 1 or recordings[0].duration < SHORTEST_HALVED:
        return recordings
    whole = recordings[0]
    middle = len(whole) // 2
    return (
        replace(whole.rows(0, middle), name=f"{whole.name}, first half"),
        replace(whole.rows(middle, len(whole)), name=f"{whole.name}, second half"),
    )


def unwatched(stage: str, share: float) -> None:
    """Report progress to nobody."""


@dataclass(frozen=True)
class KnownRobot:
    """What a diagnosis knows of a robot beforehand.

    Attributes:
        nominal: What its owner believes.
        uncertainty: Relative standard deviation of nominal numbers that are not exact.
        feedback: The controller that closed the loop, and its rate [Hz]; None if unknown.
        limits: Of the joints of a robot from a model file, beside those of the file.
    """

    nominal: Model
    uncertainty: Mapping[str, float]
    feedback: tuple[StateFeedback, float] | None = None
    limits: Mapping[str, JointLimits] = field(default_factory=dict)


@threadpool_limits.wrap(limits=1, user_api="blas")  # on small matrices further threads only wait
def diagnose(
    recordings: tuple[Recording, ...],
    robot: KnownRobot,
    simulator: AnalyticSimulator,
    *,
    title: str = "",
    source: str = "robot.yaml",
    rng: np.random.Generator | None = None,
    watcher: Watcher = unwatched,
    suspects: Mapping[str, Mapping[str, float]] | None = None,
    rules: Rules = USUAL,
) -> Diagnosis:
    """Find out what physics a nominal model lacks.

    Args:
        recordings: Of one robot; several with different excitations tell most.
        robot: The nominal model.
        simulator: The engine.
        title: Of the page.
        source: Where the recordings come from.
        rng: Draws the excitations of the next experiment; None for always the same.
        watcher: Told the stage and the share that is done.
        suspects: Effects to ask about once the answer is complete, by "site/kind", each with the values that are
            suspected, by symbol [SI], or with none; they do not change the answer.
        rules: What decides.

    Raises:
        InputError: a recording is too short, a suspect cannot be, or the recordings contradict the nominal model
            grossly.
    """
    begun = time.perf_counter()
    check_long_enough(recordings)
    halves = in_two(recordings)
    by_forces = numbers_by_forces(robot.nominal, halves) if robot.nominal.plant.tree is not None else {}
    setting = Setting(robot.nominal, robot.uncertainty, scales_of(robot.nominal, halves), by_forces=by_forces)
    suspected = check_suspects(suspects or {}, setting.nominal, setting.scales)
    rate_is_known = robot.nominal.plant.tree is None or robot.feedback is not None
    context = Context.of(halves, setting, simulator, rules)
    context = replace(context, several=len(recordings) > 1, rate_is_known=rate_is_known)
    watcher("noise of the nominal model", 0.02)
    nominal = context.by_row.first_fit(Hypothesis.of(setting, (), {}), context.first_levels)
    fitter = context.by_row
    store = FitStore.of(fitter, setting, nominal)
    watcher("looking for missing effects", 0.1)
    if context.is_driven and setting.nominal.plant.tree is None:
        first = store.extensions(nominal)
        check_plausible(fitter, setting, nominal, first[0] if first else nominal, source)
    watcher("looking for combinations", 0.3)
    search = search_of(store, nominal, context.held_out)
    end = found(context, search, watcher)
    context, search, rest = end.context, end.search, end.rest
    watcher("held-out recordings", 0.75)
    answer = answered(context, search, rest, end.shapes)
    watcher("next experiment", 0.9)
    proposal = proposed(
        context, search, rest.fit, answer, robot.feedback, rng or np.random.default_rng(0), robot.limits
    )
    answer = replace(answer, next_experiment=proposal)
    if suspected:
        watcher("suspects", 0.95)
        answer = replace(answer, suspects=asked(context, search, rest, answer, suspected))
    watcher("done", 1.0)
    seconds = time.perf_counter() - begun
    guessed = context.data.has_means and not any(recording.periods > 1 for recording in recordings)
    notes = caveats(recordings, rules.answer, context.cut_off, guessed_means=guessed)
    notes += implausible(answer.effects, robot.nominal.plant, rules.answer.implausible)
    return replace(answer, title=title, source=source, notes=notes, seconds=seconds)
