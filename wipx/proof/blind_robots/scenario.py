"""What is drawn for a run beside the robot: excitation, disturbances of the sensors, and which rows are kept.

Everything random is drawn before the run, so that robots that differ in one effect meet the same noise.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from wipx.proof.blind_robots.physics import DRIVEN
from wipx.proof.blind_robots.robots import Robot

VISIBLE = ("release", "sine", "slow", "multisine", "steps", "chirp")
UNSEEN = ("release", "two_sines", "disturbed_steps")
AMPLITUDE = {"wip": 0.12, "cartpole": 0.12, "linear_axis": 0.2, "pendulum": 0.2, "double_pendulum": 0.4}
RELEASED = {"wip": 0.06, "cartpole": 0.06, "linear_axis": 0.25, "pendulum": 0.22, "double_pendulum": 0.6}
LENGTHS = (8.0, 12.0)  # [s]
LIMITS = {"double_pendulum": (3.0, 3.0)}  # others: 2 m and 0.5 rad


@dataclass(frozen=True)
class LogSettings:
    """How a robot's runs are recorded.

    Attributes:
        every: Control periods per row.
        dropped: Share of rows that are missing.
        jitter: Standard deviation of a control period, relative.
        noise: Standard deviation of the sensors' noise by joint [m, rad].
        colour: Time over which the noise of an angle stays alike [s]; 0 for white noise.
        resolution: Of the sensors by joint [m, rad]; 0 for none.
        rate_noise: Standard deviation of the rate sensors' noise by joint [m/s, rad/s].
        rates: Joints whose measured rate is recorded.
        force_noise: Of the recorded force of the drive, relative to the commands; None where it is not recorded.
    """

    every: int
    dropped: float
    jitter: float
    noise: tuple[float, float]
    colour: float
    resolution: tuple[float, float]
    rate_noise: tuple[float, float]
    rates: tuple[int, ...]
    force_noise: float | None


@dataclass(frozen=True, eq=False)
class Scenario:
    """One run, drawn in advance.

    Attributes:
        excitation: Name.
        instants: Control instants, shape (n + 1,) [s]; the log begins at 0.
        rows: Instants that are logged, shape (rows,); the last row's command acts until `end`.
        end: Instant at which the log ends.
        start: Coordinates at which the robot is let go, shape (2,).
        reference: Of coordinates and rates, shape (n, 4).
        extra: Added to the commands, shape (n, 2).
        noise: Of the sensors, shape (n, 2).
        rate_noise: Of the rate sensors, shape (n, 2).
        force_noise: Of the recorded force, relative to the commands, shape (rows,).
        waves: Of unit variance, by joint: forces from outside and wandering of friction, shape (n, 4); zero where
            there are none.
    """

    excitation: str
    instants: np.ndarray
    rows: np.ndarray
    end: int
    start: np.ndarray
    reference: np.ndarray
    extra: np.ndarray
    noise: np.ndarray
    rate_noise: np.ndarray
    force_noise: np.ndarray
    waves: np.ndarray

    @property
    def duration(self) -> float:
        """Time of the last row [s]."""
        return float(self.instants[self.rows[-1]])


def draw_log_settings(kind: str, rng: np.random.Generator, *, poor: bool) -> LogSettings:
    """Settings of an ordinary log, or of a poor one: slow, coarse, with gaps and uneven steps."""
    angle_only = kind in ("pendulum", "double_pendulum")
    fine = rng.uniform(2e-5, 1e-4) if not poor else rng.choice([2e-4, 5e-4, 1e-3])
    coarse_angle = rng.uniform(3e-4, 2e-3) if poor and rng.random() < 0.5 else 0.0
    angle_noise = float(np.exp(rng.uniform(np.log(2e-4), np.log(1e-3))))
    first_noise = angle_noise if kind == "double_pendulum" else float(rng.uniform(5e-6, 5e-5))
    first_step = coarse_angle if kind == "double_pendulum" else float(fine)
    rates = ()
    if rng.random() < 0.2:
        rates = {"linear_axis": (0,), "pendulum": (1,), "double_pendulum": (0, 1)}.get(kind, (1,))
        if not angle_only and kind != "linear_axis" and rng.random() < 0.4:
            rates = (0, 1)
    return LogSettings(
        every=int(rng.integers(3, 7) if poor else rng.integers(1, 5)),
        dropped=float(rng.uniform(0.005, 0.05)) if poor else float(rng.choice([0.0, 0.0, 0.002])),
        jitter=float(rng.uniform(0.01, 0.1)) if poor else float(rng.uniform(0.0, 0.015)),
        noise=(first_noise, angle_noise),
        colour=float(rng.uniform(0.005, 0.05)) if rng.random() < 0.35 else 0.0,
        resolution=(first_step, coarse_angle),
        rate_noise=(float(rng.uniform(1e-3, 5e-3)), float(rng.uniform(1e-3, 8e-3))),
        rates=rates,
        force_noise=float(rng.uniform(0.005, 0.03)) if rng.random() < 0.15 and kind != "double_pendulum" else None,
    )


def draw_scenario(
    robot: Robot,
    settings: LogSettings,
    excitation: str,
    rng: np.random.Generator,
    lengths: tuple[float, float] = LENGTHS,
) -> Scenario:
    """A run of that excitation for a robot; it lasts a time between the two `lengths` [s]."""
    lead = 0.0 if excitation == "release" else rng.uniform(0.05, 0.5)
    first = round(lead * robot.rate)
    count = first + int(rng.uniform(*lengths) * robot.rate)
    steps = (1.0 + settings.jitter * np.clip(rng.standard_normal(count), -3.0, 3.0)) / robot.rate
    instants = np.concatenate(([0.0], np.cumsum(steps)))
    instants -= instants[first]
    logged = np.arange(first, count - settings.every, settings.every)
    kept = rng.random(len(logged)) >= settings.dropped
    kept[[0, -1]] = True
    start, reference, extra = _excite(robot, excitation, instants[:-1], rng)
    white = rng.standard_normal((count, 2))
    noise = white * settings.noise
    if settings.colour > 0.0:
        noise[:, 1] = settings.noise[1] * _coloured(white[:, 1], settings.colour * robot.rate)
        if robot.kind == "double_pendulum":
            noise[:, 0] = settings.noise[0] * _coloured(white[:, 0], settings.colour * robot.rate)
    return Scenario(
        excitation,
        instants,
        logged[kept],
        int(logged[-1]) + settings.every,
        start,
        reference,
        extra,
        noise,
        rng.standard_normal((count, 2)) * settings.rate_noise,
        rng.standard_normal(int(kept.sum())) * (settings.force_noise or 0.0),
        np.zeros((count, 4)),
    )


def _coloured(white: np.ndarray, memory: float) -> np.ndarray:
    """First-order autoregressive noise of unit variance from white noise; `memory` in samples."""
    from scipy.signal import lfilter

    keep = np.exp(-1.0 / memory)
    scaled = np.concatenate((white[:1] / np.sqrt(1.0 - keep**2), white[1:]))
    return np.asarray(lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], scaled))


def _excite(robot: Robot, excitation: str, t: np.ndarray, rng: np.random.Generator):
    """Start, references and extra commands, of shapes (2,), (n, 4) and (n, 2)."""
    kind = robot.kind
    start, reference, extra = np.zeros(2), np.zeros((len(t), 4)), np.zeros((len(t), 2))
    if excitation == "release":
        joints = {"linear_axis": (0,), "double_pendulum": (0, 1)}.get(kind, (1,))
        for joint in joints:
            start[joint] = RELEASED[kind] * rng.uniform(0.5, 1.2) * rng.choice([-1.0, 1.0])
    elif kind != "linear_axis":
        start[1] = rng.normal(0.0, 0.008)
    for joint in DRIVEN[kind]:
        path, push = _SHAPES[excitation](t, rng)
        size = AMPLITUDE[kind] * rng.uniform(0.8, 1.2)
        reference[:, joint] = size * path
        if excitation not in ("steps", "disturbed_steps"):
            reference[:, 2 + joint] = np.gradient(size * path, t)
        extra[:, joint] = abs(robot.gains[joint, joint]) * size * push
    return start, reference, extra


def _release(t: np.ndarray, rng: np.random.Generator):
    return np.zeros_like(t), np.zeros_like(t)


def _sine(t: np.ndarray, rng: np.random.Generator):
    return np.sin(2.0 * pi * rng.uniform(0.32, 0.5) * t), np.zeros_like(t)


def _slow(t: np.ndarray, rng: np.random.Generator):
    return 0.3 * np.sin(2.0 * pi * rng.uniform(0.08, 0.15) * t), np.zeros_like(t)


def _multisine(t: np.ndarray, rng: np.random.Generator):
    return 0.5 * _sum_of_sines(t, rng, 0.1, 0.8, 5), 0.4 * _sum_of_sines(t, rng, 0.5, 6.0, 12)


def _steps(t: np.ndarray, rng: np.random.Generator):
    edges = np.arange(0.0, t[-1] + 3.0, 1.0) + rng.uniform(0.0, 0.8, len(np.arange(0.0, t[-1] + 3.0, 1.0)))
    levels = rng.uniform(-0.8, 0.8, len(edges) + 1)
    return levels[np.searchsorted(edges, t)], np.zeros_like(t)


def _chirp(t: np.ndarray, rng: np.random.Generator):
    low, high = rng.uniform(0.2, 0.4), rng.uniform(4.0, 7.0)
    octaves = np.log(high / low)
    late = np.maximum(t, 0.0)
    phase = 2.0 * pi * low * t[-1] / octaves * (np.exp(octaves * late / t[-1]) - 1.0)
    return 0.3 * np.sin(2.0 * pi * 0.2 * t), 0.5 * np.sin(phase)


def _two_sines(t: np.ndarray, rng: np.random.Generator):
    path = 0.6 * np.sin(2.0 * pi * rng.uniform(0.2, 0.3) * t) + 0.35 * np.sin(2.0 * pi * rng.uniform(0.55, 0.8) * t)
    return path, 0.2 * np.sin(2.0 * pi * rng.uniform(1.0, 3.0) * t)


def _disturbed_steps(t: np.ndarray, rng: np.random.Generator):
    return _steps(t, rng)[0], 0.3 * _sum_of_sines(t, rng, 0.4, 5.0, 9)


def _sum_of_sines(t: np.ndarray, rng: np.random.Generator, low: float, high: float, count: int) -> np.ndarray:
    """Sines of random frequency and phase with a root mean square of 0.7."""
    frequencies, phases = rng.uniform(low, high, count), rng.uniform(0.0, 2.0 * pi, count)
    return np.sin(2.0 * pi * np.outer(t, frequencies) + phases).sum(axis=1) / np.sqrt(count)


_SHAPES = {
    "release": _release,
    "sine": _sine,
    "slow": _slow,
    "multisine": _multisine,
    "steps": _steps,
    "chirp": _chirp,
    "two_sines": _two_sines,
    "disturbed_steps": _disturbed_steps,
}
