"""Groups of settings inside a part: a mapping, as YAML holds it, becomes a frozen dataclass with checked fields."""

from collections.abc import Mapping
from dataclasses import MISSING, Field
from typing import Any, ClassVar, Protocol, TypeVar, get_args, get_type_hints

from wipx.core.errors import InputError, unknown_name

WORDS = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}


class Dataclass(Protocol):
    """Any dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


Settings = TypeVar("Settings", bound=Dataclass)


def settings_from(kind: type[Settings], values: Mapping[str, object], where: str) -> Settings:
    """The settings of that kind.

    Args:
        kind: A dataclass whose fields are numbers, texts or truth values, or one of these or None.
        values: By field name.
        where: Key of the configuration, for messages.

    Raises:
        InputError: a name is unknown or missing, or a value is of the wrong type.
    """
    declared = kind.__dataclass_fields__
    for name in values:
        if name not in declared:
            raise unknown_name("key", name, declared, where)
    for name, item in declared.items():
        if name not in values and item.default is MISSING:
            raise InputError(f"{where}.{name} is missing; add it")
    hints = get_type_hints(kind)
    return kind(**{name: _checked(value, hints[name], f"{where}.{name}") for name, value in values.items()})


def _checked(value: object, kind: object, where: str) -> object:
    for member in get_args(kind) or (kind,):
        if member is float and type(value) is int:
            return float(value)
        if type(value) is member:
            return value
    expected = " or ".join(WORDS.get(member, "null") for member in get_args(kind) or (kind,))
    raise InputError(f"{where} is {value!r}, expected {expected}; correct it")
