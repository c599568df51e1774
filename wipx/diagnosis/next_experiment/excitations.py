"""The menu of excitations from which the next experiment is chosen: what each is, and what a person does to run it.

Sizes begin at what the recordings show to be harmless; `choice` has them simulated and shrinks them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch

DURATION = 10.0  # [s] of an experiment
RAMP = 1.0  # [s] within which an excitation sets in
FREQUENCIES = np.array([0.2, 0.5, 0.9, 1.4, 2.1])  # [Hz] of the multisine
SLOW, TRACKING = 0.2, 0.4  # [Hz]
SWEEP = (0.2, 2.6)  # [Hz] of the chirp
STEP_TIME = 2.0  # [s] between two steps
SPEED = 0.3  # [m/s] of the tracking task
SMALL, WIDE = 0.03, 0.1  # [m] of slow reversals and of the multisine
TILT = 0.05  # [rad or m] from which the robot is released
LINEAR, SATURATING = 0.9, 1.3  # times the largest recorded command
ADDED_MASS = 0.05  # of the body
REFERENCE_RATE = 100.0  # [Hz] of the file that the robot follows

Course = Callable[[np.ndarray], np.ndarray]  # of time (rows,) [s], values of size one


@dataclass(frozen=True)
class Reach:
    """How far the robot went in the recordings.

    Attributes:
        travel: Largest span of each coordinate within a recording, shape (joints,) [m or rad].
        command: Largest command [N or N m].
    """

    travel: np.ndarray
    command: float

    @classmethod
    def of(cls, data: RecordingBatch) -> "Reach":
        """What the recordings show."""
        coordinates, commands = data.plant.coordinates, data.plant.commands
        travel = [max(float(np.ptp(r[column])) for r in data.recordings) for column in coordinates]
        command = max(float(np.abs(r.stack(commands)).max()) for r in data.recordings)
        return cls(np.array(travel), command)


@dataclass(frozen=True)
class Excitation:
    """One way of moving the robot.

    Attributes:
        name: Of the menu.
        course: Of the reference, or of the command where no controller runs.
        size: Factor of the course [m, rad, N or N m].
        shape: The course in words, with places for {size} and {unit}.
        jumps: Whether the course has steps, whose rate is no reference.
        tilt: From which the robot is released [rad, or m without a pitch].
        command: Largest command at which `size` is aimed [N or N m]; None where `size` stands.
        mass: Known mass that is added to the body [kg].
        shrinks: Whether a smaller size is still worth it.
    """

    name: str
    course: Course
    size: float
    shape: str
    jumps: bool = False
    tilt: float = 0.0
    command: float | None = None
    mass: float = 0.0
    shrinks: bool = True


def excitations_for(model: Model, reach: Reach, rng: np.random.Generator, *, closed: bool) -> tuple[Excitation, ...]:
    """The excitations for a robot.

    Args:
        model: The robot.
        reach: How far it may go.
        rng: Draws the phases of the multisine.
        closed: Whether its controller runs; else the commands themselves are shaped, if the recordings have any.
    """
    phases = rng.uniform(0.0, 2.0 * np.pi, len(FREQUENCIES))
    if closed:
        return _references(model, reach, phases)
    return _commands(reach, phases) if reach.command > 0.0 else ()


def how(excitation: Excitation, model: Model, command: float, *, closed: bool) -> str:
    """What a person does, one sentence.

    Args:
        excitation: With its final size.
        model: The robot.
        command: Largest command that it takes [N or N m].
        closed: Whether the controller runs.
    """
    plant = model.plant
    reaching = f"the command reaches {command:.2g} {plant.unit_of(plant.commands[0])}"
    if excitation.tilt:
        column = plant.coordinates[-1]
        start = f"{column} = {excitation.tilt:.2g} {plant.unit_of(column)}"
        return f"Hold the reference at zero, release the robot from {start} and record {DURATION:g} s ({reaching})"
    if not closed:
        unit = plant.unit_of(plant.commands[0])
        return f"Switch the controller off and let {' and '.join(plant.commands)} be {_course(excitation, unit)}"
    driven = [plant.columns[site] for site in plant.actuated]
    references = " and ".join(f"{column}_ref" for column in driven)
    moving = f"let {references} be {_course(excitation, plant.unit_of(driven[0]))} ({reaching})"
    if not excitation.mass:
        return moving[0].upper() + moving[1:]
    values = f"mass: {excitation.mass:.3g}, height: {payload_height(model):.4g}"
    return (
        f"Fix {excitation.mass:.3g} kg to the body at its centre of mass, add geometry/payload: {{{values}}} "
        f"to the effects of robot.yaml, and {moving}"
    )


def _course(excitation: Excitation, unit: str) -> str:
    return f"{excitation.shape.format(size=f'{excitation.size:.2g}', unit=unit)} for {DURATION:g} s"


def payload_height(model: Model) -> float:
    """Where a known mass is added: at the body's centre of mass [m]."""
    return model.parameters.get("com_height", 0.0)


def _references(model: Model, reach: Reach, phases: np.ndarray) -> tuple[Excitation, ...]:
    plant = model.plant
    joint = plant.joints.index(plant.actuated[0])
    span = 0.5 * float(reach.travel[joint])
    slides = plant.columns[plant.actuated[0]] == "x"
    small, wide = (SMALL, WIDE) if slides else (0.2 * span, 0.6 * span)
    tracked = SPEED / (2.0 * np.pi * TRACKING) if slides else 0.5 * span
    multisine = Excitation("multisine", _multisine(phases), wide, _sum_of_sines())
    steps = "steps of +-{size} {unit} every " + f"{STEP_TIME:g} s"
    gentle = Excitation("steps", _square, 0.2 * span, steps, jumps=True, command=LINEAR * reach.command)
    listed = [
        Excitation("release", np.zeros_like, 0.0, "zero", tilt=min(TILT, 0.5 * float(reach.travel[-1]))),
        Excitation("slow reversals", _sine(SLOW), small, f"a sine of {{size}} {{unit}} at {SLOW:g} Hz"),
        Excitation("tracking", _sine(TRACKING), tracked, f"a sine of {{size}} {{unit}} at {TRACKING:g} Hz"),
        multisine,
        gentle,
        replace(gentle, name="steps to saturation", command=SATURATING * reach.command, shrinks=False),
        Excitation("chirp", _chirp, 0.5 * wide, _sweep()),
    ]
    mass = ADDED_MASS * model.parameters.get("body_mass", 0.0)
    if mass > 0.0:
        listed.append(Excitation("known added mass", multisine.course, wide, multisine.shape, mass=mass))
    return tuple(listed)


def _commands(reach: Reach, phases: np.ndarray) -> tuple[Excitation, ...]:
    """Commands that begin at a crest, so that a free joint comes back."""
    signs = np.where(np.sin(phases) > 0.0, 1.0, -1.0)

    def crests(t: np.ndarray) -> np.ndarray:
        values = np.cos(2.0 * np.pi * np.outer(t, FREQUENCIES)) @ signs
        return values / np.abs(values).max()

    def square(t: np.ndarray) -> np.ndarray:
        return np.where(np.mod(t + 0.5 * STEP_TIME, 2.0 * STEP_TIME) < STEP_TIME, 1.0, -1.0)

    def sweep(t: np.ndarray) -> np.ndarray:
        return np.cos(_swept_phase(t))

    steps = "steps of +-{size} {unit} every " + f"{STEP_TIME:g} s"
    return (
        Excitation("multisine", crests, LINEAR * reach.command, _sum_of_sines()),
        Excitation("steps", square, 0.5 * reach.command, steps),
        Excitation("chirp", sweep, LINEAR * reach.command, _sweep()),
    )


def _sum_of_sines() -> str:
    return f"a sum of sines of {', '.join(f'{f:g}' for f in FREQUENCIES)} Hz, at most {{size}} {{unit}},"


def _sweep() -> str:
    return f"a sine of {{size}} {{unit}} that rises from {SWEEP[0]:g} to {SWEEP[1]:g} Hz"


def _set_in(t: np.ndarray) -> np.ndarray:
    return np.minimum(t / RAMP, 1.0)


def _sine(frequency: float) -> Course:
    def course(t: np.ndarray) -> np.ndarray:
        return _set_in(t) * np.sin(2.0 * np.pi * frequency * t)

    return course


def _multisine(phases: np.ndarray) -> Course:
    def course(t: np.ndarray) -> np.ndarray:
        grid = np.linspace(0.0, DURATION, 2001)
        values = [_set_in(s) * (_sines(s, phases) - _sines(np.zeros(1), phases)) for s in (t, grid)]
        return values[0] / np.abs(values[1]).max()

    return course


def _sines(t: np.ndarray, phases: np.ndarray) -> np.ndarray:
    return np.sin(2.0 * np.pi * np.outer(t, FREQUENCIES) + phases) @ FREQUENCIES**-0.5


def _square(t: np.ndarray) -> np.ndarray:
    turned = np.where(np.mod(t - RAMP, 2.0 * STEP_TIME) < STEP_TIME, 1.0, -1.0)
    return np.where(t < RAMP, 0.0, turned)


def _chirp(t: np.ndarray) -> np.ndarray:
    return _set_in(t) * np.sin(_swept_phase(t))


def _swept_phase(t: np.ndarray) -> np.ndarray:
    return 2.0 * np.pi * (SWEEP[0] + 0.5 * (SWEEP[1] - SWEEP[0]) * t / DURATION) * t


def prescribed(plant: Plant, excitation: Excitation, *, closed: bool) -> dict[str, np.ndarray]:
    """Columns of the file that the robot follows, time first; none where its reference stays at zero.

    Args:
        plant: The robot.
        excitation: With its final size.
        closed: Whether the controller runs, so that these are references.
    """
    if excitation.tilt:
        return {}
    t = np.arange(round(DURATION * REFERENCE_RATE) + 1) / REFERENCE_RATE
    course = excitation.size * excitation.course(t)
    if not closed:
        return {"t": t, **{command: course for command in plant.commands}}
    columns = {"t": t}
    for joint in map(plant.joints.index, plant.actuated):
        columns[f"{plant.coordinates[joint]}_ref"] = course
        columns[f"{plant.rates[joint]}_ref"] = rate_of(excitation, t)
    return columns


def rate_of(excitation: Excitation, t: np.ndarray) -> np.ndarray:
    """Rate of the course at regular times, shape (rows,) [1/s of its unit]; none for jumps."""
    if excitation.jumps:
        return np.zeros_like(t)
    return np.gradient(excitation.size * excitation.course(t), t)
