"""robot.yaml: what the owner believes about a robot, before any recording was seen.

Its model part (plant, parameters, effects) is read by `wipx.recordings.model_file`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path
from types import MappingProxyType

from wipx.core.errors import InputError, unknown_name
from wipx.core.limits import JointLimits
from wipx.core.load import Load
from wipx.core.model import Model
from wipx.core.plant import Plant
from wipx.recordings.model_file import ROBOT_KEYS, check_keys, mapping_of, model_from_mapping
from wipx.recordings.signals import Signal, signal_from_mapping
from wipx.recordings.strict_yaml import finite_number, load_mapping
from wipx.recordings.units import COMMAND_UNITS, UNITS

LOAD_KEYS = {
    "mass": "kg",
    "height": "m, above the wheel axis along the body",
    "side": "m, beside the body's axis towards +x",
    "recordings": "pattern of file names",
}


@dataclass(frozen=True)
class ControllerDescription:
    """The controller that ran while the robot was recorded.

    Attributes:
        kind: Name, e.g. "lqr".
        gains: One row for each command, u = -K (q - q_ref) [force or torque per SI unit].
        rate: Commands per second [Hz].
    """

    kind: str
    gains: tuple[tuple[float, ...], ...]
    rate: float


@dataclass(frozen=True)
class KnownLoad:
    """A weight that the body carried in some of the recordings.

    Attributes:
        load: Its mass and place.
        recordings: Pattern of the names of those recordings.
    """

    load: Load
    recordings: str


@dataclass(frozen=True)
class RobotDescription:
    """The owner's nominal model and how the robot was recorded.

    Attributes:
        model: Plant, parameters and the effects that the owner already has.
        uncertainty: Relative standard deviation by plant parameter or "site/kind.symbol"; what is
            not listed is exact.
        controller: None where the owner gives none.
        signals: Columns of contract section 1 that the log has under another name, unit or sign.
        loads: Known loads by name; a recording that none of them claims is of the robot without load.
        limits: Of the joints of a robot from a model file, which no experiment may leave.
        emulated: Whether the recordings are of an emulated robot, not of a real one.
    """

    model: Model
    uncertainty: Mapping[str, float]
    controller: ControllerDescription | None
    signals: Mapping[str, Signal]
    loads: Mapping[str, KnownLoad] = field(default_factory=dict)
    limits: Mapping[str, JointLimits] = field(default_factory=dict)
    emulated: bool = False

    def __reduce__(self):
        # Mapping proxies do not pickle; rebuild from plain dictionaries.
        plain = (dict(self.uncertainty), self.controller, dict(self.signals), dict(self.loads), dict(self.limits))
        return RobotDescription, (self.model, *plain, self.emulated)

    def __post_init__(self) -> None:
        object.__setattr__(self, "uncertainty", MappingProxyType(dict(self.uncertainty)))
        object.__setattr__(self, "signals", MappingProxyType(dict(self.signals)))
        object.__setattr__(self, "loads", MappingProxyType(dict(self.loads)))
        object.__setattr__(self, "limits", MappingProxyType(dict(self.limits)))

    def load_of(self, recording: str) -> Load | None:
        """The load on the body in the recording of that name; None where there was none.

        Raises:
            InputError: two loads claim the recording.
        """
        claims = [name for name, known in self.loads.items() if fnmatch(recording, known.recordings)]
        if len(claims) > 1:
            raise InputError(
                f"{recording}: claimed by the loads {' and '.join(claims)}; correct their recordings patterns"
            )
        return self.loads[claims[0]].load if claims else None


def read_robot(path: Path) -> RobotDescription:
    """The description in a robot.yaml.

    Raises:
        InputError: the file is missing or not plain YAML, or its content is at fault.
    """
    return robot_from_mapping(load_mapping(path), str(path), path.parent)


def robot_from_mapping(data: Mapping[str, object], where: str, folder: Path | None = None) -> RobotDescription:
    """The description that the keys of a robot.yaml give.

    Args:
        data: Content of the file, or the same keys in a configuration.
        where: File or key that holds it, for messages.
        folder: That paths in it are relative to; None for the present one.

    Raises:
        InputError: a key, parameter, effect, column or unit is unknown, missing or at fault.
    """
    check_keys(data, ROBOT_KEYS, where)
    model = model_from_mapping(data, where, folder)
    listed = mapping_of(data, "signals", where)
    signals = {n: signal_from_mapping(n, listed[n], model.plant, f"{where}: signals") for n in listed}
    uncertainty = _uncertainty(mapping_of(data, "uncertainty", where), model, f"{where}: uncertainty")
    known = {*mapping_of(data, "parameters", where), *uncertainty}
    _check_input_gain(signals, model.plant, given="input_gain" in known, where=where)
    loads = {n: _load(n, c, model, f"{where}: loads") for n, c in mapping_of(data, "loads", where).items()}
    given = mapping_of(data, "limits", where)
    limits = {joint: _limits(joint, given[joint], model.plant, f"{where}: limits") for joint in given}
    emulated = data.get("emulated", False)
    if not isinstance(emulated, bool):
        raise InputError(f"{where}: emulated is {emulated!r}, expected true or false")
    controller = _controller(data, model.plant, where)
    return RobotDescription(model, uncertainty, controller, signals, loads, limits, emulated)


def _check_input_gain(signals: Mapping[str, Signal], plant: Plant, *, given: bool, where: str) -> None:
    """A command in volts or without unit needs a gain to become a force or a torque."""
    for name in plant.commands if "input_gain" in plant.parameters else ():
        if name in signals and UNITS[signals[name].unit].si in COMMAND_UNITS and not given:
            unit = signals[name].unit
            raise InputError(
                f"{where}: {name} is in {unit}, so parameters.input_gain [{plant.unit_of(name)} per {unit}] is needed"
            )


def _uncertainty(data: Mapping[str, object], model: Model, where: str) -> dict[str, float]:
    symbols = [f"{name}.{symbol}" for name, values in model.effects.items() for symbol in values]
    valid = (*model.parameters, *symbols)
    stds = {}
    for name, given in data.items():
        axes = [f"{name}_{axis}" for axis in "xyz"]
        names = axes if name not in valid and set(axes) <= set(valid) else [name]
        if names[0] not in valid:
            raise unknown_name("parameter", name, valid, where)
        std = finite_number(given)
        if std is None or std <= 0.0:
            raise InputError(f"{where}: {name} is {given!r}, expected a relative standard deviation above 0, e.g. 0.1")
        spec = model.plant.parameters.get(names[0])
        if model.value(names[0]) == 0.0 and not (spec is not None and spec.absolute):
            raise InputError(f"{where}: {name} is relative, but the value itself is 0; give a value or drop it")
        stds.update(dict.fromkeys(names, std))
    return stds


def _controller(data: Mapping[str, object], plant: Plant, where: str) -> ControllerDescription | None:
    content = mapping_of(data, "controller", where)
    if not content:
        return None
    where = f"{where}: controller"
    check_keys(content, ("kind", "gains", "rate"), where)
    for key in ("kind", "gains", "rate"):
        if key not in content:
            raise InputError(f"{where} lacks {key}; expected kind, gains and rate [Hz]")
    kind, rate = content["kind"], finite_number(content["rate"])
    if not isinstance(kind, str):
        raise InputError(f"{where}: kind is {kind!r}, expected a name such as lqr")
    if rate is None or rate <= 0.0:
        raise InputError(f"{where}: rate is {content['rate']!r}, expected a frequency above 0 Hz")
    return ControllerDescription(kind, _gains(content["gains"], len(plant.commands), where), rate)


def _limits(joint: str, data: object, plant: Plant, where: str) -> JointLimits:
    if plant.tree is None or joint not in plant.joints:
        raise unknown_name("joint of a model file", joint, plant.joints if plant.tree is not None else (), where)
    where = f"{where}: {joint}"
    if not isinstance(data, Mapping):
        raise InputError(f"{where} is {data!r}, expected e.g. {{position: [-1.5, 1.5], speed: 2.0, force: 3.0}}")
    check_keys(data, ("position", "speed", "force"), where)
    position = None
    if data.get("position") is not None:
        ends = data["position"]
        numbers = [finite_number(end) for end in ends] if isinstance(ends, list | tuple) else []
        if len(numbers) != 2 or numbers[0] is None or numbers[1] is None or numbers[0] >= numbers[1]:
            raise InputError(f"{where}: position is {ends!r}, expected the lowest and the highest [rad or m]")
        position = (numbers[0], numbers[1])
    sizes: dict[str, float] = {}
    for key in ("speed", "force"):
        if data.get(key) is not None:
            size = finite_number(data[key])
            if size is None or size <= 0.0:
                raise InputError(f"{where}: {key} is {data[key]!r}, expected a number above 0")
            sizes[key] = size
    return JointLimits(position, sizes.get("speed"), sizes.get("force"))


def _load(name: str, data: object, model: Model, where: str) -> KnownLoad:
    where = f"{where}: {name}"
    if not isinstance(data, Mapping):
        raise InputError(f"{where} is {data!r}, expected {', '.join(LOAD_KEYS)}")
    check_keys(data, tuple(LOAD_KEYS), where)
    for key, meaning in LOAD_KEYS.items():
        if key not in data:
            raise InputError(f"{where} lacks {key} ({meaning}); add it")
    numbers = {key: finite_number(data[key]) for key in LOAD_KEYS if key != "recordings"}
    for key, number in numbers.items():
        if number is None:
            raise InputError(f"{where}: {key} is {data[key]!r}, expected a number ({LOAD_KEYS[key]})")
    pattern = data["recordings"]
    if not isinstance(pattern, str) or not pattern:
        raise InputError(f"{where}: recordings is {pattern!r}, expected a pattern of file names such as m16_*.csv")
    load = Load(**{key: number for key, number in numbers.items() if number is not None})
    if load.mass < 0.0:
        raise InputError(f"{where}: mass = {load.mass:g}, expected a non-negative number of kg")
    try:
        load.on(model)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
    return KnownLoad(load, pattern)


def _gains(data: object, commands: int, where: str) -> tuple[tuple[float, ...], ...]:
    rows = data if isinstance(data, list | tuple) else []
    if rows and not any(isinstance(row, list | tuple) for row in rows):
        rows = [rows]
    if len(rows) != commands or not all(_is_gain_row(row) for row in rows):
        expected = "a list of numbers" if commands == 1 else f"{commands} lists of numbers, one per command"
        raise InputError(f"{where}: gains is {data!r}, expected {expected}")
    return tuple(tuple(float(gain) for gain in row) for row in rows)


def _is_gain_row(row: object) -> bool:
    return isinstance(row, list | tuple) and len(row) > 0 and all(finite_number(gain) is not None for gain in row)
