"""Tests of a statistical claim fail a run on fresh draws where they fail more often than the claim allows."""

import subprocess
import sys
from pathlib import Path

import pytest
from statistical import DRAWS, claim_of, most_failures

HERE = Path(__file__).parent
TESTS = """
import numpy as np
import pytest

@pytest.mark.statistical(allowed=0.05)
@pytest.mark.parametrize("name", ["seldom"])
def test_claim(name, fresh_seed):
    assert np.random.default_rng(fresh_seed).random() > {rate}

def test_plain(fresh_seed):
    assert fresh_seed >= 0
"""


def run(folder: Path, rate: float, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A run of a claim that fails on that share of the draws."""
    for name in ("conftest.py", "statistical.py"):
        (folder / name).write_text((HERE / name).read_text())
    (folder / "test_claim.py").write_text(TESTS.format(rate=rate))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_failures_are_compared_with_what_chance_makes_of_the_rate():
    # P(X > 4) = 6e-5 and P(X > 3) = 1.03e-3 for ten draws at 5 %.
    assert [most_failures(DRAWS, rate) for rate in (0.0, 1e-3, 0.01, 0.05, 0.5)] == [0, 1, 2, 4, 9]


@pytest.mark.parametrize("nodeid", ["t.py::test_a[draw3]", "t.py::test_a[draw3-b]", "t.py::test_a[b-draw3]"])
def test_draws_of_a_test_belong_together(nodeid: str):
    assert claim_of(nodeid) in ("t.py::test_a", "t.py::test_a[b]")


def test_without_a_seed_a_claim_is_drawn_once(tmp_path: Path):
    assert "2 passed" in run(tmp_path, 0.0).stdout


@pytest.mark.slow
def test_a_claim_that_fails_seldom_passes_and_one_that_fails_often_fails(tmp_path: Path):
    seldom = run(tmp_path, 0.1, "--seed=5")
    assert seldom.returncode == 0, seldom.stdout
    assert f"of {DRAWS} draws failed, as its claim allows (0.05)" in seldom.stdout
    often = run(tmp_path, 0.9, "--seed=5", "-n", "1")  # draws in a process, counts in another
    assert often.returncode == 1
    assert "draws failed, MORE THAN ITS CLAIM ALLOWS (0.05)" in often.stdout
    assert "python -m pytest 'test_claim.py::test_claim[draw0-seldom]' --seed=5" in often.stdout
