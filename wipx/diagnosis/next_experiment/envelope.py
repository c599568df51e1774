"""What the joints of a robot from a model file may do in the next experiment: position, speed and force."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.limits import JointLimits
from wipx.core.plant import Plant
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch

MORE_TRAVEL = 2.0  # times the recorded travel and speed that an experiment may take
MORE_FORCE = 1.4  # times the largest recorded force or command
ACROSS = 0.05  # [s] over which recorded speeds are taken, so that noise does not count


@dataclass(frozen=True)
class Envelope:
    """Position, speed and force that an experiment may take; arrays of shape (joints,), forces (drives,).

    Attributes:
        low: Lowest position [rad or m].
        high: Highest position.
        speed: Largest speed [rad/s or m/s].
        force: Largest force that a drive is asked for [N m or N].
        middle: Of the recorded positions, within `low` and `high`.
        half: Half the recorded range, or what of it the limits leave.
    """

    low: np.ndarray
    high: np.ndarray
    speed: np.ndarray
    force: np.ndarray
    middle: np.ndarray
    half: np.ndarray

    @classmethod
    def of(cls, data: RecordingBatch, given: Mapping[str, JointLimits]) -> "Envelope":
        """The narrowest of what the recordings have shown, the model file says and the user gives.

        Args:
            data: The recordings.
            given: The user's limits, by joint.
        """
        plant = data.plant
        assert plant.tree is not None
        positions = [r.stack(plant.coordinates) for r in data.recordings]
        rates = [_slopes(r.t, q) for r, q in zip(data.recordings, positions, strict=True)]
        lowest = np.min([q.min(axis=0) for q in positions], axis=0)
        highest = np.max([q.max(axis=0) for q in positions], axis=0)
        commands = [r.stack(plant.commands) for r in data.recordings]
        asked = [asked_forces(plant, u, q, v) for u, q, v in zip(commands, positions, rates, strict=True)]
        known = [
            JointLimits(link.limits, link.speed, link.effort).within(given.get(link.joint, JointLimits()))
            for link in plant.tree.links
        ]
        lows, highs = np.array([limits.position or (-np.inf, np.inf) for limits in known]).T
        speeds = _or_none(limits.speed for limits in known)
        efforts = dict(zip(plant.joints, _or_none(limits.force for limits in known), strict=True))
        drives = _or_none(plant.drives[joint].limit for joint in plant.actuated)
        half = 0.5 * (highest - lowest)
        low = np.maximum(lows, lowest - (MORE_TRAVEL - 1.0) * half)
        high = np.minimum(highs, highest + (MORE_TRAVEL - 1.0) * half)
        fastest = np.max([np.abs(v).max(axis=0) for v in rates], axis=0)
        strongest = np.max([np.abs(force).max(axis=0) for force in asked], axis=0)
        return cls(
            low,
            high,
            np.minimum(speeds, MORE_TRAVEL * fastest),
            np.minimum(np.minimum(drives, [efforts[joint] for joint in plant.actuated]), MORE_FORCE * strongest),
            np.clip(0.5 * (lowest + highest), low, high),
            np.minimum(half, 0.5 * (high - low)),
        )

    def holds(self, positions: np.ndarray, rates: np.ndarray, forces: np.ndarray) -> bool:
        """Whether a run stays within, arrays of shape (rows, joints) and (rows, drives)."""
        return bool(
            np.all((positions >= self.low) & (positions <= self.high))
            and np.all(np.abs(rates) <= self.speed)
            and np.all(np.abs(forces) <= self.force)
        )


def asked_forces(plant: Plant, commands: np.ndarray, positions: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Forces that commands ask of the drives before any limit, shape (rows, drives) [N m or N].

    Args:
        plant: The robot.
        commands: Shape (rows, drives).
        positions: Shape (rows, joints).
        rates: Shape (rows, joints).
    """
    forces = np.empty(commands.shape)
    for c, joint in enumerate(plant.actuated):
        drive, j = plant.drives[joint], plant.joints.index(joint)
        if drive.kind == "position":
            forces[:, c] = drive.kp * (commands[:, c] - positions[:, j]) - drive.kd * rates[:, j]
        else:
            forces[:, c] = drive.gain * commands[:, c]
    return forces


def _slopes(t: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Rates over `ACROSS`, shape (rows, joints)."""
    back = max(1, round(ACROSS / float(np.median(np.diff(t)))))
    before, after = np.maximum(np.arange(len(t)) - back, 0), np.minimum(np.arange(len(t)) + back, len(t) - 1)
    return (positions[after] - positions[before]) / (t[after] - t[before])[:, None]


def _or_none(limits: Iterable[float | None]) -> np.ndarray:
    """Limits as an array; infinite where there is none."""
    return np.array([np.inf if limit is None else limit for limit in limits])
