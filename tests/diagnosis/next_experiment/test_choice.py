"""The next experiment separates what it says it separates, within what the robot has shown to stand."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from identify.emulated_robot import RATE, Robot, controller, nominal_model

from wipx.core.model import Model
from wipx.core.next_experiment import NextExperiment
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.next_experiment.choice import Question, next_experiment
from wipx.diagnosis.next_experiment.envelope import MORE_FORCE, MORE_TRAVEL
from wipx.diagnosis.next_experiment.excitations import DURATION, Reach, excitations_for
from wipx.diagnosis.next_experiment.simulated_experiment import Bench
from wipx.identify.noise import sensor_noise
from wipx.identify.parameter_space import scales_of
from wipx.sim.analytic import AnalyticSimulator

SIMULATOR = AnalyticSimulator(threads=1)


class Case:
    """Recordings of an emulated robot, and fits to them."""

    def __init__(self, kind: str, effects: dict[str, dict[str, float]], seed: int = 3) -> None:
        self.nominal: Model = nominal_model(kind)
        self.robot = Robot(self.nominal.with_effects(effects))
        self.recordings = self.robot.record(np.random.default_rng(seed))
        self.setting = Setting(self.nominal, {}, scales_of(self.nominal, self.recordings))
        self.data = RecordingBatch.of(self.recordings, self.nominal.plant)
        self.fitter = self.fitter_of(self.data)
        self.fit = self.fitted(tuple(effects))

    def fitter_of(self, data: RecordingBatch) -> InnovationFitter:
        return InnovationFitter(InnovationsModel.of(SIMULATOR, data, self.nominal))

    def fitted(self, effects: tuple[str, ...]) -> Fit:
        force = np.array([1e-4 * self.setting.scales[site].force for site in self.nominal.plant.joints])
        levels = NoiseLevels(force, sensor_noise(self.recordings, self.nominal.plant))
        return self.fitter.converged(self.fitter.fit(Hypothesis.of(self.setting, effects, {}), levels))

    def ask(self, *rivals: Fit, parameters: tuple[str, ...] = (), closed: bool = True) -> NextExperiment | None:
        feedback = controller(self.nominal.plant.kind) if closed else None
        question = Question("Which is it?", rivals, parameters)
        rng = np.random.default_rng(1)
        return next_experiment(question, self.fit, self.setting, self.data, SIMULATOR, feedback, RATE, rng)


@cache
def slow_actuator() -> Case:
    """A wip whose actuator is late, which a lag imitates."""
    return Case("wip", {"actuator/delay": {"tau": 0.004}})


@cache
def late_or_lagging() -> NextExperiment:
    answer = slow_actuator().ask(slow_actuator().fitted(("actuator/lag",)))
    assert answer is not None
    return answer


def test_menu_is_sorted_and_the_best_comes_first():
    answer = late_or_lagging()
    separations = [experiment.separation for experiment in answer.menu]
    assert separations == sorted(separations, reverse=True)
    assert answer.best == answer.menu[0]
    assert len({experiment.name for experiment in answer.menu}) == len(answer.menu) >= 5


def test_reference_is_what_the_best_experiment_says():
    answer = late_or_lagging()
    t = answer.reference["t"]
    assert set(answer.reference) == {"t", "x_ref", "x_dot_ref"}
    assert np.allclose(np.diff(t), 0.01)
    assert t[-1] == pytest.approx(DURATION)
    assert f"{np.abs(answer.reference['x_ref']).max():.1g}"[:4] in answer.best.how
    assert "10 s" in answer.best.how


def test_answer_depends_on_the_generator_alone():
    again = slow_actuator().ask(slow_actuator().fitted(("actuator/lag",)))
    assert again is not None
    assert again.menu == late_or_lagging().menu


def test_predicted_separation_is_met_by_the_recording(fresh_seed: int):
    case = slow_actuator()
    rng = np.random.default_rng(fresh_seed)
    bench = Bench(
        SIMULATOR, case.fit.hypothesis, case.data, Reach.of(case.data), case.fit.levels, controller("wip"), RATE
    )
    chirp = next(e for e in excitations_for(case.nominal, bench.reach, rng, closed=True) if e.name == "chirp")
    trial = bench.tried(chirp, rng)
    assert trial is not None
    predicted = next(e.separation for e in late_or_lagging().menu if e.name == "chirp")
    met = separation_of(case, trial.recording, case.fitted(("actuator/lag",)))
    assert 0.4 * predicted < met < 2.5 * predicted  # noise and its levels are fitted anew


def separation_of(case: Case, recording: Recording, rival: Fit) -> float:
    """Of the completed model from a rival, both fitted to one recording."""
    fitter = case.fitter_of(RecordingBatch.of((recording,), case.nominal.plant))
    right, wrong = (fitter.fit(f.hypothesis, case.fit.levels) for f in (case.fit, rival))
    return float(np.sqrt(2.0 * max(right.log_likelihood - wrong.log_likelihood, 0.0)))


def test_what_no_recording_can_tell_apart_needs_no_experiment():
    case = Case("wip", {"geometry/com_offset": {"theta_eq": 0.01}})
    assert case.ask(case.fitted(("sensor_theta/bias",))) is None


def test_an_equivalent_rival_does_not_hide_the_others():
    case = Case("wip", {"geometry/com_offset": {"theta_eq": 0.01}})
    answer = case.ask(case.fitted(("sensor_theta/bias",)), case.fitted(("environment/rail_tilt",)))
    assert answer is not None
    assert answer.best.separation > 3.0


def test_no_question_no_experiment():
    assert slow_actuator().ask() is None


def test_a_number_is_known_better_afterwards():
    case = slow_actuator()
    answer = case.ask(parameters=("actuator/delay.tau",))
    plain = case.fit.hypothesis
    deviation = float(np.sqrt(np.linalg.inv(case.fit.information))[0, 0])
    moved = plain.at(np.clip(plain.cube + deviation, 0.0, 1.0))
    before = plain.values["actuator/delay.tau"] / (
        moved.values["actuator/delay.tau"] - plain.values["actuator/delay.tau"]
    )
    assert answer is not None
    assert all(experiment.separation > 0.2 * before for experiment in answer.menu)  # robust errors are larger
    assert answer.best.separation > before


def test_without_a_controller_the_commands_are_shaped():
    case = Case("double_pendulum", {"joint1/viscous": {"sigma": 0.05}})
    answer = case.ask(case.fitted(("joint1/coulomb",)), closed=False)
    assert answer is not None
    assert set(answer.reference) == {"t", "u1", "u2"}
    assert answer.best.how.startswith("Switch the controller off")


def test_an_upright_pendulum_is_not_let_go():
    case = Case("pendulum", {"pitch/viscous": {"sigma": 0.05}})
    assert case.ask(case.fitted(("pitch/coulomb",)), closed=False) is None


def largest(recording: Recording) -> float:
    """Largest command [N]."""
    return float(np.abs(recording["u"]).max())


@pytest.mark.parametrize("kind", ["wip", "linear_axis"])
def test_experiments_stay_within_reach(kind: str, fresh_seed: int):
    case = Case(kind, {"translation/coulomb": {"F_c": 1.0}})
    reach = Reach.of(case.data)
    bench = Bench(SIMULATOR, case.fit.hypothesis, case.data, reach, case.fit.levels, controller(kind), RATE)
    rng = np.random.default_rng(fresh_seed)
    tried = [
        bench.tried(replace(e, size=8.0 * e.size), rng) for e in excitations_for(case.nominal, reach, rng, closed=True)
    ]
    trials = [trial for trial in tried if trial is not None]
    assert trials
    for trial in trials:
        travel = np.ptp(trial.recording.stack(case.nominal.plant.coordinates), axis=0)
        assert np.all(travel <= MORE_TRAVEL * reach.travel)
        assert largest(trial.recording) <= MORE_FORCE * reach.command


def test_steps_take_the_command_where_it_is_aimed():
    case = slow_actuator()
    recorded = Reach.of(case.data)
    reach = replace(recorded, travel=10.0 * recorded.travel)
    bench = Bench(SIMULATOR, case.fit.hypothesis, case.data, reach, case.fit.levels, controller("wip"), RATE)
    rng = np.random.default_rng(0)
    steps = next(e for e in excitations_for(case.nominal, reach, rng, closed=True) if e.name == "steps")
    trial = bench.tried(steps, rng)
    assert trial is not None
    assert largest(trial.recording) == pytest.approx(
        0.9 * reach.command, rel=0.1
    )  # the loop is linear but for its noise


def test_commands_that_never_came_are_not_scaled():
    phases = np.random.default_rng(0)
    assert excitations_for(nominal_model("pendulum"), Reach(np.array([0.3]), 0.0), phases, closed=False) == ()
