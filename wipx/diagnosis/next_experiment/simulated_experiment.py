"""An experiment on the completed model: the loop with its controller and its sensors' noise, as it would be logged."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.next_experiment.envelope import MORE_FORCE, MORE_TRAVEL
from wipx.diagnosis.next_experiment.excitations import (
    DURATION,
    Excitation,
    Reach,
    excitations_for,
    how,
    payload_height,
    prescribed,
    rate_of,
)
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Rollouts, StateFeedback

HALVINGS = 3
AIMED = 3  # simulations that a size may take to reach a command
EVENT = "geometry/payload_event"


@dataclass(frozen=True)
class SimulatedRun:
    """An excitation that the robot stands, and what it would leave.

    Attributes:
        name: Of the menu.
        how: What a person does, one sentence.
        recording: As logged.
        reference: Columns of the file that the robot follows, time first; none where its reference stays at zero.
        mass: Known mass that is added to the body [kg].
        release: Coordinate of the last joint from which the robot is released [rad, or m without a pitch].
    """

    name: str
    how: str
    recording: Recording
    reference: Mapping[str, np.ndarray]
    mass: float = 0.0
    release: float = 0.0


@dataclass(frozen=True)
class Bench:
    """Where experiments are simulated.

    Attributes:
        simulator: The engine.
        hypothesis: The completed model.
        data: The recordings so far.
        reach: How far the robot went in them.
        levels: Noise.
        feedback: The controller; None without one.
        rate: Of the controller [Hz].
    """

    simulator: AnalyticSimulator
    hypothesis: Hypothesis
    data: RecordingBatch
    reach: Reach
    levels: NoiseLevels
    feedback: StateFeedback | None
    rate: float

    @property
    def model(self) -> Model:
        """The completed model."""
        return self.hypothesis.model

    def trials(self, rng: np.random.Generator, *, masses: bool) -> list[SimulatedRun]:
        """The excitations that keep within the robot's reach; `masses` says whether known ones can be added to it."""
        menu = excitations_for(self.model, self.reach, rng, closed=self.feedback is not None)
        runs = [self.tried(excitation, rng) for excitation in menu if masses or not excitation.mass]
        return [run for run in runs if run is not None]

    def tried(self, excitation: Excitation, rng: np.random.Generator) -> SimulatedRun | None:
        """The excitation at the largest size that keeps within the robot's reach; None where there is none."""
        noise = noise_of(self.data, self.levels, round(DURATION * self._rate) + 1, rng)
        aimed = self._aimed(excitation, noise)
        for _ in range(HALVINGS + 1):
            recording = self._recorded(aimed, noise)
            command = float(np.abs(recording.stack(self.model.plant.commands)).max())
            if self._within_reach(recording, command):
                closed = self.feedback is not None
                sentence = how(aimed, self.model, command, closed=closed)
                reference = prescribed(self.model.plant, aimed, closed=closed)
                return SimulatedRun(aimed.name, sentence, recording, reference, aimed.mass, aimed.tilt)
            if not aimed.shrinks:
                break
            aimed = replace(aimed, size=0.5 * aimed.size, tilt=0.5 * aimed.tilt)
        return None

    def _aimed(self, excitation: Excitation, noise: np.ndarray) -> Excitation:
        """With the size that takes the command where it is aimed at; commands grow almost in proportion."""
        aim = excitation.command
        if aim is None:
            return excitation
        for _ in range(AIMED):
            recording = self._recorded(excitation, noise)
            command = float(np.abs(recording.stack(self.model.plant.commands)).max())
            if not np.isfinite(command) or command <= 0.0:
                break
            excitation = replace(excitation, size=excitation.size * min(aim / command, 10.0))
        return excitation

    def _within_reach(self, recording: Recording, command: float) -> bool:
        travel = np.ptp(recording.stack(self.model.plant.coordinates), axis=0)
        return bool(np.all(travel <= MORE_TRAVEL * self.reach.travel) and command <= MORE_FORCE * self.reach.command)

    @property
    def _rate(self) -> float:
        """Of the rows that are simulated [Hz]."""
        return self.rate if self.feedback is not None else log_rate(self.data)

    def _recorded(self, excitation: Excitation, noise: np.ndarray) -> Recording:
        inputs = Inputs.regular(DURATION, self._rate, len(self.model.plant.commands))
        return logged(excitation.name, self._run(excitation, inputs, noise), inputs, noise, self.data)

    def _run(self, excitation: Excitation, inputs: Inputs, noise: np.ndarray) -> Rollouts:
        plant = self.model.plant
        joints = len(plant.joints)
        t = inputs.t[:-1, 0]
        batch = ModelBatch(loaded(self.hypothesis, excitation.mass).model)
        course = excitation.size * excitation.course(t)
        initial = np.zeros((2 * joints, 1, 1))
        if self.feedback is None:
            initial[:joints, 0, 0] = [np.median([r[c][0] for r in self.data.recordings]) for c in plant.coordinates]
            commands = np.repeat(course[:, None, None], len(plant.commands), axis=1)
            return self.simulator.replay(batch, replace(inputs, commands=commands), initial)
        initial[joints - 1] = excitation.tilt
        references = np.zeros((len(t), 2 * joints, 1))
        for joint in map(plant.joints.index, plant.actuated):
            references[:, joint, 0] = course
            references[:, joints + joint, 0] = rate_of(excitation, t)
        return self.simulator.close_loop(batch, inputs, initial, self.feedback, references, noise[:-1, :, None, None])


def log_rate(data: RecordingBatch) -> float:
    """At which the robot is logged [Hz]."""
    return float(np.median([r.rate for r in data.recordings]))


def noise_of(data: RecordingBatch, levels: NoiseLevels, rows: int, rng: np.random.Generator) -> np.ndarray:
    """Of what the sensors show at every row of the controller, shape (rows, 2 joints)."""
    deviations = np.zeros(2 * data.joints)
    deviations[data.channels] = levels.sensor
    return rng.normal(size=(rows, len(deviations))) * deviations


def logged(name: str, run: Rollouts, inputs: Inputs, noise: np.ndarray, data: RecordingBatch) -> Recording:
    """A run as the log has it: at its rate, with the columns of the recordings so far and mean commands.

    Args:
        name: Of the recording.
        run: One rollout.
        inputs: Rows of the controller, regular.
        noise: Of the sensors, shape (rows, 2 joints).
        data: The recordings so far.
    """
    plant = data.plant
    rate = 1.0 / float(inputs.t[1, 0] - inputs.t[0, 0])
    every = max(1, round(rate / log_rate(data)))
    rows = len(inputs.t) // every * every
    at = np.arange(0, rows - every, every)
    shown = np.concatenate([run.coordinates, run.rates], axis=1)[:, :, 0, 0] + noise
    names = (*plant.coordinates, *plant.rates)
    columns = {"t": inputs.t[at, 0], **{names[c]: shown[at, c] for c in data.channels}}
    for c, command in enumerate(plant.commands):
        columns[command] = run.commands[: rows - every, c, 0, 0].reshape(-1, every).mean(axis=1)
    return Recording(name, columns, "simulated", every)


def loaded(hypothesis: Hypothesis, mass: float) -> Hypothesis:
    """A hypothesis about the robot with a known mass on it [kg]."""
    if mass == 0.0:
        return hypothesis
    space = hypothesis.space
    payload = {"mass": mass, "height": payload_height(space.model), "t0": 0.0}
    return replace(hypothesis, space=replace(space, model=space.model.with_effects({EVENT: payload})))
