"""The report as one HTML page that opens anywhere, also without a network: script, style and data are inside."""

import json
import math
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from wipx.core.results import Estimate, IdentificationResult
from wipx.report.charts import chart_data, shown_traces
from wipx.report.files import write_whole
from wipx.report.numbers import compact, significant
from wipx.report.outcome import FIT, HELD_OUT, headline, judged_errors, remark, search_summary, signal_errors
from wipx.report.tables import estimate_rows


@dataclass(frozen=True)
class IntervalMark:
    """Where an estimate's interval lies beside its value before, as positions from 0 to 100.

    Attributes:
        before: Of the value before the identification.
        value: Of the identified value.
        low: Of the lower end.
        high: Of the upper end.
    """

    before: float
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class EstimateRow:
    """A row of the page's table of identified parameters, ready to print.

    Attributes:
        cells: Texts under `ESTIMATES_HEAD`.
        mark: The interval drawn beside the value before; None where an end is unknown.
        doubtful: Whether the remark is a warning.
    """

    cells: tuple[str, ...]
    mark: IntervalMark | None
    doubtful: bool


def write_page(result: IdentificationResult, path: Path) -> None:
    """Write the interactive page of an identification.

    Raises:
        InputError: the file cannot be written.
    """
    write_whole(path, page(result).encode("utf-8"))


def page(result: IdentificationResult) -> str:
    """The page's HTML; every text of the result is escaped."""
    shown = shown_traces(result)
    environment = Environment(
        loader=PackageLoader("wipx.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"significant": significant, "compact": compact}
    return environment.get_template("page.html").render(
        result=result,
        headline=headline(result, arrow="\N{RIGHTWARDS ARROW}"),
        judged=judged_errors(result),
        errors=signal_errors(result),
        windows={HELD_OUT: result.held_out.windows if result.held_out else 0, FIT: result.fit.windows},
        estimates=[_estimate_row(*pair) for pair in zip(result.estimates, estimate_rows(result), strict=True)],
        search=search_summary(result),
        traces=shown,
        omitted=len(result.traces) - len(shown),
        style=Markup(_template("page.css")),
        script=Markup(_template("page.js")),
        plotly=Markup(_plotly()),
        data=Markup(_json_in_html(chart_data(result))),
    )


def _estimate_row(estimate: Estimate, cells: tuple[str, ...]) -> EstimateRow:
    return EstimateRow(cells, _mark(estimate), doubtful=bool(remark(estimate)))


def _mark(estimate: Estimate) -> IntervalMark | None:
    numbers = (estimate.nominal, estimate.value, estimate.low, estimate.high)
    left, right = min(numbers), max(numbers)
    if not all(math.isfinite(number) for number in numbers) or right <= left:
        return None
    return IntervalMark(*(100.0 * (number - left) / (right - left) for number in numbers))


def _json_in_html(data: dict) -> str:
    """JSON that cannot end the script element it stands in."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _template(name: str) -> str:
    return files("wipx.report").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def _plotly() -> str:
    """The source of plotly.js; plotly is imported late because it takes half a second."""
    from plotly.offline import get_plotlyjs

    return get_plotlyjs()
