"""What a robot with many joints is told to do, within its limits, and how it is logged."""

from dataclasses import dataclass
from math import pi

import numpy as np

from wipx.proof.blind_robots.trees.robots import Robot
from wipx.proof.blind_robots.trees.run import Plan

VISIBLE = ("fourier", "sweeps", "steps", "slow", "chirp")
UNSEEN = ("fourier", "disturbed_steps")
MARGIN = 0.12  # of the joint's range on each side that references keep away from
TOP_SPEED = 3.5  # [rad/s], of references; a slide's is this times its range
BEGINS = 0.6  # [s] in which references fade in from rest
DECIMALS = 6  # of times and positions


@dataclass(frozen=True)
class LogSettings:
    """How a robot's runs are recorded; entries by joint.

    Attributes:
        every: Instants of the controller per row.
        dropped: Share of rows that are missing.
        jitter: Standard deviation of the controller's period, relative.
        noise: Standard deviation of the sensors' noise [rad or m].
        resolution: Of the sensors; 0 for none.
        rate_noise: Standard deviation of the rate sensors' noise; None where rates are not recorded.
        force_noise: Of the recorded force of the drives, relative to its size; None where it is not recorded.
    """

    every: int
    dropped: float
    jitter: float
    noise: tuple[float, ...]
    resolution: tuple[float, ...]
    rate_noise: tuple[float, ...] | None
    force_noise: float | None


@dataclass(frozen=True, eq=False)
class Scenario:
    """One run, drawn in advance, so that robots that differ in one effect meet the same noise.

    Attributes:
        excitation: Name.
        plan: What is done at the instants of the controller.
        rows: Instants that are logged, shape (rows,).
        end: Instant until which the last row's command acts.
        rate_noise: Noise of unit size of the rate sensors, shape (rows, joints).
        force_noise: Likewise of the recorded forces.
    """

    excitation: str
    plan: Plan
    rows: np.ndarray
    end: int
    rate_noise: np.ndarray
    force_noise: np.ndarray


def draw_log_settings(robot: Robot, rng: np.random.Generator) -> LogSettings:
    """Encoders from those of servo kits (4096 steps a turn) to those of industrial arms (18 bits and more)."""
    sampled = any(drive.rate is not None for drive in robot.drives)
    grade = int(rng.choice(3, p=[0.25, 0.35, 0.4]))
    turn = 2.0 * pi / (4096.0, 2.0**15, 2.0**19)[grade]
    units = np.array([link.limits[1] - link.limits[0] if link.slides else 1.0 for link in robot.links])
    noise = np.array([float(f"{v:.3g}") for v in (4e-4, 8e-5, 3e-5)[grade] * rng.uniform(0.5, 2.0, len(units)) * units])
    resolution = [float(f"{turn * unit / (1.0 if unit == 1.0 else 4.0):.6g}") for unit in units]
    rates = tuple(float(f"{v:.3g}") for v in rng.uniform(2e-3, 1e-2, len(units)) * units)
    return LogSettings(
        every=1 if sampled or robot.rate <= 200.0 else int(rng.choice([1, 1, 2])),
        dropped=0.0 if rng.random() < 0.75 else 0.002,
        jitter=0.0 if sampled or rng.random() < 0.5 else float(f"{rng.uniform(0.0, 0.01):.3g}"),
        noise=tuple(noise.tolist()),
        resolution=tuple(resolution) if grade < 2 or rng.random() < 0.5 else tuple(0.0 for _ in units),
        rate_noise=rates if rng.random() < 0.15 else None,
        force_noise=float(f"{rng.uniform(0.005, 0.03):.2g}") if rng.random() < 0.15 else None,
    )


def draw_scenario(
    robot: Robot, settings: LogSettings, excitation: str, rng: np.random.Generator, lengths: tuple[float, float]
) -> Scenario:
    """A run of that excitation; it lasts a time between the two `lengths` [s]."""
    joints = len(robot.links)
    count = int(rng.uniform(*lengths) * robot.rate)
    steps = (1.0 + settings.jitter * np.clip(rng.standard_normal(count), -3.0, 3.0)) / robot.rate
    instants = np.round(np.concatenate(([0.0], np.cumsum(steps))), DECIMALS + 3)
    t = instants[:-1]
    reference, extra = np.zeros((count, 3, joints)), np.zeros((count, joints))
    for j, link in enumerate(robot.links):
        low, high = link.limits
        free = (0.5 - MARGIN) * (high - low)
        path, push = _SHAPES[excitation](t, rng)
        size = free * rng.uniform(0.75, 1.0)
        top = TOP_SPEED * (1.0 if not link.slides else high - low)
        fastest = float(np.max(np.abs(np.gradient(path, t)))) * size
        fade = _fade(t)
        way = size * min(1.0, top / max(fastest, 1e-9)) * path * fade
        reference[:, 0, j] = 0.5 * (low + high) + way
        reference[:, 1, j] = np.gradient(way, t)
        reference[:, 2, j] = np.gradient(reference[:, 1, j], t)
        extra[:, j] = (
            push * fade * 0.25 * (robot.weight[j] + 6.0 * robot.inertia[j] * (1.0 if not link.slides else top))
        )
    rows = np.arange(0, count - settings.every, settings.every)
    kept = rng.random(len(rows)) >= settings.dropped
    kept[[0, -1]] = True
    shape = (int(kept.sum()), joints)
    noise = rng.standard_normal((count, joints)) * settings.noise
    plan = Plan(instants, reference, extra, noise, np.array(settings.resolution))
    end = int(rows[-1]) + settings.every
    return Scenario(excitation, plan, rows[kept], end, rng.standard_normal(shape), rng.standard_normal(shape))


def _fade(t: np.ndarray) -> np.ndarray:
    """From 0 to 1 without a jump of the acceleration."""
    s = np.clip(t / BEGINS, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def _sines(t: np.ndarray, rng: np.random.Generator, low: float, high: float, count: int) -> np.ndarray:
    """Sines of random frequency and phase whose sum reaches 1 about once."""
    frequencies, phases = rng.uniform(low, high, count), rng.uniform(0.0, 2.0 * pi, count)
    found = np.sin(2.0 * pi * np.outer(t, frequencies) + phases).sum(axis=1)
    return found / max(float(np.abs(found).max()), 1e-9)


def _fourier(t: np.ndarray, rng: np.random.Generator):
    """Harmonics of one slow motion (Swevers et al. 1997, IEEE TRA 13(5))."""
    base = rng.uniform(0.1, 0.16)
    harmonics = np.arange(1, 6)
    phases, sizes = rng.uniform(0.0, 2.0 * pi, 5), rng.uniform(0.3, 1.0, 5) / np.sqrt(harmonics)
    found = (sizes * np.sin(2.0 * pi * base * np.outer(t, harmonics) + phases)).sum(axis=1)
    return found / float(np.abs(found).max()), np.zeros_like(t)


def _sweeps(t: np.ndarray, rng: np.random.Generator):
    """There and back at steady speeds that differ from one to the next."""
    turns = np.concatenate(([0.0], np.cumsum(rng.uniform(0.5, 2.5, 60))))
    ends = np.concatenate(([0.0], np.resize([1.0, -1.0], 60) * rng.uniform(0.3, 1.0, 60)))
    return _rounded(np.interp(t, turns, ends), t, 0.05), np.zeros_like(t)


def _steps(t: np.ndarray, rng: np.random.Generator):
    """From place to place, with rests."""
    edges = np.cumsum(rng.uniform(0.6, 1.6, 60))
    levels = rng.uniform(-1.0, 1.0, 61)
    levels[0] = 0.0
    return _rounded(levels[np.searchsorted(edges, t)], t, 0.12), np.zeros_like(t)


def _rounded(path: np.ndarray, t: np.ndarray, width: float) -> np.ndarray:
    """The path without corners, smoothed over a time `width` [s]."""
    from scipy.ndimage import gaussian_filter1d

    return gaussian_filter1d(path, width / float(np.median(np.diff(t))), mode="nearest")


def _slow(t: np.ndarray, rng: np.random.Generator):
    return 0.8 * np.sin(2.0 * pi * rng.uniform(0.06, 0.13) * t) * rng.choice([-1.0, 1.0]), np.zeros_like(t)


def _chirp(t: np.ndarray, rng: np.random.Generator):
    """A slow motion with quick forces on it, where forces are commanded."""
    return 0.6 * np.sin(2.0 * pi * rng.uniform(0.1, 0.25) * t), 0.7 * _sines(t, rng, 1.0, 6.0, 12)


def _disturbed_steps(t: np.ndarray, rng: np.random.Generator):
    return 0.9 * _steps(t, rng)[0], 0.5 * _sines(t, rng, 0.5, 5.0, 9)


_SHAPES = {
    "fourier": _fourier,
    "sweeps": _sweeps,
    "steps": _steps,
    "slow": _slow,
    "chirp": _chirp,
    "disturbed_steps": _disturbed_steps,
}
