"""Errors that a user can mend, each one line: what, where, what was expected, what to do."""

from collections.abc import Iterable
from difflib import get_close_matches


class InputError(Exception):
    """The input or the configuration is at fault; the program ends with exit status 2.

    The message names the file, row, column or key, what was found, what was expected
    and what to do, in one line.
    """


def unknown_name(what: str, name: object, valid: Iterable[str], where: str = "") -> InputError:
    """An `InputError` for a name that does not exist, listing the valid ones.

    Args:
        what: What kind of thing was named, e.g. "effect".
        name: The name that was given.
        valid: All names that exist.
        where: The file or key that holds the name.
    """
    options = sorted(valid)
    close = get_close_matches(str(name), options, n=1)
    hint = f"; did you mean {close[0]}?" if close else ";"
    place = f"{where}: " if where else ""
    return InputError(f"{place}unknown {what} {name!r}{hint} valid: {', '.join(options)}")


def check_positive(**settings: float) -> None:
    """Refuse settings that are not positive.

    Args:
        settings: Values by the name that a user sees.

    Raises:
        InputError: the first one that is zero, negative or not a number.
    """
    for name, value in settings.items():
        if not value > 0:
            raise InputError(f"{name} is {value:g}, expected a positive number")
