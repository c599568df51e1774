"""The next experiment of a robot from a model file stays within its limits and settles what is open."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

import numpy as np
import pytest

from wipx.core.drive import Drive
from wipx.core.limits import JointLimits
from wipx.core.model import Model
from wipx.core.next_experiment import NextExperiment
from wipx.core.plant import Plant, robot_plant
from wipx.core.recording import Recording
from wipx.core.tree import Tree
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.innovations_model import InnovationsModel
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.next_experiment.choice import Question, next_experiment
from wipx.diagnosis.next_experiment.envelope import MORE_TRAVEL, Envelope
from wipx.diagnosis.next_experiment.excitations import DURATION
from wipx.diagnosis.next_experiment.tree_excitations import motions_of
from wipx.diagnosis.next_experiment.tree_experiment import TreeBench, pd_gains
from wipx.identify.noise import sensor_noise
from wipx.identify.parameter_space import scales_of
from wipx.recordings.robot_model import read_tree
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

SIMULATOR = AnalyticSimulator(threads=1)
RATE = 100.0  # [Hz]
ARM = """<robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.15 0 0"/><mass value="1.0"/>
<inertia ixx="0.001" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="fore"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
<inertia ixx="0.0005" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="20" velocity="3"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.3 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="8" velocity="4"/></joint></robot>"""


@cache
def arm() -> Plant:
    """A shoulder with a torque drive, an elbow with a position drive."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "arm.urdf"
        file.write_text(ARM, encoding="utf-8")
        tree = read_tree(file)
    return robot_plant(tree, {"shoulder": Drive(), "elbow": Drive("position", kp=20.0, kd=0.6, limit=6.0)})


class Case:
    """Recordings of the arm in a narrow range, and fits to them."""

    def __init__(self, effects: dict[str, dict[str, float]], seed: int = 3) -> None:
        self.nominal = Model(arm(), arm().complete({}, "arm"), {})
        rng = np.random.default_rng(seed)
        model = self.nominal.with_effects(effects)
        self.data = RecordingBatch.of(tuple(recorded(model, f"r{i}.csv", rng) for i in (1, 2)), arm())
        self.setting = Setting(self.nominal, {}, scales_of(self.nominal, self.data.recordings))
        self.fitter = InnovationFitter(InnovationsModel.of(SIMULATOR, self.data, self.nominal))
        self.fit = self.fitted(tuple(effects))

    def fitted(self, effects: tuple[str, ...]) -> Fit:
        force = np.array([1e-4 * self.setting.scales[site].force for site in arm().joints])
        levels = NoiseLevels(force, sensor_noise(self.data.recordings, arm()))
        return self.fitter.converged(self.fitter.fit(Hypothesis.of(self.setting, effects, {}), levels))

    def bench(self, **limits: JointLimits) -> TreeBench:
        envelope = Envelope.of(self.data, limits)
        return TreeBench(SIMULATOR, self.fit.hypothesis, self.data, envelope, self.fit.levels, None)

    def ask(self, *rivals: Fit, parameters: tuple[str, ...] = ()) -> NextExperiment | None:
        question = Question("Which is it?", rivals, parameters)
        rng = np.random.default_rng(1)
        return next_experiment(question, self.fit, self.setting, self.data, SIMULATOR, None, RATE, rng)


def recorded(model: Model, name: str, rng: np.random.Generator) -> Recording:
    """Sines of both joints under PD control of the shoulder."""
    t = np.arange(0.0, 5.0, 1.0 / RATE)
    inputs = Inputs.regular(5.0, RATE, 2)
    stiffness, damping = pd_gains(cast(Tree, arm().tree), np.zeros(2), RATE)

    def controller(time: float, y: np.ndarray) -> np.ndarray:
        goal = 0.3 * np.sin(2.0 * np.pi * np.array([0.4, 0.7]) * time)
        return np.array([stiffness[0] * (goal[0] - y[0]) - damping[0] * y[2], goal[1]])

    run = SIMULATOR.drive(model, inputs, np.zeros(4), controller)
    q = run.coordinates[: len(t), :, 0, 0] + 1e-4 * rng.normal(size=(len(t), 2))
    u = run.commands[: len(t), :, 0, 0]
    return Recording(name, {"t": t, "shoulder": q[:, 0], "elbow": q[:, 1], "u_shoulder": u[:, 0], "u_elbow": u[:, 1]})


@cache
def rubbing() -> Case:
    """The arm with dry friction in its shoulder."""
    return Case({"shoulder/coulomb": {"F_c": 0.3}})


@pytest.mark.parametrize("joints", [1, 6])
def test_motions_begin_at_rest_in_the_middle_and_stay_within_one(joints: int, fresh_seed: int):
    t = np.linspace(0.0, DURATION, 2001)
    for motion in motions_of(joints, np.random.default_rng(fresh_seed)):
        course = motion.course(t)
        assert course.shape == (len(t), joints)
        assert np.allclose(course[0], 0.0)
        assert np.allclose(motion.rate(t)[0], 0.0, atol=0.02)
        assert np.all(np.abs(course).max(axis=0) == pytest.approx(1.0, abs=0.01))


def test_single_joints_step_one_after_another():
    steps = next(m for m in motions_of(4, np.random.default_rng(0)) if m.jumps)
    assert np.all((steps.course(np.linspace(0.0, DURATION, 2001)) != 0.0).sum(axis=1) <= 1)


def test_speeds_of_a_urdf_are_limits():
    tree = arm().tree
    assert tree is not None
    assert [link.speed for link in tree.links] == [3.0, 4.0]
    assert [link.effort for link in tree.links] == [20.0, 8.0]


def test_the_narrowest_limit_counts():
    data = narrow(np.random.default_rng(2))
    given = {"elbow": JointLimits((-0.1, 0.5), speed=0.2, force=0.4)}
    envelope = Envelope.of(data, given)
    assert envelope.low[1] == -0.1
    assert envelope.speed[1] == 0.2
    assert envelope.force[1] == 0.4
    shown = data.recordings[0]["shoulder"]
    assert envelope.high[0] - envelope.low[0] == pytest.approx(MORE_TRAVEL * np.ptp(shown))
    assert not envelope.holds(np.array([[0.0, -0.2]]), np.zeros((1, 2)), np.zeros((1, 2)))
    assert envelope.holds(np.array([[0.0, 0.2]]), np.zeros((1, 2)), np.zeros((1, 2)))


def narrow(rng: np.random.Generator) -> RecordingBatch:
    """A recording that needs no simulation."""
    t = np.arange(0.0, 5.0, 1.0 / RATE)
    waves = {name: 0.3 * np.sin(2.0 * np.pi * 0.5 * t + rng.uniform(0.0, 6.0)) for name in ("shoulder", "elbow")}
    commands = {"u_shoulder": 3.0 * np.cos(t), "u_elbow": waves["elbow"] + 0.1}
    return RecordingBatch.of((Recording("r1.csv", {"t": t, **waves, **commands}),), arm())


@pytest.mark.slow
def test_runs_stay_within_the_limits_of_file_and_user(fresh_seed: int):
    limits = {"elbow": JointLimits((-0.2, 0.25), speed=0.8)}
    bench = rubbing().bench(**limits)
    trials = bench.trials(np.random.default_rng(fresh_seed))
    assert len(trials) >= 3
    for trial in trials:
        q, noise = trial.recording.stack(arm().coordinates), 1e-3
        assert np.all((q >= bench.envelope.low - noise) & (q <= bench.envelope.high + noise))
        assert np.all(q[:, 1] <= 0.25 + noise)
        assert np.abs(trial.recording["u_shoulder"]).max() <= bench.envelope.force[0] <= 20.0


@pytest.mark.slow
def test_no_motion_fits_into_hardly_any_torque():
    assert rubbing().bench(shoulder=JointLimits(force=0.1)).trials(np.random.default_rng(0)) == []


@pytest.mark.slow
def test_a_motion_tells_dry_from_viscous_friction_and_leaves_what_each_drive_takes():
    answer = rubbing().ask(rubbing().fitted(("shoulder/viscous",)))
    assert answer is not None
    assert answer.best.separation > 5.0
    assert set(answer.reference) == {"t", "shoulder_ref", "shoulder_dot_ref", "u_elbow"}
    assert "first row of next_experiment.csv" in answer.best.how


@pytest.mark.slow
def test_a_number_is_known_better_afterwards_and_nothing_is_asked_about_what_no_motion_tells():
    case = rubbing()
    answer = case.ask(parameters=("shoulder/coulomb.F_c",))
    assert answer is not None
    assert answer.best.separation > 10.0
    inertial = Case({"shoulder/rotor_inertia": {"J": 0.05}})
    assert inertial.ask(inertial.fitted(("link_upper/inertia",))) is None  # one number, of the first hinge
