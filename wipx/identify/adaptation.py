"""Real-to-sim adaptation (paper, Algorithm 1): a simulation is made to resemble trials of a robot with known loads."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.adaptation import ClassTrajectory, GapLoss
from wipx.core.errors import InputError
from wipx.core.load import Load
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.results import SearchHistory
from wipx.effects.catalogue import check_together, effect_of
from wipx.identify.closed_loop import ClosedLoopProblem
from wipx.identify.intervals import intervals
from wipx.identify.noise import sensor_noise
from wipx.identify.objectives import FitData, PaperTrajectories
from wipx.identify.optimizers.search import Optimizer, Watcher, unwatched
from wipx.identify.parameter_space import ParameterSpace, parameter_space, scales_of
from wipx.sim.simulator import Simulator, StateFeedback


@dataclass(frozen=True)
class LoadedTrials:
    """Recorded trials of one robot with known loads.

    Attributes:
        recordings: R recordings.
        classes: Name of the load in each.
        loads: The loads, likewise; None for the robot without load.
        feedback: The controller that closed the loop, and its rate [Hz].
    """

    recordings: tuple[Recording, ...]
    classes: tuple[str, ...]
    loads: tuple[Load | None, ...]
    feedback: tuple[StateFeedback, float]

    def of(self, names: set[str]) -> "LoadedTrials":
        """The trials with some of the loads."""
        kept = [i for i, name in enumerate(self.classes) if name in names]
        return LoadedTrials(
            tuple(self.recordings[i] for i in kept),
            tuple(self.classes[i] for i in kept),
            tuple(self.loads[i] for i in kept),
            self.feedback,
        )


@dataclass(frozen=True)
class Adapted:
    """An adapted simulation.

    Attributes:
        models: The simulations: one, or one for each draw of random numbers; the first is the one that is shown.
        parameters: Numbers of the first, by name [SI].
        intervals: Their 95 % intervals, where they were optimised.
        fit: Loss on the loads that the search saw.
        held_out: Loss on the others; None where there are none.
        history: Course of the search; None where nothing was searched.
        classes: Mean trajectories of the first model.
    """

    models: tuple[Model, ...]
    parameters: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    fit: GapLoss
    held_out: GapLoss | None
    history: SearchHistory | None
    classes: tuple[ClassTrajectory, ...]


@dataclass(frozen=True)
class AdaptationProblem:
    """The problem: which numbers may change, and what the simulation is to resemble.

    Attributes:
        nominal: The robot without load.
        fit: Eq. 7 over the loads that a search sees.
        held_out: The same over the others; None where there are none.
        trials: All trials.
        unseen: Names of the loads that are held out.
    """

    nominal: Model
    fit: ClosedLoopProblem
    held_out: ClosedLoopProblem | None
    trials: LoadedTrials
    unseen: frozenset[str]

    def nominal_only(self) -> Adapted:
        """The simulation as it is."""
        return self._adapted(np.zeros((1, len(self.fit.space.free))), None)

    def optimised(self, optimizer: Optimizer, rng: np.random.Generator, watcher: Watcher = unwatched) -> Adapted:
        """The simulation whose numbers an optimizer found."""
        minimum = optimizer.minimise(self.fit, rng, watcher)
        return self._adapted(minimum.cube[None], minimum.history)

    def random(self, draws: int, reach: float, rng: np.random.Generator) -> Adapted:
        """Simulations with random numbers, the one of median loss first; `reach` is that of `Method`."""
        cube = self.fit.space.sample(draws, rng, reach)
        order = np.argsort(self.fit.losses(cube), kind="stable")
        middle = (draws - 1) // 2
        return self._adapted(cube[[order[middle], *np.delete(order, middle)]], None)

    def _adapted(self, cube: np.ndarray, history: SearchHistory | None) -> Adapted:
        space = self.fit.space
        values = space.to_values(cube)
        models = tuple(space.model.with_values(dict(zip(space.names, row, strict=True))) for row in values.tolist())
        return Adapted(
            models,
            dict(zip(space.names, values[0].tolist(), strict=True)),
            {} if history is None else _intervals(self.fit, cube[0]),
            _loss(self.fit, cube),
            None if self.held_out is None else _loss(self.held_out, cube),
            history,
            tuple(
                trajectory
                for problem in (self.fit, self.held_out)
                if problem is not None
                for trajectory in self._trajectories(problem, cube[:1])
            ),
        )

    def _trajectories(self, problem: ClosedLoopProblem, cube: np.ndarray) -> list[ClassTrajectory]:
        simulated = problem.trajectories(cube)[:, :, 0]
        t = problem.rows / self.trials.feedback[1]
        loads = dict(zip(self.trials.classes, self.trials.loads, strict=True))
        found = []
        for i, name in enumerate(problem.labels):
            load = loads[name]
            balance = 0.0 if load is None else load.equilibrium(self.nominal)
            recorded = problem.target[:, :, i]
            found.append(ClassTrajectory(name, balance, name in self.unseen, t, recorded, simulated[:, :, i]))
        return found


def adaptation(
    nominal: Model,
    switched_on: tuple[str, ...],
    trials: LoadedTrials,
    held_out: tuple[str, ...],
    simulator: Simulator,
    objective: PaperTrajectories,
    bounds: Mapping[str, tuple[float, float]],
) -> AdaptationProblem:
    """The problem of adapting a simulation to trials.

    Args:
        nominal: The robot without load.
        switched_on: Effects whose numbers may change, as "site/kind"; empty for none.
        trials: Of the robot.
        held_out: Names of loads that the search does not see.
        simulator: The engine.
        objective: The paper's.
        bounds: Search intervals that replace the usual ones [SI].

    Raises:
        InputError: a held-out load does not exist, or all are held out; see also `closed_loop_problem`.
    """
    names = set(trials.classes)
    for name in held_out:
        if name not in names:
            raise InputError(f"task.held_out: there is no load {name!r}; the loads are {', '.join(sorted(names))}")
    if names == set(held_out):
        raise InputError("task.held_out: every load is held out; leave some to fit")
    check_together((*nominal.effects, *switched_on), nominal.plant)
    seen = trials.of(names - set(held_out))
    prepared = nominal.with_effects({name: effect_of(name, nominal.plant).neutral for name in switched_on})
    scales = scales_of(prepared, seen.recordings)
    space = (
        parameter_space(prepared, switched_on, {}, {}, bounds, scales) if switched_on else ParameterSpace(nominal, ())
    )
    noise = sensor_noise(seen.recordings, nominal.plant)
    speeds = tuple(scales[site].velocity for site in nominal.plant.joints)

    def problem(part: LoadedTrials) -> ClosedLoopProblem:
        data = FitData(part.recordings, nominal, simulator, noise, speeds, trials.feedback, part.loads, part.classes)
        return objective.problem(data, space)

    unseen = problem(trials.of(set(held_out))) if held_out else None
    return AdaptationProblem(nominal, problem(seen), unseen, trials, frozenset(held_out))


def _intervals(problem: ClosedLoopProblem, cube: np.ndarray) -> dict[str, tuple[float, float]]:
    return {
        name: (float(low), float(high))
        for name, (low, high) in zip(problem.space.names, intervals(problem, cube), strict=True)
    }


def _loss(problem: ClosedLoopProblem, cube: np.ndarray) -> GapLoss:
    losses = problem.losses(cube)
    middle = float(np.median(losses))
    return GapLoss(middle, float(losses.min()), float(losses.max()), problem.noise_floor(cube[0]))
