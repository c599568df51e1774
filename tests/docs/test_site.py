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
PAGES = [*sorted(DOCS.rglob("*.md")), ROOT / "README.md"]
LONGEST = {"README.md": 130}  # lines; of other pages 250
sys.path.insert(0, str(DOCS / "site"))

from effect_pages import effect_pages  # noqa: E402
from equations import to_mathml  # noqa: E402
from option_pages import option_pages  # noqa: E402


def test_no_page_is_too_long():
    assert not [page for page in PAGES if len(page.read_text().splitlines()) > LONGEST.get(page.name, 250)]


def test_every_option_and_each_of_its_keys_is_on_a_page():
    pages = option_pages()
    for path in sorted((ROOT / "conf").glob("*/**/*.yaml")):
        group, *rest = path.relative_to(ROOT / "conf").with_suffix("").parts
        if group != "hydra":
            page = pages[f"reference/options/{group}.md"]
            section = page.partition(f"## {group}={'/'.join(rest)}\n")[2].partition("\n## ")[0]
            keys = set(yaml.safe_load(path.read_text()) or {}) - {"_target_", "defaults"}
            absent = [k for k in keys if not any(text in section for text in (f"`{k}`", f"`{k}.", f"\n{k}:"))]
            assert section, path
            assert not absent, path


def test_every_effect_has_a_page_with_its_law_parameters_and_source():
    pages = effect_pages()
    for name, effect in {**kinds(), **{f"trees/{kind}": effect for kind, effect in of_trees().items()}}.items():
        page = pages[f"reference/effects/{name}.md"]
        told = [effect.law, effect.source]
        told += [text for p in effect.parameters for text in (f"`{p.name}`", p.meaning)]
        assert not [text for text in told if text not in page], name


def test_robot_files_on_a_page_can_be_read(tmp_path: Path):
    for page in PAGES:
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


@pytest.mark.slow
def test_site_builds_without_a_warning_and_loads_nothing_from_the_network(tmp_path: Path):
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    loaded = re.compile(r'<(script|img|iframe)[^>]* src="?https?:|<link[^>]* href="?https?:[^>]*stylesheet')
    assert not [page for page in tmp_path.rglob("*.html") if loaded.search(page.read_text())]
