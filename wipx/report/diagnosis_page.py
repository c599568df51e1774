"""The report of a diagnosis as one HTML page."""

from pathlib import Path

from wipx.core.diagnosis import Diagnosis
from wipx.report.charts import shown_traces
from wipx.report.diagnosis_charts import MOST_RUNS, diagnosis_data, titled_curves
from wipx.report.diagnosis_rows import (
    bound_rows,
    candidate_bars,
    effect_rows,
    menu_bars,
    model_rows,
    site_bars,
    suspect_rows,
)
from wipx.report.diagnosis_words import (
    PLANTS,
    VERDICTS,
    minor_sentence,
    period_sentence,
    region_sentence,
    remainder_sentences,
    unexplained_sentence,
)
from wipx.report.drawing import svg
from wipx.report.estimates import marked_rows
from wipx.report.files import write_whole
from wipx.report.html import render
from wipx.report.outcome import judged_errors, signal_errors, windows_by_part
from wipx.report.robot_picture import robot_picture

PLAIN_CANDIDATES = 10  # beside the chosen ones; the others are folded away


def write_diagnosis_page(diagnosis: Diagnosis, path: Path) -> None:
    """Write the interactive page of a diagnosis.

    Raises:
        InputError: the file cannot be written.
    """
    write_whole(path, diagnosis_page(diagnosis).encode("utf-8"))


def diagnosis_page(diagnosis: Diagnosis) -> str:
    """The page's HTML; every text of the diagnosis is escaped."""
    shown = shown_traces(diagnosis)
    location = diagnosis.location
    runs = len(location.map.runs) if location.map else 0
    bars = candidate_bars(diagnosis)
    plain = [bar for bar in bars if not bar.chosen][:PLAIN_CANDIDATES]
    return render(
        "diagnosis.html",
        style=("page.css", "diagnosis.css"),
        script=("charts.js", "diagnosis.js"),
        data=diagnosis_data(diagnosis),
        content={
            "diagnosis": diagnosis,
            "plant": PLANTS.get(diagnosis.model.plant.kind, diagnosis.model.plant.kind),
            "verdict": VERDICTS[diagnosis.verdict],
            "judged": judged_errors(diagnosis),
            "errors": signal_errors(diagnosis),
            "windows": windows_by_part(diagnosis),
            "traces": shown,
            "omitted": len(diagnosis.traces) - len(shown),
            "effects": effect_rows(diagnosis),
            "minor": minor_sentence(diagnosis),
            "suspects": suspect_rows(diagnosis),
            "sites": site_bars(diagnosis),
            "picture": _picture(diagnosis),
            "places": [
                *(region_sentence(region, diagnosis.units) for region in location.regions),
                *(period_sentence(period) for period in location.times),
            ],
            "omitted_runs": max(0, runs - MOST_RUNS),
            "curves": titled_curves(diagnosis),
            "candidates": [bar for bar in bars if bar.chosen or bar in plain],
            "other_candidates": [bar for bar in bars if not bar.chosen and bar not in plain],
            "corrected": marked_rows(diagnosis.corrected),
            "bounds": bound_rows(diagnosis),
            "unexplained": unexplained_sentence(diagnosis),
            "remainder": remainder_sentences(diagnosis) if diagnosis.unexplained.significant else (),
            "menu": menu_bars(diagnosis),
            "model_rows": model_rows(diagnosis),
        },
    )


def _picture(diagnosis: Diagnosis) -> str:
    """A robot from a model file in the middle of its first recording, with the mismatch coloured; empty for others."""
    tree = diagnosis.model.plant.tree
    if tree is None:
        return ""
    recorded = diagnosis.traces[0].recorded if diagnosis.traces else {}
    posture = {joint: float(values[len(values) // 2]) for joint, values in recorded.items()}
    return svg(robot_picture(tree, posture, dict(diagnosis.location.sites)))
