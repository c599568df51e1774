"""A table as data: read from the Markdown that a task has left, written as LaTeX and as a picture."""

from dataclasses import dataclass
from html import unescape
from pathlib import Path

from matplotlib.figure import Figure

from wipx.report.files import write_whole
from wipx.report.panels import picture
from wipx.report.tables import latex

CHARACTER, ROW = 0.085, 0.26  # [inch] of a picture


@dataclass(frozen=True)
class Table:
    """Named columns of texts.

    Attributes:
        head: Names of the columns.
        rows: Cells.
        numbers: Columns that are set flush right.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[int, ...] = ()

    def cell(self, key: tuple[str, ...], column: int) -> str | None:
        """The cell of the first row that begins with these cells; None where there is none."""
        return next((row[column] for row in self.rows if row[: len(key)] == key), None)

    def latex(self) -> str:
        """The table as a LaTeX tabular."""
        return latex(self.head, self.rows, self.numbers)

    def draw(self, path: Path) -> None:
        """Write the table as a picture, PNG or PDF.

        Raises:
            InputError: the file cannot be written.
        """
        cells = (self.head, *self.rows)
        widths = [max(len(row[i]) for row in cells) for i in range(len(self.head))]
        figure = Figure(figsize=(CHARACTER * (sum(widths) + 3 * len(widths)), ROW * (len(cells) + 1)))
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        axes.set_axis_off()
        drawn = axes.table(
            [list(row) for row in self.rows],
            colLabels=list(self.head),
            colWidths=[(width + 2) / (sum(widths) + 3 * len(widths)) for width in widths],
            loc="center",
            edges="horizontal",
        )
        drawn.auto_set_font_size(False)
        drawn.set_fontsize(8)
        for (_, column), cell in drawn.get_celld().items():
            cell.get_text().set_horizontalalignment("right" if column in self.numbers else "left")
            cell.get_text().set_parse_math(False)
        write_whole(path, picture(figure, path))


def tables_in(markdown: str) -> list[Table]:
    """All tables of a Markdown text, in their order."""
    found: list[Table] = []
    block: list[list[str]] = []
    for line in (*markdown.splitlines(), ""):
        if line.startswith("|"):
            block.append(_cells(line))
            continue
        if len(block) > 2:
            head, rules, *rows = block
            numbers = tuple(i for i, rule in enumerate(rules) if rule.endswith(":"))
            found.append(Table(tuple(head), tuple(map(tuple, rows)), numbers))
        block = []
    return found


def _cells(line: str) -> list[str]:
    bar = "\x00"
    inside = line.strip().removeprefix("|").removesuffix("|").replace("\\|", bar)
    return [unescape(cell.strip()).replace(bar, "|") for cell in inside.split("|")]
