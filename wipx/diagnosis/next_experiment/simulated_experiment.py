"""An experiment on the completed model: the loop with its controller and its sensors' noise, as it would be logged."""

from dataclasses import dataclass, replace

import numpy as np

from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.next_experiment.excitations import DURATION, Excitation, Reach, payload_height, rate_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Rollouts, StateFeedback

FURTHER = 2.0  # times the recorded travel that an experiment may take
STRONGER = 1.4  # times the largest recorded command
HALVINGS = 3
AIMED = 3  # simulations that a size may take to reach a command
EVENT = "geometry/payload_event"


@dataclass(frozen=True)
class SimulatedRun:
    """An excitation that the robot stands, and what it would leave.

    Attributes:
        excitation: With its final size.
        recording: As logged.
        command: Largest command [N or N m].
    """

    excitation: Excitation
    recording: Recording
    command: float


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

    def tried(self, excitation: Excitation, rng: np.random.Generator) -> SimulatedRun | None:
        """The excitation at the largest size that keeps within the robot's reach; None where there is none."""
        noise = self._noise(rng)
        aimed = self._aimed(excitation, noise)
        for _ in range(HALVINGS + 1):
            recording = self._recorded(aimed, noise)
            command = float(np.abs(recording.stack(self.model.plant.commands)).max())
            if self._within_reach(recording, command):
                return SimulatedRun(aimed, recording, command)
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
        return bool(np.all(travel <= FURTHER * self.reach.travel) and command <= STRONGER * self.reach.command)

    def _noise(self, rng: np.random.Generator) -> np.ndarray:
        """Of what the sensors show at every row of the controller, shape (K + 1, 2 joints)."""
        deviations = np.zeros(2 * self.data.joints)
        deviations[self.data.channels] = self.levels.sensor
        return rng.normal(size=(round(DURATION * self._rate) + 1, len(deviations))) * deviations

    @property
    def _rate(self) -> float:
        """Of the rows that are simulated [Hz]."""
        return self.rate if self.feedback is not None else self._log_rate

    @property
    def _log_rate(self) -> float:
        return float(np.median([r.rate for r in self.data.recordings]))

    def _recorded(self, excitation: Excitation, noise: np.ndarray) -> Recording:
        plant = self.model.plant
        every = max(1, round(self._rate / self._log_rate))
        inputs = Inputs.regular(DURATION, self._rate, len(plant.commands))
        run = self._run(excitation, inputs, noise)
        rows = len(inputs.t) // every * every
        at = np.arange(0, rows - every, every)
        shown = np.concatenate([run.coordinates, run.rates], axis=1)[:, :, 0, 0] + noise
        names = (*plant.coordinates, *plant.rates)
        columns = {"t": inputs.t[at, 0], **{names[c]: shown[at, c] for c in self.data.channels}}
        for c, name in enumerate(plant.commands):
            columns[name] = run.commands[: rows - every, c, 0, 0].reshape(-1, every).mean(axis=1)
        return Recording(excitation.name, columns, "simulated", every)

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


def loaded(hypothesis: Hypothesis, mass: float) -> Hypothesis:
    """A hypothesis about the robot with a known mass on it [kg]."""
    if mass == 0.0:
        return hypothesis
    space = hypothesis.space
    payload = {"mass": mass, "height": payload_height(space.model), "t0": 0.0}
    return replace(hypothesis, space=replace(space, model=space.model.with_effects({EVENT: payload})))
