"""Compiled code that is kept between runs is never older than its sources."""

import shutil
from pathlib import Path

import pytest

from wipx.sim.cache import PACKAGE, sources_digest

MADE_UP = {
    "a/kernel.py": """
from wipx.b import rows as R
from wipx.b.law import force
from wipx.b.sizes import SPEED
from wipx.c.report import drawn

@cached
def step(x):
    return force(x) + SPEED * R.PLACE

def shown(x):
    return drawn(x)
""",
    "a/filter.py": "from wipx.b.sizes import SPEED\n\n@cached_for(SPEED)\ndef follow(x):\n    return x\n",
    "b/law.py": "@law\ndef force(x):\n    return 2.0 * x\n",
    "b/rows.py": "PLACE = 3\n",
    "b/sizes.py": "from wipx.b.units import METRE\nSPEED = 4.0 * METRE\n",
    "b/units.py": "METRE = 1.0\n",
    "c/report.py": "def drawn(x):\n    return x\n",
}
COMPILED = (
    "sim/kernel.py",
    "sim/rows.py",
    "effects/dead_zone.py",
    "diagnosis/likelihood/recording_batch.py",  # a constant of it is compiled into the observer
)


def changes(package: Path, source: str) -> bool:
    """Whether an edit of a source asks for compilation, which its undoing no longer does."""
    path, before = package / source, sources_digest(package)
    text = path.read_text(encoding="utf-8")
    path.write_text(f"{text}\n# edited\n", encoding="utf-8")
    changed = sources_digest(package) != before
    path.write_text(text, encoding="utf-8")
    assert sources_digest(package) == before
    return changed


def test_compiled_functions_and_all_they_use_ask_for_compilation(tmp_path: Path):
    for name, text in MADE_UP.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert [source for source in MADE_UP if not changes(tmp_path, source)] == ["c/report.py"]


@pytest.mark.slow
def test_an_edit_of_the_package_asks_for_compilation_where_compiled_code_needs_it(tmp_path: Path):
    package = Path(shutil.copytree(PACKAGE, tmp_path / "wipx", ignore=shutil.ignore_patterns("__pycache__", "conf")))
    assert not changes(package, "report/page.py")
    for source in COMPILED:
        assert changes(package, source), source


def test_what_a_blind_benchmark_hides_is_not_read(tmp_path: Path):
    hidden = tmp_path / "proof" / "blind_robots" / "trees" / "records.py"
    hidden.parent.mkdir(parents=True)
    hidden.write_text("@cached\ndef hidden(x):\n    return x\n", encoding="utf-8")
    assert not changes(tmp_path, "proof/blind_robots/trees/records.py")
