"""Mappings of the tests, and what they give."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from wipx.app import configuration_folder
from wipx.config import build
from wipx.importing.pipeline import ImportedLog, import_log


def mapping(option: str, **changes: Any) -> Any:
    """A mapping that ships, with other settings."""
    content = yaml.safe_load((configuration_folder() / "import" / f"{option}.yaml").read_text())
    for group in ("format", "columns"):
        content[group] = {**content[group], **changes.pop(group, {})}
    return build({**content, **changes}, "log")


@pytest.fixture
def imported(tmp_path: Path) -> Callable[..., ImportedLog]:
    """Imports a log by a mapping that ships, with other settings."""

    def run(path: Path, option: str, **changes: Any) -> ImportedLog:
        work = tmp_path / "work" / str(len(list((tmp_path / "work").glob("*"))))
        work.mkdir(parents=True)
        return import_log(mapping(option, path=str(path), **changes), work, lambda stage, share: None)

    return run
