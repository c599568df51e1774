"""What all stages of a diagnosis share: the recordings, what fits models to them, and what judges predictions."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from wipx.core.recording import Recording
from wipx.core.results import HORIZON, FitErrors
from wipx.diagnosis.likelihood.fitting import Fit, Fitter
from wipx.diagnosis.likelihood.held_out import HeldOut
from wipx.diagnosis.likelihood.hypothesis import Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.lasting_noise import NoiseSources, noise_sources
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.rules import Rules
from wipx.diagnosis.selection.search import Search
from wipx.effects.catalogue import kind_of
from wipx.identify.evaluation import RIGHT, Judge
from wipx.identify.noise import low_passed, sensor_noise
from wipx.identify.resolution import resolving
from wipx.sim.analytic import AnalyticSimulator

MOST_JOINTS = 2  # of a robot on which noise that lasts is looked for: the work grows with the third power
SWINGING = "springs"  # `Effect.scan` of drives that swing on a spring


@dataclass(frozen=True)
class Context:
    """The means of one diagnosis.

    Attributes:
        fitter: Fits hypotheses to the recordings, by the evidence that is counted.
        by_row: Fits them by innovations.
        setting: The robot, as its owner believes it to be.
        first_levels: A first guess of the noise.
        judge: Predicts recordings.
        recordings: Of the robot.
        several: Whether they are runs of their own, not halves of one.
        rate_is_known: Whether it is known if the log is slower than the controller.
    """

    fitter: Fitter
    by_row: InnovationFitter
    setting: Setting
    first_levels: NoiseLevels
    judge: Judge
    recordings: tuple[Recording, ...]
    several: bool = True
    rate_is_known: bool = False
    _sources: list[tuple[Fit, NoiseSources]] = field(default_factory=list, compare=False, repr=False)

    @classmethod
    def of(
        cls, recordings: tuple[Recording, ...], setting: Setting, simulator: AnalyticSimulator, rules: Rules
    ) -> "Context":
        """The means for recordings of a robot."""
        plant = setting.nominal.plant
        data = RecordingBatch.of(recordings, plant)
        noise = sensor_noise(recordings, plant)
        rates = [_rate_noise(recordings, plant.rates[c - data.joints]) for c in data.channels if c >= data.joints]
        levels = NoiseLevels(np.full(data.joints, 0.01), np.array([*noise, *rates]))
        engine = resolving(simulator, setting.nominal, recordings, noise)
        fitter = InnovationFitter(InnovationsModel.of(engine, data, setting.nominal), rules)
        return cls(fitter, fitter, setting, levels, Judge(engine, noise, HORIZON), recordings)

    def read_otherwise(self) -> "Context":
        """The same with rows that have means of two commands instead of held ones, or held ones again."""
        periods = 1 if self.data.has_means else 2
        recordings = tuple(replace(recording, periods=periods) for recording in self.recordings)
        data = RecordingBatch.of(recordings, self.data.plant)
        model = InnovationsModel.of(self.by_row.simulator, data, self.setting.nominal)
        fitter = replace(self.by_row, innovations_model=model)
        return replace(self, fitter=fitter, by_row=fitter, recordings=recordings)

    def is_likelier(self, fit: Fit, other: "Context", other_fit: Fit) -> bool:
        """Whether every recording is likelier, as its rows are read here, than as they are read otherwise.

        Args:
            fit: By innovations, of rows as they are read here.
            other: Reads them otherwise.
            other_fit: By its innovations.
        """
        gains = self._motion_likelihoods(fit) - other._motion_likelihoods(other_fit)
        return bool(gains.min() > 0.0 and gains.mean() > self.rules.selection.least_gain)

    def _motion_likelihoods(self, fit: Fit) -> np.ndarray:
        """Log-likelihood of each recording without forces that drives report, which are of single commands; (R,)."""
        fitter = self.by_row.without_reports()
        motion = fitter.fit(fit.hypothesis, fit.levels, steps=0)
        return fitter.by_recording(motion, motion.white)

    def beside(self, search: Search) -> "Context":
        """The same for the part of a robot that a search looks at."""
        return replace(self, fitter=search.store.fitter, setting=search.store.setting)

    def trusting(self, fit: Fit) -> "Context":
        """The same; all models predict from states of the filter from which that of a fit predicts best."""
        tuned = self.judge.tuned(fit.hypothesis.model, self.recordings)
        return replace(self, judge=replace(self.judge, bandwidths=tuned.bandwidths))

    def is_trusted(self, fit: Fit) -> bool:
        """Whether the laws of a fit hold, and not only nearly.

        Row by row they ask for no forces but theirs: what a law misses, an observer takes for noise of the forces. And
        the fit predicts like a right model: at the floor, or about as well from a filter that trusts it as from any
        other.
        """
        if not self.is_quiet(fit):
            return False
        errors = self.errors(fit)
        if errors.times_the_floor <= self.rules.trust.near_floor:
            return True
        if self.is_worse(fit) or self.unruly_joints(fit):
            return False
        if self.data.plant.tree is not None:  # a slow filter loses the fast motion of an arm, however right its model
            return True
        trusting = dict.fromkeys(self.data.plant.coordinates, RIGHT)
        judge = replace(self.judge_of(fit), bandwidths=trusting)
        others = judge.compare(self.setting.nominal, fit.hypothesis.model, self.recordings, held_out=False)[0].completed
        return all(others[name] <= self.rules.trust.distrusted * error for name, error in errors.completed.items())

    def is_quiet(self, fit: Fit) -> bool:
        """Whether a fit asks for no forces but those of its laws, row by row.

        A joint whose drive swings on a spring does not count: no sensor shows where such a drive is, so that the
        observer takes its errors for forces on the joint.
        """
        plant = self.data.plant
        swinging = {plant.joint_at(name.partition("/")[0]) for name in fit.effects if kind_of(name).scan == SWINGING}
        asked = np.array([joint not in swinging for joint in plant.joints])
        return not np.any(asked & self.by_row.asks_for_force(self.noise_of(fit).force, self.setting.scales))

    def holds_somewhere(self, fit: Fit) -> bool:
        """Whether the laws of a fit leave some joint no error that lasts."""
        by_row, seen = self.fitter.seen_by_row(fit)
        return bool(np.any(by_row.foretold(seen) <= self.rules.trust.foretold))

    def unruly_joints(self, fit: Fit) -> tuple[str, ...]:
        """Joints whose laws hold nearly at best, and whose predictions err far more than noise makes them.

        The worst is first. Noise is that of the sensors. On a robot of many joints it may last where earlier
        innovations foretell a share f of the variance of later ones: then it is 1 / sqrt(1 - f) times as large as white
        noise. Random forces excuse nothing: they leave innovations white.
        """
        plant = self.data.plant
        by_row, seen = self.fitter.seen_by_row(fit)
        errors, foretold = self.errors(fit), by_row.foretold(seen)
        floor = np.array([errors.noise_floor[name] for name in plant.coordinates])
        noise = floor if self.data.joints <= MOST_JOINTS else floor / np.sqrt(np.clip(1.0 - foretold, 1e-12, 1.0))
        times = np.array([errors.completed[name] for name in plant.coordinates]) / noise
        rules = self.rules.trust  # noise that lasts puts a right model far off where motion is unstable, not beyond
        wrong = (times > rules.far_off * rules.distrusted) & (foretold > rules.foretold)
        return tuple(plant.joints[j] for j in np.argsort(-times) if wrong[j])

    def is_worse(self, fit: Fit) -> bool:
        """Whether a fit predicts the recordings far worse than the nominal model, though it was fitted to them."""
        errors = self.errors(fit)
        return any(
            error > self.rules.trust.distrusted * errors.nominal[name] for name, error in errors.completed.items()
        )

    def errors(self, fit: Fit) -> FitErrors:
        """Errors of the nominal model and of a fit on the recordings."""
        judge, nominal = self.judge_of(fit), self.setting.nominal
        return judge.compare(nominal, fit.hypothesis.model, self.recordings, held_out=False)[0]

    def judge_of(self, fit: Fit) -> Judge:
        """Judges predictions by the noise that sensors have if a fit is right."""
        return replace(self.judge, lasting=self.noise_of(fit).lasting)

    def noise_of(self, fit: Fit) -> NoiseSources:
        """What noise a fit leaves.

        Noise that lasts is looked for where white noise of the sensors does not make errors as large as they are, or
        leaves forces; not on robots of many joints. A joint is left the smaller of the forces with it and without,
        unless earlier innovations foretell most of later ones: without it they may then hide any force.
        """
        known = next((sources for other, sources in self._sources if other is fit), None)
        if known is None:
            by_row, seen = self.fitter.seen_by_row(fit)
            nominal, model = self.setting.nominal, fit.hypothesis.model
            known = NoiseSources(seen.levels.force, None)
            if self.data.joints <= MOST_JOINTS:
                errors = self.judge.compare(nominal, model, self.recordings, held_out=False)[0]
                large = errors.times_the_floor > self.rules.trust.near_floor
                if large or np.any(by_row.asks_for_force(known.force, self.setting.scales)):
                    found = noise_sources(by_row.innovations_model, seen, self.rules.trust.noise_lasts)
                    coloured = by_row.foretold(seen) > self.rules.trust.foretold
                    least = np.where(coloured, found.force, np.minimum(found.force, known.force))
                    known = replace(found, force=least)
            self._sources.append((fit, known))
        return known

    @property
    def rules(self) -> Rules:
        """What decides."""
        return self.fitter.rules

    @property
    def data(self) -> RecordingBatch:
        """The recordings."""
        return self.fitter.data

    @property
    def is_driven(self) -> bool:
        """Whether any command ever changes."""
        return bool(np.ptp(self.data.inputs.commands, axis=0).max() > 0.0)

    @cached_property
    def cut_off(self) -> float | None:
        """Frequency above which no signal has any power [Hz]; None where they have: then single rows tell something."""
        return low_passed(self.recordings, self.data.plant, self.rules.trust.smoothed)

    @property
    def by_forecasts_alone(self) -> bool:
        """Whether forecasts decide, whatever innovations say: those of an arm's low-passed signals say nothing."""
        return self.data.plant.tree is not None and self.cut_off is not None

    @property
    def held_out(self) -> HeldOut:
        """Judges fits by recordings that they were not fitted to."""
        return HeldOut(self.judge, self.recordings)


def _rate_noise(recordings: tuple[Recording, ...], column: str) -> float:
    """Standard deviation of a recorded rate's noise, by second differences."""
    values = np.concatenate([np.diff(r[column], 2) for r in recordings])
    return max(1.4826 * float(np.median(np.abs(values))) / np.sqrt(6.0), 1e-9)
