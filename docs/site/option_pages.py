"""One page for each group of options, from its files in conf/ and the dataclasses that they build."""

import re
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import yaml
from docstrings import attributes
from markdown_table import table

from wipx.config import RunConfig

CONF = Path(__file__).resolve().parents[2] / "conf"
FOLDER = "reference/options"
NOT_OPTIONS = ("hydra",)  # set up the program itself
LONGEST = 60  # characters of a value in a table
INLINE = re.compile(r"^(?P<key>[\w.]+):(?P<value>[^#]*?)\s*#\s*(?P<comment>.*)$")


def option_pages() -> dict[str, str]:
    """Markdown by path, the index among them."""
    folders = sorted(path for path in CONF.iterdir() if path.is_dir() and path.name not in NOT_OPTIONS)
    pages = {f"{FOLDER}/{folder.name}.md": _group(folder) for folder in folders}
    pages[f"{FOLDER}/index.md"] = _index(folders)
    return pages


def _index(folders: list[Path]) -> str:
    meaning = attributes(RunConfig)
    rows = [
        (f"[`{folder.name}`]({folder.name}.md)", ", ".join(map("`{}`".format, _names(folder))), _meaning(folder))
        for folder in folders
    ]
    root = [(f"`{key}`", f"`{value}`", meaning.get(key, "")) for key, value in _root_keys().items()]
    return (
        "# Options\n\nEvery part is a [Hydra](https://hydra.cc) configuration group: `GROUP=OPTION` chooses one, "
        "`GROUP.KEY=VALUE` sets one of its values. A misspelt name is refused with a list of the valid ones.\n\n"
        f"## Groups\n\n{table(('group', 'options', 'what it is'), rows)}\n\n"
        f"## Root keys\n\n{table(('key', 'default', 'meaning'), root)}\n"
    )


def _root_keys() -> dict[str, object]:
    content = yaml.safe_load((CONF / "config.yaml").read_text())
    return {key: value for key, value in content.items() if key not in ("defaults", "hydra")}


def _names(folder: Path) -> list[str]:
    return [path.relative_to(folder).with_suffix("").as_posix() for path in sorted(folder.rglob("*.yaml"))]


def _group(folder: Path) -> str:
    options = "\n\n".join(_option(folder, name) for name in _names(folder))
    return f"# {folder.name}\n\n{_meaning(folder)}\n\n{options}\n"


def _meaning(folder: Path) -> str:
    return attributes(RunConfig).get(folder.name) or _NOT_A_PART.get(folder.name, "")


_NOT_A_PART = {
    "import": "What `task=import` makes of a log: `import=NAME` sets `log`, whose values are `log.KEY=VALUE`.",
    "experiment": "Settings that belong together. `+experiment=NAME` chooses one; where it lists a sweep, add `-m`.",
    "profile": "How much of an experiment is run: `profile=NAME`.",
    "published": "What the authors of public recordings found; only the tables read it.",
}


def _option(folder: Path, name: str) -> str:
    """The section of one file: its own words, what it builds, and its settings."""
    text = (folder / f"{name}.yaml").read_text()
    content = yaml.safe_load(text) or {}
    target = content.get("_target_")
    parts = [f"## {folder.name}={name}", _opening_comment(text)]
    if target is None:
        parts.append(f"```yaml\n{_body(text)}\n```")
        return "\n\n".join(part for part in parts if part)
    parts.append(f"Builds `{target}`.")
    rows = _settings(_class_of(target), content, _inline_comments(text))
    head = ("key", "value", "type", "meaning", "comment in the file")
    parts.append(table(head, rows) if rows else "It has no settings.")
    if "defaults" in content:
        listed = "\n".join(f"- {entry}" for entry in content["defaults"] if entry != "_self_")
        parts.append(f"Parts that it includes:\n\n{listed}")
    return "\n\n".join(part for part in parts if part)


def _settings(
    built: type, content: dict[str, Any], comments: dict[str, str], prefix: str = ""
) -> list[tuple[str, ...]]:
    """One row for each field of the dataclass, with the file's value or else the field's own."""
    meaning = attributes(built)
    rows = []
    for item in fields(built):
        if item.init:
            default = item.default_factory() if item.default_factory is not MISSING else item.default
            value = content.get(item.name, default)
            name = f"{prefix}{item.name}"
            if isinstance(item.type, type) and is_dataclass(item.type) and isinstance(value, dict):
                rows += _settings(item.type, value, {}, f"{name}.")
                continue
            shown = "" if value is MISSING else _short(value)
            note = item.metadata.get("note")  # of a rule of the diagnosis
            said = note.meaning if note else meaning.get(item.name, ""), comments.get(item.name, "")
            rows.append((f"`{name}`", shown, f"`{_kind(item.type)}`", *said))
    return rows


def _kind(annotation: object) -> str:
    """An annotation as its module writes it."""
    text = annotation.__name__ if isinstance(annotation, type) else str(annotation)
    return re.sub(r"\b(typing|collections\.abc)\.", "", text)


def _short(value: object) -> str:
    plain = isinstance(value, str | int | float | bool | list | dict | None)
    text = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10**6) if plain else str(value)
    text = text.strip().removesuffix("...").strip()
    return f"`{text}`" if len(text) <= LONGEST else f"`{text[:LONGEST]}` …"


@cache
def _class_of(target: str) -> type:
    module, _, name = target.rpartition(".")
    return getattr(import_module(module), name)


def _opening_comment(text: str) -> str:
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        if "@package" not in line:
            lines.append(line.lstrip("# "))
    return " ".join(lines)


def _body(text: str) -> str:
    lines = text.splitlines()
    while lines and lines[0].startswith("#"):
        lines.pop(0)
    return "\n".join(lines)


def _inline_comments(text: str) -> dict[str, str]:
    """Comments behind a value, and on the line above one."""
    found: dict[str, str] = {}
    above: list[str] = []
    started = False
    for line in text.splitlines():
        if line.startswith("#"):
            above.append(line.lstrip("# "))
            continue
        inline = INLINE.match(line)
        key = re.match(r"^(\w+):", line)
        if key and key[1] != "_target_" and started and above:
            found[key[1]] = " ".join(above)
        if inline:
            found[inline["key"]] = " ".join(filter(None, (found.get(inline["key"]), inline["comment"])))
        above, started = [], True
    return found
