"""A robot.yaml that is grossly wrong is refused; one that merely lacks physics never is."""

from pathlib import Path

import numpy as np
import pytest
from identify.emulated_robot import Robot, nominal_model

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.diagnosis.decision.plausibility import Mistake, check_plausible, mistakes
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.rules import PlausibilityRules
from wipx.identify.noise import sensor_noise
from wipx.identify.parameter_space import scales_of
from wipx.recordings.source import RecordingSource
from wipx.sim.analytic import AnalyticSimulator

Effects = dict[str, dict[str, float]]
Recordings = tuple[Recording, ...]

MISSING: dict[str, Effects] = {
    "friction": {"translation/coulomb": {"F_c": 8.0}},
    "gain": {"actuator/gain": {"k": 1.25}},
    "delay": {"actuator/delay": {"tau": 0.025}},
    "inertia": {"geometry/inertia": {"scale": 1.5}},
    "payload": {"geometry/payload": {"mass": 1.0, "height": 0.5}},
}
EXAMPLES = {
    "nothing_missing": (),
    "one_effect": ("translation/coulomb",),
    "two_effects": ("actuator/delay",),
    "pendulum": ("pitch/coulomb",),
}
RULES = PlausibilityRules()
SLIPS_OF = {kind: [mistake.undone for mistake in mistakes(nominal_model(kind), RULES)] for kind in ("wip", "pendulum")}
BAD_UNITS = (
    Mistake("", "body mass in g", "", parameters={"body_mass": 1e-3}),
    Mistake("", "inertia in g m^2", "", parameters={"body_inertia": 1e-3}),
    Mistake("", "inertia in kg cm^2", "", parameters={"body_inertia": 1e-4}),
    Mistake("", "height in mm", "", parameters={"com_height": 1e-3}),
    Mistake("", "height in cm", "", parameters={"com_height": 1e-2}),
)


def checked(model: Model, recordings: Recordings, effects: tuple[str, ...] = ()) -> None:
    """Ask whether the model is plausible, where these effects are the best that could be added."""
    data = RecordingBatch.of(recordings, model.plant)
    setting = Setting(model, {}, scales_of(model, recordings))
    fitter = InnovationFitter(InnovationsModel.of(AnalyticSimulator(threads=1), data, model))
    force = np.array([1e-3 * setting.scales[site].force for site in model.plant.joints])
    levels = NoiseLevels(force, sensor_noise(recordings, model.plant))
    nominal = fitted(fitter, setting, (), levels)
    best = fitted(fitter, setting, effects, nominal.levels) if effects else nominal
    check_plausible(fitter, setting, nominal, best, "robot.yaml")


def fitted(fitter: InnovationFitter, setting: Setting, effects: tuple[str, ...], levels: NoiseLevels) -> Fit:
    return fitter.converged(fitter.fit(Hypothesis.of(setting, effects, {}), levels), rounds=2)


def with_slip(mistake: Mistake, model: Model, recordings: Recordings) -> tuple[Model, Recordings]:
    """What an owner has who makes a slip: the inverse of putting it right."""
    columns = {name: (1.0 / factor, -offset / factor) for name, (factor, offset) in mistake.columns.items()}
    made = Mistake("", "", "", columns, {name: 1.0 / factor for name, factor in mistake.parameters.items()})
    return made.model(model), tuple(made.recording(r) for r in recordings)


def example(folder: Path) -> tuple[Model, Recordings]:
    source = RecordingSource(path=str(folder / "visible"))
    return source.describe().model, tuple(r.between(r.t[0], r.t[0] + 3.0) for r in source.load()[:3])


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n == "friction" else []) for n in MISSING]
)
def test_missing_physics_is_no_mistake(name: str, fresh_seed: int):
    model = nominal_model("wip")
    recordings = Robot(model.with_effects(MISSING[name])).record(np.random.default_rng(fresh_seed), 1)
    checked(model, recordings, tuple(MISSING[name]))


@pytest.mark.parametrize(
    "name", [n if n in ("nothing_missing", "pendulum") else pytest.param(n, marks=pytest.mark.slow) for n in EXAMPLES]
)
def test_examples_are_plausible(name: str, examples: Path):
    checked(*example(examples / name), EXAMPLES[name])


@pytest.mark.slow
@pytest.mark.parametrize("undone", SLIPS_OF["wip"])
def test_mistakes_in_the_log_of_a_wip_are_named(undone: str, fresh_seed: int):
    model = nominal_model("wip")
    recordings = Robot(model.with_effects(MISSING["gain"])).record(np.random.default_rng(fresh_seed), 1)
    mistake = next(mistake for mistake in mistakes(model, RULES) if mistake.undone == undone)
    with pytest.raises(
        InputError, match=f"^robot.yaml: the recordings contradict its {mistake.contradicted} .*{undone}"
    ):
        checked(*with_slip(mistake, model, recordings), ("translation/viscous",))


@pytest.mark.parametrize("undone", SLIPS_OF["pendulum"])
def test_mistakes_in_the_log_of_a_pendulum_are_named(undone: str, fresh_seed: int):
    model = nominal_model("pendulum")
    recordings = Robot(model.with_effects({"pitch/coulomb": {"F_c": 0.2}})).record(np.random.default_rng(fresh_seed), 1)
    mistake = next(mistake for mistake in mistakes(model, RULES) if mistake.undone == undone)
    with pytest.raises(InputError, match=f"with {undone}"):
        checked(*with_slip(mistake, model, recordings), ("pitch/viscous",))


@pytest.mark.parametrize("mistake", BAD_UNITS, ids=lambda mistake: mistake.undone)
@pytest.mark.parametrize("kind", [pytest.param("wip", marks=pytest.mark.slow), "pendulum"])
def test_numbers_in_a_wrong_unit_are_named(kind: str, mistake: Mistake, fresh_seed: int):
    model = nominal_model(kind)
    recordings = Robot(model).record(np.random.default_rng(fresh_seed), 1)
    (name,) = mistake.parameters
    with pytest.raises(InputError, match=f"write {name}: {model.parameters[name]:.5g} if it is in"):
        checked(*with_slip(mistake, model, recordings))


@pytest.mark.parametrize("name", [pytest.param("two_effects", marks=pytest.mark.slow), "pendulum"])
def test_a_reversed_command_of_an_example_is_named(name: str, examples: Path):
    model, recordings = example(examples / name)
    mistake = mistakes(model, RULES)[0]
    with pytest.raises(InputError, match=r"reverse it with signals: {u: {column: u, scale: -1}}"):
        checked(*with_slip(mistake, model, recordings), ("actuator/gain",))


def test_a_sound_body_has_no_number_in_a_wrong_unit():
    for kind in ("wip", "cartpole", "pendulum", "linear_axis", "double_pendulum"):
        assert not any(mistake.parameters for mistake in mistakes(nominal_model(kind), RULES))
