"""The dashboard as people see it: a headless browser reads the list of runs, a comparison and a picture.

WIPX_PICTURES=FOLDER keeps the pictures that it takes; those in docs/images are made so.
"""

import os
import re
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from wipx.core.errors import InputError
from wipx.tasks.dashboard import Dashboard
from wipx.tracking.dashboard import prepare, served
from wipx.tracking.run_note import RunNote, read_run_note
from wipx.tracking.views import CHARTS, TABLE, VIEWS, compared_by, view_states

OPTIMIZERS = ("least_squares", "cma_es", "pso", "ga")
PATIENCE = 120_000  # [ms]
QUIET = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--disable-background-networking", "--disable-sync")


def test_runs_are_compared_by_the_option_that_varies():
    view = VIEWS["adapt"]
    assert compared_by(view, {"optimizer": ["pso"] * 4, "method": ["ours", "pure_sim"], "seed": ["0", "1"]}) == "method"
    assert compared_by(view, {"optimizer": ["pso"]}) is None


def test_a_view_shows_only_metrics_that_the_runs_have():
    states = view_states(VIEWS["adapt"], {"fit/loss", "search/best_loss"}, "optimizer")
    columns = states[TABLE]["selectedColumns"]
    assert isinstance(columns, list)
    assert [name for name in columns if name.startswith("metrics")] == ["metrics.`fit/loss`"]
    charts = states[CHARTS]["compareRunCharts"]
    assert isinstance(charts, list)
    assert [(chart["type"], chart["metricKey"]) for chart in charts] == [
        ("BAR", "fit/loss"),
        ("LINE", "search/best_loss"),
    ]


def test_jobs_of_a_sweep_are_sorted_by_their_first_metric():
    sorted_by = [
        view_states(VIEWS["adapt"], {"fit/loss"}, None, swept)[TABLE].get("orderByKey") for swept in (True, False)
    ]
    assert sorted_by == ["metrics.`fit/loss`", None]


def test_a_folder_without_runs_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="there are no runs yet"):
        prepare(tmp_path)
    with pytest.raises(InputError, match=r"task\.port is 80, expected 1024"):
        Dashboard(port=80)


@pytest.fixture(scope="module")
def page() -> Iterator:
    """A page of a headless Chromium."""
    api = pytest.importorskip("playwright.sync_api", reason="needs the package playwright: pip install playwright")
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("needs a browser: apt-get install chromium")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=QUIET)
        page = browser.new_page(viewport={"width": 1500, "height": 940})
        page.set_default_timeout(PATIENCE)
        yield page
        browser.close()


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished sweep: four optimizers, two seeds, 1000 simulations each."""
    folder = tmp_path_factory.mktemp("sweep")
    command = [sys.executable, "-m", "wipx", "+experiment=ablation_optim", "-m", "seed=0,1", "task.per_load=1"]
    command += [f"optimizer={','.join(OPTIMIZERS)}", "optimizer.evaluations=1000"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "runs" / "ablation_optim"


@pytest.fixture(scope="module")
def server(sweep: Path) -> Iterator[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with served(sweep.parent, port) as address:
        yield address


def opened(page, address: str, name: str) -> str:
    """Text of a page once it shows what has a name; MLflow's assistant, which opens at first, is closed."""
    page.goto("about:blank")
    page.goto(address)
    page.get_by_text(name).first.wait_for()
    page.wait_for_timeout(3000)  # [ms] for the animations
    close = page.get_by_role("button", name="Close", exact=True)
    if close.count():
        close.first.click()
        page.wait_for_timeout(1000)
    return page.inner_text("body")


def pictures(folder: Path) -> Path:
    return Path(os.environ.get("WIPX_PICTURES", folder))


def notes(sweep: Path) -> list[RunNote]:
    return [read_run_note(path.parent) for path in sweep.glob("*/run.json")]


def metric(note: RunNote, name: str) -> float:
    value = note.metrics[name]
    assert value is not None
    return value


def seconds(text: str) -> float:
    """A duration as MLflow writes it [s]."""
    number, unit = re.fullmatch(r"([\d.]+)(s|min)", text).groups()  # pyright: ignore[reportOptionalMemberAccess]
    return float(number) * {"s": 1.0, "min": 60.0}[unit]


@pytest.mark.slow
def test_the_list_shows_every_job_by_name_from_the_least_loss_on_with_the_job_s_duration(
    sweep: Path, server: str, page, tmp_path: Path
):
    address = prepare(sweep.parent)["ablation_optim"]
    lines = opened(page, f"{server}/#{address}", "least_squares-0").splitlines()
    page.screenshot(path=pictures(tmp_path) / "dashboard_runs.png")
    jobs = {note.name: note for note in notes(sweep)}
    assert len(jobs) == 2 * len(OPTIMIZERS)
    listed = [jobs[line] for line in lines if line in jobs]
    losses = [metric(note, "fit/loss") for note in listed]
    assert len(losses) == len(jobs)
    assert losses == sorted(losses)
    assert {"optimizer", "seed", "fit/loss", "search/time in s"} <= set(lines)
    durations = [seconds(line) for line in lines if re.fullmatch(r"[\d.]+(s|min)", line)][: len(jobs)]
    assert durations == pytest.approx([note.ended - note.started for note in listed], rel=0.05)
    assert sum(line.startswith("trials of EmulatedTestbed") for line in lines) == len(jobs)


@pytest.mark.slow
def test_the_comparison_draws_the_mean_of_every_optimizer(sweep: Path, server: str, page, tmp_path: Path):
    address = prepare(sweep.parent)["ablation_optim"].replace(f"={TABLE}", f"={CHARTS}")
    text = opened(page, f"{server}/#{address}&compareRunsMode=CHART", "search/best_loss")
    page.screenshot(path=pictures(tmp_path) / "dashboard_charts.png")
    for optimizer in OPTIMIZERS:
        mean = np.mean(
            [metric(n, "search/evaluations") for n in notes(sweep) if n.parameters["optimizer"] == optimizer]
        )
        assert f"{mean:.2f}" in text
    assert page.locator(".js-plotly-plot").count() >= 4
    assert "comparison" in text


@pytest.mark.slow
def test_a_click_on_a_run_and_on_its_file_shows_the_picture(sweep: Path, server: str, page, tmp_path: Path):
    opened(page, f"{server}/#{prepare(sweep.parent)['ablation_optim']}", "least_squares-0")
    for name in ("pso-0", "Artifacts", "trajectories.png"):
        page.get_by_text(name, exact=True).first.click()
    shown = page.locator("img[src^='blob:'], img[src*='get-artifact']").first
    shown.wait_for()
    page.screenshot(path=pictures(tmp_path) / "dashboard_artifact.png")
    assert "pso-0" in page.inner_text("body")
    assert shown.evaluate("image => image.naturalWidth") == imread(sweep / "pso-0" / "trajectories.png").shape[1]
