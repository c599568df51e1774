"""The outcome as Markdown tables and as plain text for a terminal."""

from collections.abc import Sequence

from wipx.core.results import Estimate, IdentificationResult
from wipx.report.numbers import MISSING, compact, significant, with_interval
from wipx.report.outcome import ModelComparison, headline, remark, search_summary, signal_errors

ERRORS_HEAD = ("recordings", "signal", "unit", "nominal", "completed", "noise floor", "change")
ESTIMATES_HEAD = ("parameter", "meaning", "unit", "before", "value", "95 % interval", "remark")


def errors_table(result: IdentificationResult) -> str:
    """Prediction errors per signal as a Markdown table, held-out recordings first."""
    return _markdown(ERRORS_HEAD, error_rows(result), numbers=(3, 4, 5))


def estimates_table(result: IdentificationResult) -> str:
    """Identified parameters with their 95 % intervals as a Markdown table."""
    return _markdown(ESTIMATES_HEAD, estimate_rows(result.estimates), numbers=(3, 4))


def summary(result: IdentificationResult) -> str:
    """The whole outcome as aligned plain text: errors, parameters, search and notes."""
    lines = [f"{result.title} ({result.plant})", headline(result), ""]
    lines += _aligned(ERRORS_HEAD, error_rows(result), numbers=(3, 4, 5))
    if result.estimates:
        rows = [(name, *rest) for name, _, *rest in estimate_rows(result.estimates)]
        lines += ["", *_aligned((ESTIMATES_HEAD[0], *ESTIMATES_HEAD[2:]), rows, numbers=(2, 3))]
    lines += ["", search_summary(result)]
    lines += [f"note: {note}" for note in result.notes]
    return "\n".join(lines)


def error_rows(result: ModelComparison) -> list[tuple[str, ...]]:
    """Cells under `ERRORS_HEAD`."""
    return [
        (
            row.recordings,
            row.signal,
            row.scale.unit,
            significant(row.nominal),
            significant(row.completed),
            significant(row.noise_floor),
            row.change,
        )
        for row in signal_errors(result)
    ]


def estimate_rows(estimates: Sequence[Estimate]) -> list[tuple[str, ...]]:
    """Cells under `ESTIMATES_HEAD`, in SI units so that they can be compared with a model file."""
    rows = []
    for estimate in estimates:
        shown = with_interval(estimate.value, estimate.low, estimate.high)
        before = compact(estimate.nominal)
        cells = (estimate.name, estimate.meaning, estimate.unit, before, shown.value, shown.ends, remark(estimate))
        rows.append(cells)
    return rows


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: tuple[int, ...]) -> str:
    """A GitHub table; columns in `numbers` are set flush right."""
    rules = ["---:" if column in numbers else "---" for column in range(len(head))]
    cells = [[_cell(text) for text in row] for row in rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rules, *cells)) + "\n"


def _cell(text: str) -> str:
    """Text that neither ends its table cell nor becomes HTML."""
    for character, written in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ("|", "\\|"), ("\n", " ")):
        text = text.replace(character, written)
    return text


def _aligned(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: tuple[int, ...]) -> list[str]:
    """Lines of a table with columns of equal width; columns in `numbers` are set flush right."""
    cells = [tuple(head), *((*(text or MISSING for text in row[:-1]), row[-1]) for row in rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    return [
        "  ".join(
            text.rjust(width) if column in numbers else text.ljust(width)
            for column, (text, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in cells
    ]
