"""YAML files of plain values: strict, and no tag can run code."""

import re
from collections.abc import Hashable
from math import isfinite
from pathlib import Path

import yaml

from wipx.core.errors import InputError


class _StrictLoader(yaml.SafeLoader):
    """The safe loader, which also refuses a key that is given twice and reads 1e-3 as a number."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, object]:
        seen = set()
        for key_node, _ in node.value:
            key = key_node.value if isinstance(key_node, yaml.ScalarNode) else None
            if key in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key {key} is given twice", key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


# YAML 1.2, 10.3.2: the exponent needs no sign and the mantissa no point; YAML 1.1, which the
# loader follows, reads 1e-3 as text.
_StrictLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$"), list("-+.0123456789")
)


def load_mapping(path: Path) -> dict[str, object]:
    """The mapping at the top of a YAML file.

    Raises:
        InputError: the file is missing, is not YAML, has a tag or a key twice, or holds something
            else than a mapping with names as keys.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text (byte {error.start}); save it as UTF-8") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path") from error
    try:
        data = yaml.load(text, Loader=_StrictLoader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"{path} line {mark.line + 1}" if mark else str(path)
        raise InputError(f"{place}: {_reason(error)}") from error
    except yaml.YAMLError as error:
        raise InputError(f"{path}: not YAML ({str(error).splitlines()[0]}); remove the character") from error
    except (RecursionError, ValueError) as error:
        raise InputError(f"{path}: not plain YAML ({error}); write keys and numbers only") from error
    if not isinstance(data, dict):
        found = "empty" if data is None else f"a {type(data).__name__}"
        raise InputError(f"{path}: the file is {found}, expected keys and values such as plant: wip")
    for key in data:
        if not isinstance(key, str):
            raise InputError(f"{path}: key {key!r} is not a name; write keys as text")
    return data


def finite_number(value: object) -> float | None:
    """The finite number that a value of a YAML file is; None where it is something else."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        return None
    return float(value)


def _reason(error: yaml.MarkedYAMLError) -> str:
    problem = error.problem or "syntax error"
    if "could not determine a constructor for the tag" in problem:
        tag = problem.split("'")[1].replace("tag:yaml.org,2002:", "!!")
        return f"tag {tag} is not allowed; write plain values only"
    if "given twice" in problem:
        return f"{problem}; keep one"
    return f"not YAML ({problem}); correct the line"
