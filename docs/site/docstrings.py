"""What docstrings say of attributes."""

import re
from functools import cache
from inspect import getdoc


@cache
def attributes(built: type) -> dict[str, str]:
    """What the docstrings of a class and of those that it inherits from say of its attributes."""
    said: dict[str, str] = {}
    for one in reversed(built.__mro__):
        section = (getdoc(one) or "").partition("Attributes:\n")[2] if "__doc__" in vars(one) else ""
        name = None
        for line in section.splitlines():
            start = re.match(r"^ {4}(\w+): (.*)$", line)
            if start:
                name, said[start[1]] = start[1], start[2]
            elif name and line.startswith(" " * 8):
                said[name] += " " + line.strip()
            elif line and not line.startswith(" "):
                break
    return said
