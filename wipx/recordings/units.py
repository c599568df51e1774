"""Units in which a log may hold a column, and the factor of each to SI.

Only what logs of robots use is here. Which unit a column has after reading is fixed by
`Plant.unit_of`; commands may stay in volts or without unit, their `input_gain` turns them
into a force or a torque.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi, tau
from types import MappingProxyType

from wipx.core.errors import InputError, unknown_name

COMMAND_UNITS = ("V", "1")  # SI units that only a command may have beside its force or torque


@dataclass(frozen=True)
class Unit:
    """A unit as a multiple of the SI unit of its dimension.

    Attributes:
        si: SI unit of the same dimension, e.g. "rad".
        factor: SI units per unit, e.g. pi / 180 for degrees.
    """

    si: str
    factor: float


UNITS: Mapping[str, Unit] = MappingProxyType(
    {
        "s": Unit("s", 1.0),
        "ms": Unit("s", 1e-3),
        "us": Unit("s", 1e-6),
        "ns": Unit("s", 1e-9),
        "m": Unit("m", 1.0),
        "cm": Unit("m", 1e-2),
        "mm": Unit("m", 1e-3),
        "rad": Unit("rad", 1.0),
        "mrad": Unit("rad", 1e-3),
        "deg": Unit("rad", pi / 180.0),
        "turn": Unit("rad", tau),
        "rev": Unit("rad", tau),
        "m/s": Unit("m/s", 1.0),
        "cm/s": Unit("m/s", 1e-2),
        "mm/s": Unit("m/s", 1e-3),
        "rad/s": Unit("rad/s", 1.0),
        "mrad/s": Unit("rad/s", 1e-3),
        "deg/s": Unit("rad/s", pi / 180.0),
        "turn/s": Unit("rad/s", tau),
        "rpm": Unit("rad/s", tau / 60.0),
        "N": Unit("N", 1.0),
        "mN": Unit("N", 1e-3),
        "kN": Unit("N", 1e3),
        "N m": Unit("N m", 1.0),
        "mN m": Unit("N m", 1e-3),
        "N cm": Unit("N m", 1e-2),
        "V": Unit("V", 1.0),
        "mV": Unit("V", 1e-3),
        "1": Unit("1", 1.0),
        "%": Unit("1", 1e-2),
    }
)


def check_unit(unit: str, expected: str, *, command: bool, where: str) -> None:
    """Refuse a unit that does not exist or that a column cannot have.

    Args:
        unit: Unit of the log.
        expected: SI unit of the column.
        command: Whether the column is a command, which may also be in volts or without unit.
        where: File and key that hold the unit, for messages.

    Raises:
        InputError: see above; the message lists the valid units.
    """
    if unit not in UNITS:
        raise unknown_name("unit", unit, UNITS, where)
    allowed = (expected, *COMMAND_UNITS) if command else (expected,)
    if UNITS[unit].si not in allowed:
        valid = ", ".join(name for name, other in UNITS.items() if other.si in allowed)
        raise InputError(f"{where}: unit {unit} is not one of {expected}; give one of: {valid}")


def factor_to_si(unit: str) -> float:
    """SI units per `unit`."""
    return UNITS[unit].factor
