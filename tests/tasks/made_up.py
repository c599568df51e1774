"""Parts that a test makes up: a class in a module of the package, and the configuration file that names it."""

import sys
import types
from pathlib import Path

import pytest
import yaml


def add_option(monkeypatch: pytest.MonkeyPatch, folder: Path, group: str, part: type, **settings: object) -> str:
    """Add `group=made_up`, which builds `part` with its settings; gives the argument that lets the program find it."""
    module = types.ModuleType("wipx.made_up")
    vars(module)[part.__name__] = part
    monkeypatch.setattr(part, "__module__", module.__name__)
    monkeypatch.setitem(sys.modules, module.__name__, module)
    path = folder / "conf" / group / "made_up.yaml"
    path.parent.mkdir(parents=True)
    path.write_text(yaml.safe_dump({"_target_": f"{module.__name__}.{part.__name__}", **settings}))
    return f"hydra.searchpath=[file://{folder / 'conf'}]"
