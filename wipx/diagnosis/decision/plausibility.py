"""Is robot.yaml, or the reading of the log, grossly wrong: signs, units, zeros.

Such a mistake looks like missing physics of every kind at once. Each of the usual ones is undone in turn, and where the
nominal model then explains the recordings far better than any single effect makes it, the owner is told instead of
being given a diagnosis. What is uncertain by a few per cent is no mistake; that is what effects are for.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.core.results import HORIZON
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.noise_model import LARGEST
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.rules import PlausibilityRules
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.identify.evaluation import Judge
from wipx.identify.noise import sensor_noise
from wipx.identify.parameter_space import scales_of

PROBE_SPAN = 3.0  # [s] of a recording; a gross error shows in every second of it
PROBE_RECORDINGS = 4
ROUNDS = 3  # of noise levels and values in turn
QUIET_FORCE = 1e-3  # of a joint's forces, where the search for the noise begins [s^0.5]


@dataclass(frozen=True)
class Mistake:
    """A mistake of owners, by what undoes it.

    Attributes:
        contradicted: What the recordings contradict, after "its".
        undone: What was tried, after "with".
        remedy: What the owner writes instead.
        columns: Factor and offset of recorded columns, value = factor * column + offset.
        parameters: Factor of the nominal model's numbers.
    """

    contradicted: str
    undone: str
    remedy: str
    columns: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)

    def model(self, nominal: Model) -> Model:
        """The nominal model with its numbers put right."""
        return nominal.with_values({name: factor * nominal.value(name) for name, factor in self.parameters.items()})

    def recording(self, recording: Recording) -> Recording:
        """A recording with its columns put right."""
        changed = {n: f * recording[n] + offset for n, (f, offset) in self.columns.items() if n in recording}
        return Recording(recording.name, {**recording.columns, **changed}, recording.source, recording.periods)

    def factors(self, data: RecordingBatch) -> np.ndarray:
        """Size of the factor on each recorded channel, shape (m,)."""
        names = (*data.plant.coordinates, *data.plant.rates)
        return np.array([abs(self.columns.get(names[c], (1.0, 0.0))[0]) for c in data.channels])

    @property
    def keeps_stability(self) -> bool:
        """Whether the robot is as stable with it as without; another zero or mass may let predictions run away."""
        return not self.parameters and not any(offset for _, offset in self.columns.values())

    def leaves_motion(self, data: RecordingBatch, least: float) -> bool:
        """Whether the coordinates still travel so far [m, rad] once it is put right; a right unit is no mistake."""
        for column, (factor, _) in self.columns.items():
            if column in data.plant.coordinates:
                travel = max(float(np.ptp(r[column])) for r in data.recordings)
                if abs(factor) * travel < least:
                    return False
        return True


def check_plausible(fitter: InnovationFitter, setting: Setting, nominal: Fit, best: Fit, where: str) -> None:
    """Refuse a robot.yaml that the recordings contradict grossly.

    The likeliest mistake must explain more than the nominal model does, and far more when both may have one effect
    beside.
    Where it leaves the robot as stable as it is, the nominal model must predict half a second better without it, too:
    beside a late drive a reversed sign looks better from row to row.

    Args:
        fitter: Of the recordings.
        setting: The robot.
        nominal: Fit of the nominal model.
        best: The best fit with one effect more; `nominal` where none helps.
        where: File that describes the robot, for the message.

    Raises:
        InputError: a sign, a unit or a zero is wrong; the message says which and how to mend it.
    """
    data, rules = fitter.data, fitter.rules.plausibility
    probe = _Case.of(fitter, _probed(data.recordings), setting, nominal.levels)
    described = mistakes(setting.nominal, rules)
    possible = [mistake for mistake in described if mistake.leaves_motion(data, rules.least_motion)]
    mended = [(probe.without(mistake), mistake) for mistake in possible]
    case, mistake = max(mended, key=lambda pair: pair[0].nominal_likelihood)
    if case.nominal_likelihood <= probe.nominal_likelihood:
        return
    believed = max(probe.nominal_likelihood, probe.likelihood_with(best))
    gain = (case.best_likelihood() - believed) / probe.values
    predicts = not mistake.keeps_stability or case.relative_error < probe.relative_error
    if gain > rules.overwhelming and predicts:
        raise InputError(
            f"{where}: the recordings contradict its {mistake.contradicted} (with {mistake.undone} the model's errors "
            f"from row to row are {np.exp(-gain):.2g} times what the best missing effect leaves); {mistake.remedy}"
        )


def mistakes(nominal: Model, rules: PlausibilityRules) -> tuple[Mistake, ...]:
    """The mistakes that are possible for a robot."""
    plant = nominal.plant
    units = (*_units_of_columns(nominal), *_zeros(plant), *_units_of_parameters(nominal, rules))
    return (*_signs(plant), *units)


def _signs(plant: Plant) -> list[Mistake]:
    named = " and ".join(plant.commands)
    mapped = ", ".join(f"{u}: {{column: {u}, scale: -1}}" for u in plant.commands)
    reverse = {u: (-1.0, 0.0) for u in plant.commands}
    reversed_commands = Mistake(
        f"sign of {named}", f"{named} reversed", f"reverse it with signals: {{{mapped}}}", reverse
    )
    if len(plant.joints) == 1 or plant.kind == "double_pendulum":
        return [reversed_commands]  # a reversed coordinate is the same
    return [reversed_commands, *(_reversed(column) for column in plant.coordinates)]


def _reversed(column: str) -> Mistake:
    remedy = f"reverse it with signals: {{{column}: {{column: {column}, scale: -1}}}}, and its rate likewise"
    columns = {column: (-1.0, 0.0), f"{column}_dot": (-1.0, 0.0)}
    return Mistake(f"sign of {column}", f"{column} reversed", remedy, columns)


def _units_of_columns(nominal: Model) -> list[Mistake]:
    plant = nominal.plant
    found = []
    angles = [column for column in plant.coordinates if column != "x"]
    if angles:
        columns = {name: (np.pi / 180.0, 0.0) for a in angles for name in (a, f"{a}_dot")}
        mapped = ", ".join(f"{a}: {{column: {a}, unit: deg}}" for a in angles)
        found.append(
            Mistake(f"unit of {' and '.join(angles)}, rad", "degrees read", f"write signals: {{{mapped}}}", columns)
        )
    if "x" in plant.coordinates:
        columns = {"x": (1e-3, 0.0), "x_dot": (1e-3, 0.0)}
        found.append(Mistake("unit of x, m", "millimetres read", "write signals: {x: {column: x, unit: mm}}", columns))
    radius = nominal.parameters.get("wheel_radius")
    if "x" in plant.coordinates and radius is not None:
        remedy = f"divide by the wheel radius with signals: {{u: {{column: u, scale: {1.0 / radius:.5g}}}}}"
        found.append(Mistake("unit of u, N", "a motor torque in N m read", remedy, {"u": (1.0 / radius, 0.0)}))
    return found


def _zeros(plant: Plant) -> list[Mistake]:
    column = next((column for column in plant.coordinates if column != "x"), None)
    if column is None:
        return []
    zero, other = ("hanging", "upright") if plant.kind == "double_pendulum" else ("upright", "hanging")
    remedy = f"move it with signals: {{{column}: {{column: {column}, offset: 3.14159}}}}"
    return [Mistake(f"zero of {column}, which is {zero}", f"0 taken for {other}", remedy, {column: (1.0, np.pi)})]


def _units_of_parameters(nominal: Model, rules: PlausibilityRules) -> list[Mistake]:
    wrong = (
        ("body_mass", 1e-3, "g", "kg"),
        ("body_inertia", 1e-3, "g m^2", "kg m^2"),
        ("body_inertia", 1e-4, "kg cm^2", "kg m^2"),
        ("com_height", 1e-3, "mm", "m"),
        ("com_height", 1e-2, "cm", "m"),
    )
    found = []
    for name, factor, taken, expected in wrong:
        if name not in nominal.parameters:
            continue
        value = factor * nominal.parameters[name]
        remedy = f"write {name}: {value:.5g} if it is in {taken}"
        mistake = Mistake(f"{name}, {expected}", f"{taken} read", remedy, parameters={name: factor})
        if _is_a_body(mistake.model(nominal), rules):
            found.append(mistake)
    return found


def _is_a_body(model: Model, rules: PlausibilityRules) -> bool:
    """Whether inertia, mass and height could belong to one body; a mistake leaves them decades apart."""
    p = model.parameters
    if "body_inertia" not in p:
        return False
    gyration = p["body_inertia"] / (p["body_mass"] * p["com_height"] ** 2)
    return rules.least_gyration < gyration < rules.most_gyration


def _probed(recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
    return tuple(r.between(r.t[0], r.t[0] + PROBE_SPAN) for r in recordings[:PROBE_RECORDINGS])


@dataclass(frozen=True)
class _Case:
    """Recordings beside a description of the robot, as given or with a mistake put right.

    Attributes:
        fitter: Of these recordings.
        setting: The robot.
        nominal: Fit of the nominal model; None where that runs away.
        levels: Where a search for the noise begins.
        density: Log-likelihood that is due to the units alone.
    """

    fitter: InnovationFitter
    setting: Setting
    nominal: Fit | None
    levels: NoiseLevels
    density: float = 0.0

    @classmethod
    def of(
        cls,
        like: InnovationFitter,
        recordings: tuple[Recording, ...],
        setting: Setting,
        levels: NoiseLevels,
        density: float = 0.0,
    ) -> "_Case":
        data = RecordingBatch.of(recordings, setting.nominal.plant)
        fitter = InnovationFitter(InnovationsModel.of(like.simulator, data, setting.nominal), like.rules)
        return cls(fitter, setting, _polished(fitter, Hypothesis.of(setting, (), {}), levels), levels, density)

    @property
    def values(self) -> int:
        """How many recorded values count."""
        data = self.fitter.data
        return int(data.counted.sum()) * data.signals

    @property
    def nominal_likelihood(self) -> float:
        """Log-likelihood with the nominal model, of the recordings in the units that they were logged in."""
        return self._likelihood(self.nominal)

    @property
    def relative_error(self) -> float:
        """Root mean square error of the nominal model's predictions, over the spread of each coordinate."""
        recordings, model = self.fitter.data.recordings, self.setting.nominal
        judge = Judge(self.fitter.simulator, sensor_noise(recordings, model.plant), HORIZON)
        errors = judge.compare(model, model, recordings, held_out=False)[0].completed
        spread = {name: max(float(np.ptp(r[name])) for r in recordings) for name in errors}
        return float(np.sqrt(np.mean([(error / spread[name]) ** 2 for name, error in errors.items()])))

    def likelihood_with(self, other: Fit) -> float:
        """The same with the effects of another fit."""
        return self._likelihood(_polished(self.fitter, other.hypothesis, self.levels))

    def best_likelihood(self) -> float:
        """The same with the best single effect beside the nominal model."""
        if self.nominal is None:
            return -np.inf
        try:
            extended = FitStore.of(self.fitter, self.setting, self.nominal).extensions(self.nominal)
        except np.linalg.LinAlgError:
            extended = []
        return max(self._likelihood(fit) for fit in (self.nominal, *extended))

    def without(self, mistake: Mistake) -> "_Case":
        """The same recordings with a mistake put right."""
        data = self.fitter.data
        recordings = tuple(mistake.recording(r) for r in data.recordings)
        model = mistake.model(self.setting.nominal)
        scales = scales_of(model, recordings)
        factors = mistake.factors(data)
        force = np.array([QUIET_FORCE * scales[site].force for site in data.plant.joints])
        levels = NoiseLevels(force, self.levels.sensor * factors)
        density = int(data.counted.sum()) * float(np.log(factors).sum())
        mended = Setting(model, self.setting.uncertainty, scales)
        return _Case.of(self.fitter, recordings, mended, levels, density)

    def _likelihood(self, fit: Fit | None) -> float:
        return -np.inf if fit is None else fit.log_likelihood + self.density


def _polished(fitter: InnovationFitter, hypothesis: Hypothesis, levels: NoiseLevels) -> Fit | None:
    """The best values and noise; None where the model runs away from the recordings."""
    try:
        fit = fitter.converged(fitter.fit(hypothesis, levels), rounds=ROUNDS)
    except np.linalg.LinAlgError:
        return None
    return None if _runs_away(fitter, fit) or not np.isfinite(fit.log_likelihood) else fit


def _runs_away(fitter: InnovationFitter, fit: Fit) -> bool:
    """Whether innovations are at the bound of what is counted; the noise model takes a constant for no error at all."""
    innovations_model, levels = fitter.innovations_model, fit.levels
    batch = fit.hypothesis.space.batch(fit.hypothesis.cube)
    gains = innovations_model.gains(levels, fit.hypothesis.model)
    innovations = innovations_model.innovations(batch, (gains,), np.zeros(1, dtype=np.int64))
    return float(np.mean(np.abs(innovations) >= LARGEST)) > fitter.rules.plausibility.run_away
