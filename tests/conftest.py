"""Fixtures that every test may use."""

import os
import secrets
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parent.parent

settings.register_profile("wipx", deadline=None)  # the first call of a compiled law takes seconds
settings.load_profile("wipx")


def _data(variable: str, name: str) -> Path:
    folder = Path(os.environ.get(variable, ROOT.parent / "shared" / name))
    if not folder.is_dir():
        pytest.skip(f"there is no folder {folder}; set {variable} to the {name}")
    return folder


@pytest.fixture(scope="session")
def examples() -> Path:
    """Emulated recording sets with a known answer; the environment variable WIPX_EXAMPLES moves them."""
    return _data("WIPX_EXAMPLES", "examples")


@pytest.fixture(scope="session")
def recordings_root() -> Path:
    """Recording sets of real robots; the environment variable WIPX_RECORDINGS moves them."""
    return _data("WIPX_RECORDINGS", "recordings")


@pytest.fixture
def fresh_seed() -> int:
    """A seed that no earlier test run had; printed, so that a failure can be repeated."""
    seed = secrets.randbits(32)
    print(f"seed {seed}")
    return seed
