"""The site: every option and every effect has its place, examples are valid, and it builds without a warning."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from wipx.effects.catalogue import kinds, of_trees
from wipx.recordings.robot_file import robot_from_mapping

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
LONGEST = 250  # lines of a page
sys.path.insert(0, str(DOCS / "site"))

from effect_pages import effect_pages  # noqa: E402
from equations import to_mathml  # noqa: E402
from option_pages import option_pages  # noqa: E402


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md"], ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_page_is_too_long(page: Path):
    longest = 130 if page.name == "README.md" else LONGEST
    assert len(page.read_text().splitlines()) <= longest


@pytest.mark.parametrize("path", sorted((ROOT / "conf").glob("*/**/*.yaml")), ids=lambda path: path.stem)
def test_every_option_and_each_of_its_keys_is_on_a_page(path: Path):
    group, *rest = path.relative_to(ROOT / "conf").with_suffix("").parts
    if group == "hydra":
        return
    page = option_pages()[f"reference/options/{group}.md"]
    section = page.partition(f"## {group}={'/'.join(rest)}\n")[2].partition("\n## ")[0]
    assert section
    keys = set(yaml.safe_load(path.read_text()) or {}) - {"_target_", "defaults"}
    assert all(f"`{key}`" in section or f"`{key}." in section or f"\n{key}:" in section for key in keys)


@pytest.mark.parametrize("name", [*kinds(), *(f"trees/{kind}" for kind in of_trees())])
def test_every_effect_has_a_page_with_its_law_parameters_and_source(name: str):
    known = of_trees() if name.startswith("trees/") else kinds()
    effect, page = known[name.removeprefix("trees/")], effect_pages()[f"reference/effects/{name}.md"]
    assert effect.law in page
    assert effect.source in page
    assert all(f"`{parameter.name}`" in page and parameter.meaning in page for parameter in effect.parameters)


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md"], ids=lambda path: path.relative_to(ROOT).as_posix())
def test_robot_files_on_a_page_can_be_read(page: Path, tmp_path: Path):
    for block in re.findall(r"^```xml\n(.*?)^```$", page.read_text(), flags=re.DOTALL | re.MULTILINE):
        (tmp_path / "arm.xml").write_text(block)
    for block in re.findall(r"^```yaml\n(.*?)^```$", page.read_text(), flags=re.DOTALL | re.MULTILINE):
        content = yaml.safe_load(block)
        if "plant" in content:
            robot_from_mapping(content, page.name, tmp_path)


def test_equations_become_mathml():
    html = to_mathml(r'<span class="arithmatex">\(\frac{a}{b}\)</span> <div class="arithmatex">\[x &lt; 1\]</div>')
    assert html.count("<math") == 2
    assert "<mfrac>" in html
    assert "arithmatex" not in html


def test_site_builds_without_a_warning_and_loads_nothing_from_the_network(tmp_path: Path):
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    loaded = re.compile(r'<(script|img|iframe)[^>]* src="?https?:|<link[^>]* href="?https?:[^>]*stylesheet')
    assert not [page for page in tmp_path.rglob("*.html") if loaded.search(page.read_text())]
