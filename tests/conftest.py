"""Fixtures that every test may use, and the seed of what tests draw at random.

A run draws the same numbers as the one before. `pytest --seed=N` draws others, `--seed=fresh` those that no run had; a
failed test says with which command it fails again. Draws depend on a test's name, not on its file. Under a seed other
than 0, tests of a statistical claim are repeated, see `statistical`.
"""

import hashlib
import os
import secrets
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from statistical import DRAWS, PROPERTY, Claims

ROOT = Path(__file__).resolve().parent.parent
FRESH = "fresh"

# The first call of a compiled law takes seconds.
settings.register_profile("fixed", deadline=None, derandomize=True)
settings.register_profile(FRESH, deadline=None)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--seed", default="0", help=f"of what tests draw at random: a number, or {FRESH}")
    parser.addoption("--update-docs", action="store_true", help="write the tables of docs/ that tests make")


def pytest_configure(config: pytest.Config) -> None:
    process = getattr(config, "workerinput", None)  # of pytest-xdist, None in the process that hands out the tests
    if process is not None:
        config.option.seed = process["seed"]
    elif config.option.seed == FRESH:
        config.option.seed = str(secrets.randbits(32))
    settings.load_profile("fixed" if config.option.seed == "0" else FRESH)
    if config.option.seed != "0" and process is None:
        config.pluginmanager.register(Claims())


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Give every process of a run the same seed."""
    node.workerinput["seed"] = node.config.option.seed


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Repeat statistical tests."""
    if metafunc.config.option.seed != "0" and metafunc.definition.get_closest_marker(PROPERTY):
        metafunc.fixturenames.append("draw")
        metafunc.parametrize("draw", range(DRAWS), ids=[f"draw{k}" for k in range(DRAWS)])


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let the reports of statistical tests carry the rate of failures that their claim allows."""
    for item in items if config.option.seed != "0" else ():
        claim = item.get_closest_marker(PROPERTY)
        if claim is not None:
            item.user_properties.append((PROPERTY, claim.kwargs["allowed"]))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.failed:
        seed = item.config.option.seed
        report.sections.append(("fails again with", f"python -m pytest '{item.nodeid}' --seed={seed}"))
    return report


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
def fresh_seed(request: pytest.FixtureRequest) -> int:
    """A seed of the test's own; another one with every `--seed`."""
    drawn = f"{request.config.option.seed} {request.node.name}"
    return int.from_bytes(hashlib.sha256(drawn.encode()).digest()[:4], "big")
