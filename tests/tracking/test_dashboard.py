"""The dashboard as people see it: a headless browser reads the list of runs, a comparison and a picture.

WIPX_PICTURES=FOLDER keeps the pictures that it takes; those in docs/images are made so.
"""

import os
import shutil
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from wipx.core.errors import InputError
from wipx.tasks.dashboard import Dashboard
from wipx.tracking.dashboard import prepare, served
from wipx.tracking.mlflow_store import MlflowTracking
from wipx.tracking.run_note import DataNote, RunNote, write_run_note
from wipx.tracking.views import CHARTS, TABLE, VIEWS, compared_by, view_states

LOSSES = {"least_squares": 0.9, "cma_es": 1.0, "pso": 1.4, "ga": 2.1}
PATIENCE = 120_000  # [ms]


def sweep_of_optimizers(folder: Path) -> None:
    """A logged sweep of eight searches, each with a picture and its course."""
    tracking = MlflowTracking(str(folder / "runs"))
    for i, (optimizer, loss) in enumerate(LOSSES.items()):
        for seed in (0, 1):
            out = folder / "runs" / "ablation_optim" / f"{optimizer}-{seed}"
            out.mkdir(parents=True)
            figure = Figure(figsize=(4, 3))
            figure.add_subplot().plot([9.0, loss])
            figure.savefig(out / "search.png")
            note = RunNote(
                out.name,
                "ablation_optim",
                1.7e9 + 100.0 * i,
                1.7e9 + 100.0 * i + 65.0,
                in_sweep=True,
                parameters={"task": "adapt", "optimizer": optimizer, "method": "ours", "seed": seed, "sim": "analytic"},
                metrics={"fit/loss": loss + 0.05 * seed, "search/time in s": 20.0 + i},
                histories={"search/best_loss": [[10 * k, loss + 8.0 / (1 + k)] for k in range(20)]},
                artifacts=["search.png"],
                tags={"method": "ours"},
                data=[DataNote("trials/1a2b", "runs/trials/1a2b", "1a2b", "adaptation")],
            )
            write_run_note(out, note)
            tracking.log(out)


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
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1600, "height": 900})
        page.set_default_timeout(PATIENCE)
        yield page
        browser.close()


@pytest.mark.slow
def test_a_browser_shows_runs_by_name_with_their_metrics_their_comparison_and_their_pictures(tmp_path: Path, page):
    pictures = Path(os.environ.get("WIPX_PICTURES", tmp_path))
    sweep_of_optimizers(tmp_path)
    (address,) = prepare(tmp_path / "runs").values()
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with served(tmp_path / "runs", port) as server:
        page.goto(f"{server}/#{address}")
        page.get_by_text("least_squares-0").first.wait_for()
        page.wait_for_timeout(2000)
        page.screenshot(path=pictures / "dashboard_runs.png")
        text = page.inner_text("body")
        assert "ablation_optim" in text
        assert "1.1min" in text  # 65 s, the job's own time
        for column in ("optimizer", "fit/loss", "search/time in s"):
            assert column in text
        assert "trials/1a2b" in text

        page.goto("about:blank")
        page.goto(f"{server}/#{address.replace(f'={TABLE}', f'={CHARTS}')}&compareRunsMode=CHART")
        page.get_by_text("search/best_loss").first.wait_for()
        page.wait_for_timeout(4000)
        page.screenshot(path=pictures / "dashboard_charts.png")
        assert "comparison" in page.inner_text("body")
        assert page.locator(".js-plotly-plot").count() >= 3

        run = MlflowTracking(str(tmp_path / "runs"))
        from mlflow import MlflowClient

        client = MlflowClient(run.store)
        experiment = client.get_experiment_by_name("ablation_optim")
        assert experiment is not None
        (found,) = client.search_runs([experiment.experiment_id], "attributes.run_name = 'pso-0'")
        place = f"/experiments/{experiment.experiment_id}/runs/{found.info.run_id}/artifacts/search.png"
        page.goto(f"{server}/#{place}")
        picture = page.locator("img[src^='blob:'], img[src*='get-artifact']").first
        picture.wait_for()
        page.wait_for_timeout(1000)
        page.screenshot(path=pictures / "dashboard_artifact.png")
        assert "pso-0" in page.inner_text("body")
        assert picture.evaluate("image => image.naturalWidth") == 400
