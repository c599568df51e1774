"""Motions of a robot from a model file, simulated on the completed model as they would be logged.

A torque drive follows its reference under PD control with the gravity of the reference added (Takegaki, Arimoto 1981;
Kelly, Santibanez, Loria 2005, Control of Robot Manipulators in Joint Space, ch. 8), or under the controller that the
owner describes. A position drive takes the reference as its target.
"""

from dataclasses import dataclass, replace

import numpy as np

from wipx.core.model import ModelBatch
from wipx.core.plant import Plant
from wipx.core.tree import Tree
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.next_experiment.envelope import Envelope, asked_forces
from wipx.diagnosis.next_experiment.excitations import DURATION, REFERENCE_RATE
from wipx.diagnosis.next_experiment.simulated_experiment import SimulatedRun, log_rate, logged, noise_of
from wipx.diagnosis.next_experiment.tree_excitations import Motion, motions_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import StateFeedback
from wipx.sim.tree.inverse import needed_forces

BANDWIDTH = 2.0 * np.pi * 2.0  # [rad/s] of the PD control
SAMPLES = 10.0  # of the loop at least in 1/bandwidth
SMALLER, ATTEMPTS = 0.6, 5  # factor by which a motion that leaves the limits shrinks, and how often it is simulated
OPEN = 1e-6  # gain by which a position drive's target answers to the measured position: as good as none


@dataclass(frozen=True)
class TreeBench:
    """Where motions of a robot from a model file are simulated.

    Attributes:
        simulator: The engine.
        hypothesis: The completed model.
        data: The recordings so far.
        envelope: What the joints may do.
        levels: Noise.
        feedback: The controller and its rate [Hz]; None for the PD control.
    """

    simulator: AnalyticSimulator
    hypothesis: Hypothesis
    data: RecordingBatch
    envelope: Envelope
    levels: NoiseLevels
    feedback: tuple[StateFeedback, float] | None

    @property
    def plant(self) -> Plant:
        """The robot."""
        return self.data.plant

    @property
    def rate(self) -> float:
        """Of the controller [Hz]."""
        return self.feedback[1] if self.feedback is not None else log_rate(self.data)

    def trials(self, rng: np.random.Generator) -> list[SimulatedRun]:
        """The motions that stay within the limits, each as large as it can be."""
        runs = [self.tried(motion, rng) for motion in motions_of(len(self.plant.actuated), rng)]
        return [run for run in runs if run is not None]

    def tried(self, motion: Motion, rng: np.random.Generator) -> SimulatedRun | None:
        """A motion at the largest size that keeps within the limits; None where there is none."""
        plant = self.plant
        inputs = Inputs.regular(DURATION, self.rate, len(plant.commands))
        noise = noise_of(self.data, self.levels, len(inputs.t), rng)
        for _ in range(ATTEMPTS):
            q, v = self.reference(motion, inputs.t[:-1, 0])
            feedback, references = self._controller(q, v)
            initial = np.concatenate([q[0], np.zeros(len(q[0]))])[:, None, None]
            run = self.simulator.close_loop(
                ModelBatch(self.hypothesis.model), inputs, initial, feedback, references, noise[:-1, :, None, None]
            )
            commands = run.commands[:, :, 0, 0]
            forces = asked_forces(plant, commands, run.coordinates[:-1, :, 0, 0], run.rates[:-1, :, 0, 0])
            if self.envelope.holds(run.coordinates[:, :, 0, 0], run.rates[:, :, 0, 0], forces) and np.all(
                (q >= self.envelope.low) & (q <= self.envelope.high)
            ):
                recording = logged(motion.name, run, inputs, noise, self.data)
                return SimulatedRun(motion.name, self._how(motion, forces), recording, self._prescribed(motion))
            motion = replace(motion, size=SMALLER * motion.size)
        return None

    def reference(self, motion: Motion, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and rates of all joints at regular times, shape (rows, joints); passive joints begin at rest."""
        plant, envelope = self.plant, self.envelope
        start = [np.median([r[name][0] for r in self.data.recordings]) for name in plant.coordinates]
        q, v = np.tile(start, (len(t), 1)), np.zeros((len(t), len(start)))
        driven = [plant.joints.index(joint) for joint in plant.actuated]
        q[:, driven] = envelope.middle[driven] + envelope.half[driven] * motion.size * motion.course(t)
        v[:, driven] = envelope.half[driven] * motion.rate(t)
        return q, v

    def _controller(self, q: np.ndarray, v: np.ndarray) -> tuple[StateFeedback, np.ndarray]:
        """The feedback and its references, shape (rows, 2 joints, 1); gravity is added by moving the reference."""
        plant = self.plant
        references = np.concatenate([q, v], axis=1)
        if self.feedback is not None:
            return self.feedback[0], references[:, :, None]
        assert plant.tree is not None
        stiffness, damping = pd_gains(plant.tree, self.envelope.middle, self.rate)
        gravity = needed_forces(plant.tree, q, np.zeros_like(q), np.zeros_like(q))
        gains = np.zeros((len(plant.actuated), 2 * len(plant.joints)))
        for c, joint in enumerate(plant.actuated):
            drive, j = plant.drives[joint], plant.joints.index(joint)
            if drive.kind == "position":
                gains[c, j] = OPEN
                references[:, j] /= OPEN
            else:
                gains[c, [j, len(plant.joints) + j]] = stiffness[j] / drive.gain, damping[j] / drive.gain
                references[:, j] += gravity[:, j] / stiffness[j]
        return StateFeedback(gains), references[:, :, None]

    def _how(self, motion: Motion, forces: np.ndarray) -> str:
        plant, half = self.plant, self.envelope.half
        sizes = {joint: motion.size * half[plant.joints.index(joint)] for joint in plant.actuated}
        reached = dict(zip(plant.actuated, np.abs(forces).max(axis=0), strict=True))
        each = [
            f"{joint} +-{sizes[joint]:.2g} {plant.unit_of(plant.columns[joint])} "
            f"(at most {reached[joint]:.2g} {'N' if joint in plant.sliding else 'N m'})"
            for joint in plant.actuated
        ]
        return (
            f"Move the robot slowly to the first row of next_experiment.csv, let its joints follow that file for "
            f"{DURATION:g} s and record: {motion.shape}, {', '.join(each)}"
        )

    def _prescribed(self, motion: Motion) -> dict[str, np.ndarray]:
        """Columns of the file that the robot follows, time first: targets of position drives, else references."""
        t = np.arange(round(DURATION * REFERENCE_RATE) + 1) / REFERENCE_RATE
        q, v = self.reference(motion, t)
        columns = {"t": t}
        for command, joint in zip(self.plant.commands, self.plant.actuated, strict=True):
            j = self.plant.joints.index(joint)
            if self.plant.drives[joint].kind == "position" and self.feedback is None:
                columns[command] = q[:, j]
            else:
                columns[f"{self.plant.coordinates[j]}_ref"] = q[:, j]
                columns[f"{self.plant.rates[j]}_ref"] = v[:, j]
        return columns


def pd_gains(tree: Tree, posture: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and damping of each joint, critically damped about a posture, shape (joints,) each.

    Args:
        tree: The robot.
        posture: Positions, shape (joints,) [rad or m].
        rate: Of the controller [Hz].
    """
    joints = len(posture)
    still = np.tile(posture, (joints + 1, 1))
    forces = needed_forces(tree, still, np.zeros_like(still), np.vstack([np.zeros(joints), np.eye(joints)]))
    inertia = np.diag(forces[1:] - forces[0])
    bandwidth = min(BANDWIDTH, rate / SAMPLES)
    return inertia * bandwidth**2, 2.0 * inertia * bandwidth
