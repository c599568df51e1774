"""Signals: how a column of contract section 1 comes from the columns of a log.

    value = scale * factor(unit) * column * times + offset        (offset in SI)

`factor` brings the logged unit to SI. A logged angle that jumps between pi and -pi is made
continuous before the scale is applied.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from wipx.core.errors import InputError, unknown_name
from wipx.core.plant import REFERENCES, Plant
from wipx.recordings.strict_yaml import finite_number
from wipx.recordings.units import check_unit, factor_to_si


@dataclass(frozen=True)
class Signal:
    """Where a column comes from.

    Attributes:
        column: Column of the log.
        unit: Unit of the log, a key of `wipx.recordings.units.UNITS`.
        scale: Factor beside the unit's; a negative one turns the direction round.
        offset: Added last [SI].
        times: Another column of the log that is multiplied in, as logged; e.g. the supply
            voltage where `column` is a duty cycle.
        constant: Value of a column that the log lacks [SI]; nothing else is used then.
        unwrap: Whether the log wraps the angle to one turn.
    """

    column: str
    unit: str
    scale: float = 1.0
    offset: float = 0.0
    times: str | None = None
    constant: float | None = None
    unwrap: bool = False

    @property
    def needs(self) -> tuple[str, ...]:
        """Columns of the log that the signal is made of."""
        if self.constant is not None:
            return ()
        return (self.column,) if self.times is None else (self.column, self.times)

    def values(self, logged: Mapping[str, np.ndarray], rows: int) -> np.ndarray:
        """The column of contract section 1, shape (rows,) [SI].

        Args:
            logged: Columns of the log named in `needs`, each of shape (rows,), as logged.
            rows: Number of rows.
        """
        if self.constant is not None:
            return np.full(rows, self.constant)
        values = factor_to_si(self.unit) * logged[self.column]
        if self.unwrap:
            values = np.unwrap(values)
        values = self.scale * values
        if self.times is not None:
            values = values * logged[self.times]
        return values + self.offset


def recorded_columns(plant: Plant) -> tuple[str, ...]:
    """Every column that a recording of the plant may have, time first."""
    measured = tuple(f"{command}_measured" for command in plant.commands)
    known = (*plant.coordinates, *plant.rates)
    references = tuple(f"{name}_ref" for name in known if f"{name}_ref" in REFERENCES)
    return ("t", *plant.coordinates, *plant.commands, *plant.rates, *measured, *references)


def required_columns(plant: Plant) -> tuple[str, ...]:
    """The columns that every recording of the plant must have, time first."""
    return ("t", *plant.coordinates, *plant.commands)


def plain_signal(name: str, plant: Plant) -> Signal:
    """The signal of a column that the log already has as contract section 1 wants it."""
    return Signal(column=name, unit=plant.unit_of(name))


def signal_from_mapping(name: str, data: object, plant: Plant, where: str) -> Signal:
    """A signal as a YAML file describes it.

    Args:
        name: Column of contract section 1.
        data: Attributes of `Signal` by name; `column` is `name` and `unit` its SI unit where they
            are left out.
        plant: Kind of mechanism that was recorded.
        where: File and key that hold `data`, for messages.

    Raises:
        InputError: the plant has no such column, a key is unknown, a value is of the wrong
            kind, or the unit does not exist or does not fit.
    """
    if name not in recorded_columns(plant):
        raise unknown_name(f"column of plant {plant.kind}", name, recorded_columns(plant), where)
    where = f"{where}.{name}"
    if not isinstance(data, Mapping):
        raise InputError(f"{where} is {data!r}, expected settings such as {{column: pitch_deg, unit: deg}}")
    valid = tuple(field.name for field in fields(Signal))
    for key in data:
        if key not in valid:
            raise unknown_name("setting", key, valid, where)
    if "constant" in data and len(data) > 1:
        raise InputError(
            f"{where}: constant replaces all other keys; drop {', '.join(k for k in data if k != 'constant')}"
        )
    expected = plant.unit_of(name)
    signal = Signal(
        column=_text(data, "column", name, where),
        unit=str(data.get("unit", expected)),
        scale=_number(data, "scale", 1.0, where),
        offset=_number(data, "offset", 0.0, where),
        times=_text(data, "times", "", where) or None,
        constant=_number(data, "constant", 0.0, where) if "constant" in data else None,
        unwrap=_flag(data, "unwrap", where),
    )
    check_unit(signal.unit, expected, command=name in plant.commands, where=where)
    if signal.scale == 0.0:
        raise InputError(f"{where}: scale is 0, which erases the column; give a factor")
    if signal.unwrap and expected != "rad":
        raise InputError(f"{where}: unwrap is for angles, {name} is in {expected}; drop it")
    return signal


def _number(data: Mapping[str, object], key: str, default: float, where: str) -> float:
    value = finite_number(data.get(key, default))
    if value is None:
        raise InputError(f"{where}: {key} is {data[key]!r}, expected a finite number")
    return value


def _text(data: Mapping[str, object], key: str, default: str, where: str) -> str:
    value = data.get(key, default)
    if not isinstance(value, str):
        raise InputError(f"{where}: {key} is {value!r}, expected the name of a column of the log")
    return value


def _flag(data: Mapping[str, object], key: str, where: str) -> bool:
    value = data.get(key, False)
    if not isinstance(value, bool):
        raise InputError(f"{where}: {key} is {value!r}, expected true or false")
    return value
