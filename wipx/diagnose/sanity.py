"""Is robot.yaml, or the reading of the log, grossly wrong: signs, units, zeros.

Such a slip looks like missing physics of every kind at once. Each of the usual ones is undone in turn, and where the
nominal model then explains the recordings far better than any single effect makes it, the owner is told instead of
being given a diagnosis. What is uncertain by a few per cent is no slip; that is what effects are for.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.diagnose.fitting import Fit, Fitter
from wipx.diagnose.follower import Follower
from wipx.diagnose.hypothesis import Hypothesis, Setting
from wipx.diagnose.log import Log
from wipx.diagnose.observer import NoiseLevels

PROBE_SPAN = 3.0  # [s] of a recording; a gross error shows in every second of it
PROBE_RECORDINGS = 4
ROUNDS = 3  # of noise levels and values in turn
OVERWHELMING = 0.15  # nats for every row and channel: innovations 16 % larger throughout
CLEARLY = 1.5  # times what the best effect gains
GYRATION = (0.01, 4.0)  # body inertia over m_b L^2 of bodies that people build
ALIKE = 0.3  # logarithm of a factor below which a wrong unit makes no gross difference


@dataclass(frozen=True)
class Slip:
    """A mistake of owners, by what undoes it.

    Attributes:
        contradicted: What the recordings contradict, after "its".
        undone: What was tried, after "with".
        remedy: What the owner writes instead.
        columns: Factor and offset of recorded columns, value = factor * column + offset.
        parameters: Factor of the nominal model's numbers.
    """

    contradicted: str
    undone: str
    remedy: str
    columns: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)

    def model(self, nominal: Model) -> Model:
        """The nominal model with its numbers put right."""
        return nominal.with_values({name: factor * nominal.value(name) for name, factor in self.parameters.items()})

    def recording(self, recording: Recording) -> Recording:
        """A recording with its columns put right."""
        changed = {n: f * recording[n] + offset for n, (f, offset) in self.columns.items() if n in recording}
        return Recording(recording.name, {**recording.columns, **changed}, recording.source)

    def factors(self, log: Log) -> np.ndarray:
        """Size of the factor on each recorded channel, shape (m,)."""
        names = (*log.plant.coordinates, *log.plant.rates)
        return np.array([abs(self.columns.get(names[c], (1.0, 0.0))[0]) for c in log.channels])


def check_plausible(fitter: Fitter, setting: Setting, nominal: Fit, best: Fit, where: str) -> None:
    """Refuse a robot.yaml that the recordings contradict grossly.

    Args:
        fitter: Of the recordings.
        setting: The robot.
        nominal: Fit of the nominal model.
        best: The best fit with one effect more; `nominal` where none helps.
        where: File that describes the robot, for the message.

    Raises:
        InputError: a sign, a unit or a zero is wrong; the message says which and how to mend it.
    """
    log = fitter.follower.log
    probe = _fitter(fitter, _probed(log.recordings), setting.nominal)
    before = probe.polished(probe.fit(nominal.hypothesis, nominal.levels), rounds=ROUNDS)
    suspects = [(_undone(probe, setting, before, slip), slip) for slip in slips(setting.nominal)]
    if not suspects:
        return
    likelihood, slip = max(suspects, key=lambda suspect: suspect[0])
    if likelihood - before.log_likelihood < OVERWHELMING * before.white.size:
        return
    gain = _undone(fitter, setting, nominal, slip) - nominal.log_likelihood
    if gain > max(OVERWHELMING * nominal.white.size, CLEARLY * (best.log_likelihood - nominal.log_likelihood)):
        times = np.exp(gain / nominal.white.size)
        raise InputError(
            f"{where}: the recordings contradict its {slip.contradicted} (with {slip.undone} the model's errors from row "
            f"to row are {times:.2g} times smaller, which no missing effect achieves); {slip.remedy}"
        )


def slips(nominal: Model) -> tuple[Slip, ...]:
    """The mistakes that are possible for a robot."""
    plant = nominal.plant
    found = [*_signs(plant), *_units_of_columns(nominal), *_zeros(plant), *_units_of_parameters(nominal)]
    return tuple(found)


def _signs(plant: Plant) -> list[Slip]:
    named = " and ".join(plant.commands)
    mapped = ", ".join(f"{u}: {{column: {u}, scale: -1}}" for u in plant.commands)
    reverse = {u: (-1.0, 0.0) for u in plant.commands}
    reversed_commands = Slip(f"sign of {named}", f"{named} reversed", f"reverse it with signals: {{{mapped}}}", reverse)
    if len(plant.joints) == 1 or plant.kind == "double_pendulum":
        return [reversed_commands]  # a reversed coordinate is the same
    return [reversed_commands, *(_reversed(column) for column in plant.coordinates)]


def _reversed(column: str) -> Slip:
    remedy = f"reverse it with signals: {{{column}: {{column: {column}, scale: -1}}}}, and its rate likewise"
    columns = {column: (-1.0, 0.0), f"{column}_dot": (-1.0, 0.0)}
    return Slip(f"sign of {column}", f"{column} reversed", remedy, columns)


def _units_of_columns(nominal: Model) -> list[Slip]:
    plant = nominal.plant
    found = []
    angles = [column for column in plant.coordinates if column != "x"]
    if angles:
        columns = {name: (np.pi / 180.0, 0.0) for a in angles for name in (a, f"{a}_dot")}
        mapped = ", ".join(f"{a}: {{column: {a}, unit: deg}}" for a in angles)
        found.append(
            Slip(f"unit of {' and '.join(angles)}, rad", "degrees read", f"write signals: {{{mapped}}}", columns)
        )
    if "x" in plant.coordinates:
        columns = {"x": (1e-3, 0.0), "x_dot": (1e-3, 0.0)}
        found.append(
            Slip("unit of x, m", "millimetres read", "write signals: {x: {column: x, unit: mm}}", columns)
        )
    radius = nominal.parameters.get("wheel_radius", 1.0)
    if "x" in plant.coordinates and abs(np.log(radius)) > ALIKE:
        remedy = f"divide by the wheel radius with signals: {{u: {{column: u, scale: {1.0 / radius:.5g}}}}}"
        found.append(Slip("unit of u, N", "a motor torque in N m read", remedy, {"u": (1.0 / radius, 0.0)}))
    return found


def _zeros(plant: Plant) -> list[Slip]:
    column = next((column for column in plant.coordinates if column != "x"), None)
    if column is None:
        return []
    zero, other = ("hanging", "upright") if plant.kind == "double_pendulum" else ("upright", "hanging")
    remedy = f"move it with signals: {{{column}: {{column: {column}, offset: 3.14159}}}}"
    return [Slip(f"zero of {column}, which is {zero}", f"0 taken for {other}", remedy, {column: (1.0, np.pi)})]


def _units_of_parameters(nominal: Model) -> list[Slip]:
    wrong = (
        ("body_mass", 1e-3, "g", "kg"),
        ("body_inertia", 1e-3, "g m^2", "kg m^2"),
        ("body_inertia", 1e-4, "kg cm^2", "kg m^2"),
        ("com_height", 1e-3, "mm", "m"),
        ("com_height", 1e-2, "cm", "m"),
    )
    found = []
    for name, factor, taken, expected in wrong:
        if name not in nominal.parameters:
            continue
        value = factor * nominal.parameters[name]
        remedy = f"write {name}: {value:.5g} if it is in {taken}"
        slip = Slip(f"{name}, {expected}", f"{taken} read", remedy, parameters={name: factor})
        if _is_a_body(slip.model(nominal)):
            found.append(slip)
    return found


def _is_a_body(model: Model) -> bool:
    """Whether inertia, mass and height could belong to one body; a slip leaves them decades apart."""
    p = model.parameters
    if "body_inertia" not in p:
        return False
    return GYRATION[0] < p["body_inertia"] / (p["body_mass"] * p["com_height"] ** 2) < GYRATION[1]


def _probed(recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
    return tuple(r.between(r.t[0], r.t[0] + PROBE_SPAN) for r in recordings[:PROBE_RECORDINGS])


def _fitter(fitter: Fitter, recordings: tuple[Recording, ...], nominal: Model) -> Fitter:
    return Fitter(Follower.of(fitter.follower.simulator, Log.of(recordings, nominal.plant), nominal))


def _undone(fitter: Fitter, setting: Setting, before: Fit, slip: Slip) -> float:
    """Log-likelihood of the recordings, in the units they were logged in, without the slip."""
    log = fitter.follower.log
    mended = replace(setting, nominal=slip.model(setting.nominal))
    recordings = tuple(slip.recording(r) for r in log.recordings)
    other = _fitter(fitter, recordings, mended.nominal)
    factors = slip.factors(log)
    levels = NoiseLevels(before.levels.force, before.levels.sensor * factors)
    fit = other.polished(other.fit(Hypothesis.of(mended, (), {}), levels), rounds=ROUNDS)
    return fit.log_likelihood + int(log.counted.sum()) * float(np.log(factors).sum())
