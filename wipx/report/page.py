"""The report of an identification as one HTML page."""

from pathlib import Path

from wipx.core.results import IdentificationResult
from wipx.report.charts import chart_data, shown_traces
from wipx.report.estimates import marked_rows
from wipx.report.files import write_whole
from wipx.report.html import render
from wipx.report.outcome import headline, judged_errors, search_summary, signal_errors, windows_by_part


def write_page(result: IdentificationResult, path: Path) -> None:
    """Write the interactive page of an identification.

    Raises:
        InputError: the file cannot be written.
    """
    write_whole(path, page(result).encode("utf-8"))


def page(result: IdentificationResult) -> str:
    """The page's HTML; every text of the result is escaped."""
    shown = shown_traces(result)
    return render(
        "page.html",
        style=("page.css",),
        script=("charts.js", "page.js"),
        data=chart_data(result),
        content={
            "result": result,
            "headline": headline(result, arrow="\N{RIGHTWARDS ARROW}"),
            "judged": judged_errors(result),
            "errors": signal_errors(result),
            "windows": windows_by_part(result),
            "estimates": marked_rows(result.estimates),
            "search": search_summary(result),
            "traces": shown,
            "omitted": len(result.traces) - len(shown),
        },
    )
