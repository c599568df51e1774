"""The next experiment: the excitation that best settles what the recordings leave open.

Every excitation of a menu is run on the completed model. It separates the completed model from a rival as far as the
rival, fitted to that run as well as to the recordings so far, still predicts something else (T-optimality: Atkinson,
Fedorov 1975, The design of experiments for discriminating between two rival models, Biometrika 62(1)); it measures a
number as well as the information of both says. The run is simulated by `simulated_experiment`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from wipx.core.limits import JointLimits
from wipx.core.next_experiment import Experiment, NextExperiment
from wipx.core.results import NINETY_FIVE
from wipx.diagnosis.likelihood.fitting import DAMPINGS, LARGEST_STEP, SECANT, Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.likelihood.sandwich import covariance, inflation
from wipx.diagnosis.next_experiment.envelope import Envelope
from wipx.diagnosis.next_experiment.excitations import Reach
from wipx.diagnosis.next_experiment.simulated_experiment import EVENT, Bench, SimulatedRun, loaded
from wipx.diagnosis.next_experiment.tree_experiment import TreeBench
from wipx.diagnosis.rules import USUAL, Rules
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.simulator import StateFeedback

MOST_RIVALS = 3
STEPS = 3  # of a rival's fit to a simulated run


@dataclass(frozen=True)
class Question:
    """What the recordings leave open.

    Attributes:
        sentence: It, for a person.
        rivals: Other hypotheses that explain the recordings about as well, the closest first.
        parameters: Numbers of the completed model that are not known well, e.g. "pitch/viscous.sigma".
    """

    sentence: str
    rivals: tuple[Fit, ...]
    parameters: tuple[str, ...]


def next_experiment(
    question: Question,
    fit: Fit,
    setting: Setting,
    data: RecordingBatch,
    simulator: AnalyticSimulator,
    feedback: StateFeedback | None,
    rate: float,
    rng: np.random.Generator,
    rules: Rules = USUAL,
    limits: Mapping[str, JointLimits] | None = None,
) -> NextExperiment | None:
    """The experiment that settles a question best.

    Args:
        question: What is open.
        fit: Of the completed model.
        setting: The robot.
        data: The recordings so far.
        simulator: The engine.
        feedback: The robot's controller; without one, commands are replayed from where the recordings start.
        rate: Of the controller [Hz].
        rng: Draws phases and noise.
        rules: What decides.
        limits: Of the joints of a robot from a model file, beside those of the file; None for no more.

    Returns:
        The menu by the separation of what stays least clear, after one run of 10 s. None where nothing is open, the
        robot cannot be simulated within its reach, or no experiment would settle anything.
    """
    asked = _Asked.of(question, fit, data)
    trials, separations = [], []
    for trial in _trials(asked, data, simulator, (feedback, rate), limits or {}, rng):
        run = RecordingBatch.of((trial.recording,), data.plant).reporting_nothing(data)
        fitter = InnovationFitter(InnovationsModel.of(simulator, run, setting.nominal))
        trials.append(trial)
        separations.append(asked.separations(fitter, trial.mass))
    if not trials or not asked.count:
        return None
    table = np.array(separations)
    settled = table.max(axis=0) >= rules.experiment.useless
    if not settled.any():
        return None
    worst = table[:, settled].min(axis=1)
    repeats = [_repeats(float(separation), rules) if question.rivals else 1 for separation in worst]
    experiments = [
        _experiment(trial, float(separation), often)
        for trial, separation, often in zip(trials, worst, repeats, strict=True)
    ]
    order = np.argsort(-worst, kind="stable")
    best = int(order[0])
    menu, chosen = tuple(experiments[i] for i in order), trials[best]
    return NextExperiment(
        question.sentence,
        experiments[best],
        menu,
        chosen.reference,
        release=chosen.release,
        mass=chosen.mass,
        repeats=repeats[best],
    )


@dataclass(frozen=True)
class _Asked:
    """A question, with what the recordings so far say of it.

    Attributes:
        fit: Of the completed model.
        rivals: That are looked at.
        numbers: Indices of the open numbers.
        known: Covariance of the position in the cube so far, shape (D, D).
        overstated: Factor by which likelihoods overstate the evidence.
    """

    fit: Fit
    rivals: tuple[Fit, ...]
    numbers: tuple[int, ...]
    known: np.ndarray
    overstated: float

    @classmethod
    def of(cls, question: Question, fit: Fit, data: RecordingBatch) -> "_Asked":
        names = fit.hypothesis.space.names
        numbers = tuple(names.index(name) for name in question.parameters)
        everything = list(range(len(names)))
        return cls(fit, question.rivals[:MOST_RIVALS], numbers, covariance(fit), inflation(fit, everything))

    @property
    def count(self) -> int:
        """How many things are asked."""
        return len(self.rivals) + len(self.numbers)

    @property
    def has_payload_event(self) -> bool:
        """Whether a known mass cannot be told to the simulator beside what the models have."""
        return any(EVENT in fit.hypothesis.model.effects for fit in (self.fit, *self.rivals))

    def separations(self, fitter: InnovationFitter, mass: float) -> np.ndarray:
        """What a simulated run would add, shape (count,) [standard deviations].

        Args:
            fitter: Of the run.
            mass: Known mass on the robot [kg].
        """
        judge = replace(self.fit, hypothesis=loaded(self.fit.hypothesis, mass))
        view = _View(fitter, judge)
        apart = [view.distance(loaded(rival.hypothesis, mass), rival.information) for rival in self.rivals]
        return np.array([*(np.sqrt(d / self.overstated) for d in apart), *self._precisions(view)])

    def _precisions(self, view: "_View") -> list[float]:
        """Size over standard deviation of each open number, with the run added."""
        if not self.numbers:
            return []
        hypothesis = view.judge.hypothesis
        slopes = view.slopes(hypothesis, hypothesis.cube, self.fit.information)
        known = np.linalg.pinv(self.known) + np.eye(len(hypothesis.cube))  # each is known to lie in the cube
        total = known + slopes.T @ slopes / self.overstated
        before, after = (np.sqrt(np.diag(np.linalg.inv(information))) for information in (known, total))
        found = []
        for i in self.numbers:
            value, per_cube = _value_and_slope(hypothesis, i)
            size = max(abs(value), NINETY_FIVE * per_cube * before[i])
            found.append(size / (per_cube * after[i]))
        return found


@dataclass(frozen=True)
class _View:
    """A simulated run as the completed model's observer sees it.

    Attributes:
        fitter: Of the run.
        judge: The completed model with the noise model of the recordings so far.
    """

    fitter: InnovationFitter
    judge: Fit

    def distance(self, rival: Hypothesis, information: np.ndarray) -> float:
        """Twice the log-likelihood ratio to expect when the rival is fitted to run and recordings [nats].

        The size of the noise is fitted as well, so that the ratio grows with the logarithm of a large difference.
        """
        truth = self._white(self.judge.hypothesis, self.judge.hypothesis.cube[None])[0]
        start = rival.cube
        cost = float(np.sum((self._white(rival, start[None])[0] - truth) ** 2))
        cube = start
        for _ in range(STEPS if len(start) else 0):
            slopes = self.slopes(rival, cube, information)
            left = self._white(rival, cube[None])[0] - truth
            moved = cube - start
            normal = slopes.T @ slopes + information
            trials = _steps(cube, normal, slopes.T @ left + information @ moved)
            costs = np.sum((self._white(rival, trials) - truth) ** 2, axis=1)
            costs += np.einsum("pi,ij,pj->p", trials - start, information, trials - start)
            best = int(costs.argmin())
            if costs[best] >= cost:
                break
            cube, cost = trials[best], float(costs[best])
        data = self.fitter.data
        values = int(data.counted.sum()) * data.signals
        return values * float(np.log1p(cost / values))

    def slopes(self, hypothesis: Hypothesis, cube: np.ndarray, information: np.ndarray) -> np.ndarray:
        """Slopes of the white innovations by the position in the cube, shape (values, D)."""
        size = np.clip(SECANT / np.sqrt(np.maximum(np.diag(information), 1e-12)), 1e-6, LARGEST_STEP)
        signed = np.where(cube > 0.5, -size, size)
        white = self._white(hypothesis, np.concatenate([cube[None], cube + np.diag(signed)]))
        return ((white[1:] - white[0]) / signed[:, None]).T

    def _white(self, hypothesis: Hypothesis, cubes: np.ndarray) -> np.ndarray:
        return self.fitter.white_of(self.judge, hypothesis.space.batch(cubes))


def _steps(cube: np.ndarray, normal: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Positions to try, one for each damping, within the cube."""
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-12))
    scaled = normal / np.outer(scale, scale)
    moves = [np.linalg.solve(scaled + (d + 1e-9) * np.eye(len(cube)), slope / scale) / scale for d in DAMPINGS]
    return np.clip(cube - np.array(moves), 0.0, 1.0)


def _trials(
    asked: _Asked,
    data: RecordingBatch,
    simulator: AnalyticSimulator,
    controller: tuple[StateFeedback | None, float],
    limits: Mapping[str, JointLimits],
    rng: np.random.Generator,
) -> list[SimulatedRun]:
    """What the robot stands, simulated on the completed model."""
    fit, (feedback, rate) = asked.fit, controller
    if data.plant.tree is not None:
        closed = None if feedback is None else (feedback, rate)
        envelope = Envelope.of(data, limits)
        return TreeBench(simulator, fit.hypothesis, data, envelope, fit.levels, closed).trials(rng)
    bench = Bench(simulator, fit.hypothesis, data, Reach.of(data), fit.levels, feedback, rate)
    return bench.trials(rng, masses=not asked.has_payload_event)


def _experiment(trial: SimulatedRun, separation: float, repeats: int) -> Experiment:
    sentence = trial.how
    if repeats > 1:
        sentence += f"; do it {repeats} times"
    return Experiment(trial.name, sentence, separation)


def _repeats(separation: float, rules: Rules) -> int:
    """How often an experiment must be done to tell rivals apart; once where no number that is bearable would do."""
    repeats = int(np.ceil((rules.answer.told_apart / max(separation, 1e-6)) ** 2))
    return repeats if repeats <= rules.experiment.most_repeats else 1


def _value_and_slope(hypothesis: Hypothesis, index: int) -> tuple[float, float]:
    """A number and how much it changes along its side of the cube [SI]."""
    ends = np.repeat(hypothesis.cube[None], 3, axis=0)
    ends[1:, index] = np.clip(ends[0, index] + np.array([-1e-4, 1e-4]), 0.0, 1.0)
    values = hypothesis.space.to_values(ends)[:, index]
    return float(values[0]), float((values[2] - values[1]) / (ends[2, index] - ends[1, index]))
