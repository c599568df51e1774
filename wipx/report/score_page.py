"""The score of blind diagnoses as one HTML page and as Markdown; the caller chooses the content of the cells."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from wipx.report.files import write_whole
from wipx.report.html import render


@dataclass(frozen=True)
class Link:
    """A cell that leads to another page.

    Attributes:
        text: What is shown.
        target: Address, relative to the page.
    """

    text: str
    target: str


@dataclass(frozen=True)
class Table:
    """A table with what it is about.

    Attributes:
        title: Heading.
        caption: How to read it.
        head: Names of the columns.
        rows: Cells; what follows a line break is secondary.
        numbers: Columns that are set flush right.
        folded: Whether the page shows it only on demand.
    """

    title: str
    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str | Link, ...], ...]
    numbers: tuple[int, ...] = ()
    folded: bool = False


@dataclass(frozen=True)
class Tile:
    """A main figure.

    Attributes:
        label: What it is.
        figure: The figure.
        unit: What it is out of, or its unit.
        remark: One clause more.
        worse: Whether it is marked as bad.
    """

    label: str
    figure: str
    unit: str
    remark: str
    worse: bool = False


@dataclass(frozen=True)
class Rate:
    """A share of cases with its interval, for a chart.

    Attributes:
        label: Of the group.
        text: The counts, in words.
        rate: Share; between 0 and 1 like the ends of its interval.
        low: Lower end of the 95 % interval.
        high: Upper end.
    """

    label: str
    text: str
    rate: float
    low: float
    high: float


@dataclass(frozen=True)
class Rates:
    """A chart of shares over groups.

    Attributes:
        title: What is shared.
        rates: One for each group.
    """

    title: str
    rates: tuple[Rate, ...]


@dataclass(frozen=True)
class Confusions:
    """How often what was hidden was answered by what.

    Attributes:
        hidden: Names of the rows.
        answered: Names of the columns.
        counts: By row and column.
        right: Whether that answer is right, by row and column.
    """

    hidden: tuple[str, ...]
    answered: tuple[str, ...]
    counts: tuple[tuple[int, ...], ...]
    right: tuple[tuple[bool, ...], ...]


@dataclass(frozen=True)
class ScorePage:
    """The content of the page of a blind run.

    Attributes:
        title: Of the page.
        headline: The outcome in a sentence or two.
        tiles: Figures to remember.
        notes: What a reader must know before relying on them.
        proof: Why the figures can be believed, as (what, how).
        check: Command that checks it all again.
        methods: The methods side by side; None for one method alone.
        groups: Tables of the cases by tier and the like.
        rates: Charts over the same groups.
        confusions: Answers to cases with at most one effect.
        misses: Cases that are not right, the worst first.
        details: Further tables.
    """

    title: str
    headline: str
    tiles: tuple[Tile, ...]
    notes: tuple[str, ...]
    proof: tuple[tuple[str, str], ...]
    check: str
    methods: Table | None
    groups: tuple[Table, ...]
    rates: tuple[Rates, ...]
    confusions: Confusions
    misses: Table
    details: tuple[Table, ...] = field(default=())


def write_score_page(page: ScorePage, path: Path) -> None:
    """Write the interactive page.

    Raises:
        InputError: the file cannot be written.
    """
    write_whole(path, score_page(page).encode("utf-8"))


def score_page(page: ScorePage) -> str:
    """The page's HTML; every text is escaped."""
    return render(
        "score.html",
        style=("page.css", "diagnosis.css", "score.css"),
        script=("charts.js", "score.js"),
        data={"rates": [asdict(chart) for chart in page.rates], "confusions": asdict(page.confusions)},
        content={"page": page},
    )


def score_markdown(page: ScorePage, *, links: bool = True) -> str:
    """The same as Markdown, without its title and charts.

    Args:
        page: The score.
        links: Whether cells lead to other pages; without, only their texts are shown.
    """
    tables = [page.methods, *page.groups, page.misses, *page.details]
    parts = [page.headline, *(f"Note: {note}" for note in page.notes)]
    parts += ["\n".join(f"- {what}: {how}" for what, how in page.proof)]
    parts += [_table(table, links) for table in tables if table is not None and table.rows]
    return "\n\n".join(parts) + "\n"


def _table(table: Table, links: bool) -> str:
    rules = ["---:" if column in table.numbers else "---" for column in range(len(table.head))]
    rows = [table.head, rules, *([_cell(cell, links) for cell in row] for row in table.rows)]
    lines = [_line(row) for row in rows]
    return "\n".join([f"## {table.title}\n", f"{table.caption}\n", *lines])


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(cell: str | Link, links: bool) -> str:
    """Text that neither ends its table cell nor becomes HTML; what follows a line break stands in brackets."""
    text, _, secondary = (cell.text if isinstance(cell, Link) else cell).partition("\n")
    if secondary:
        text = f"{text} [{secondary}]"
    for character, written in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ("|", "\\|"), ("\n", " ")):
        text = text.replace(character, written)
    return f"[{text}]({cell.target})" if links and isinstance(cell, Link) else text
