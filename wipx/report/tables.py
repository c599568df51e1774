"""The outcome as Markdown tables and as plain text for a terminal."""

from collections.abc import Sequence

from wipx.core.results import Estimate, IdentificationResult
from wipx.report.numbers import MISSING, compact, significant, with_interval
from wipx.report.outcome import ModelComparison, headline, remark, search_summary, signal_errors

ERRORS_HEAD = ("recordings", "signal", "unit", "nominal", "completed", "noise floor", "change")
ESTIMATES_HEAD = ("parameter", "meaning", "unit", "before", "value", "95 % interval", "remark")


def summary(result: IdentificationResult) -> str:
    """The whole outcome as aligned plain text: errors, parameters, search and notes."""
    lines = [f"{result.title} ({result.plant})", headline(result), ""]
    lines += aligned(ERRORS_HEAD, error_rows(result), numbers=(3, 4, 5))
    if result.estimates:
        rows = [(name, *rest) for name, _, *rest in estimate_rows(result.estimates)]
        lines += ["", *aligned((ESTIMATES_HEAD[0], *ESTIMATES_HEAD[2:]), rows, numbers=(2, 3))]
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


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: tuple[int, ...]) -> str:
    """A GitHub table; columns in `numbers` are set flush right.

    Args:
        head: Names of the columns.
        rows: Their cells.
        numbers: Columns that hold numbers.
    """
    rules = ["---:" if column in numbers else "---" for column in range(len(head))]
    cells = [[_cell(text) for text in row] for row in rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rules, *cells)) + "\n"


def latex(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: tuple[int, ...]) -> str:
    """The same as a LaTeX tabular with rules of booktabs; arguments as of `markdown`."""
    columns = "".join("r" if column in numbers else "l" for column in range(len(head)))
    lines = [f"\\begin{{tabular}}{{{columns}}}", "\\toprule", _latex_row(head), "\\midrule"]
    return "\n".join([*lines, *map(_latex_row, rows), "\\bottomrule", "\\end{tabular}"]) + "\n"


def _latex_row(cells: Sequence[str]) -> str:
    return " & ".join(map(_latex_cell, cells)) + " \\\\"


def _latex_cell(text: str) -> str:
    """Text in which no character means anything to LaTeX."""
    special = {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"}
    escaped = "".join(special.get(c, f"\\{c}" if c in "&%$#_{}" else c) for c in text)
    return escaped.replace("+-", r"$\pm$")


def _cell(text: str) -> str:
    """Text that neither ends its table cell nor becomes HTML."""
    for character, written in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ("|", "\\|"), ("\n", " ")):
        text = text.replace(character, written)
    return text


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], numbers: tuple[int, ...]) -> list[str]:
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
