"""Motions of a robot from a model file, from which the next experiment is chosen.

All driven joints move at once along finite Fourier series (Swevers et al. 1997, Optimal robot excitation and
identification, IEEE Trans. Robotics and Automation 13(5)) or slow ramps, or one joint after another makes a step.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wipx.diagnosis.next_experiment.excitations import DURATION, RAMP

HARMONICS = np.arange(1, 6)  # of a Fourier series
WIDE, FAST = 0.1, 0.3  # [Hz] base frequencies of the Fourier series
SLOW = 0.1  # [Hz] of the ramps
STEPS = 1.0 / 3.0  # of the range: ramps and series use all of it

Course = Callable[[np.ndarray], np.ndarray]  # of time (rows,) [s], shape (rows, joints), at most one in size


@dataclass(frozen=True)
class Motion:
    """One way of moving all driven joints.

    Attributes:
        name: Of the menu.
        course: Of each joint beside the middle of its range; one is half the recorded range.
        size: Factor of the course.
        shape: The course in words.
        jumps: Whether the course has steps, whose rate is no reference.
    """

    name: str
    course: Course
    size: float
    shape: str
    jumps: bool = False

    def rate(self, t: np.ndarray) -> np.ndarray:
        """Rate of the course at regular times, shape (rows, joints) [1/s]; none for jumps."""
        course = self.size * self.course(t)
        return np.zeros_like(course) if self.jumps else np.gradient(course, t, axis=0)


def motions_of(joints: int, rng: np.random.Generator) -> tuple[Motion, ...]:
    """The menu for a robot of so many driven joints; `rng` draws the Fourier series."""
    hertz = "{} to {} Hz".format
    return (
        Motion("wide Fourier series", _series(joints, WIDE, rng), 1.0, f"sums of sines of {hertz(0.1, 0.5)}"),
        Motion("fast Fourier series", _series(joints, FAST, rng), 0.5, f"sums of sines of {hertz(0.3, 1.5)}"),
        Motion("slow ramps", _ramps(joints), 1.0, f"ramps up and down with a period of {1.0 / SLOW:g} s"),
        Motion("steps of single joints", _steps(joints), STEPS, "a step of one joint after another", jumps=True),
    )


def _set_in(t: np.ndarray) -> np.ndarray:
    """From zero to one without a jump of the rate."""
    return 0.5 - 0.5 * np.cos(np.pi * np.minimum(t / RAMP, 1.0))


def _series(joints: int, base: float, rng: np.random.Generator) -> Course:
    """Fourier series with the same share of speed in each harmonic and random phases."""
    frequencies = 2.0 * np.pi * base * HARMONICS
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(HARMONICS), joints))

    def raw(t: np.ndarray) -> np.ndarray:
        waves = np.sin(frequencies[:, None] * t[:, None, None] + phases)
        return _set_in(t)[:, None] * (waves / HARMONICS[:, None]).sum(axis=1)

    largest = np.abs(raw(np.linspace(0.0, DURATION, 1001))).max(axis=0)
    return lambda t: raw(t) / largest


def _ramps(joints: int) -> Course:
    """Triangles, each joint turning at another time."""
    shifts = np.arange(joints) / max(joints, 1)

    def course(t: np.ndarray) -> np.ndarray:
        turns = np.mod(SLOW * t[:, None] + 0.5 * shifts + 0.25, 1.0)
        return _set_in(t)[:, None] * (1.0 - 4.0 * np.abs(turns - 0.5))

    return course


def _steps(joints: int) -> Course:
    """Each joint steps out, across and back in its own share of the time."""
    share = (DURATION - RAMP) / max(joints, 1)

    def course(t: np.ndarray) -> np.ndarray:
        place = (t[:, None] - RAMP) / share - np.arange(joints)
        out, across = (place >= 0.0) & (place < 0.4), (place >= 0.4) & (place < 0.8)
        return out.astype(float) - across.astype(float)

    return course
