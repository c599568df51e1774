"""All tables and figures on one page, the paper's printed figures beside ours; each table as LaTeX and picture too."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from wipx.report.files import write_whole
from wipx.report.html import render
from wipx.report.printed import comparison
from wipx.report.table import Table, tables_in

TITLES = {
    "friction": "Joint friction (Fig. 3)",
    "trajectories": "Reality gap and trajectories of the methods (Fig. 4)",
    "methods": "Estimators trained in the simulations of five methods (Table I)",
    "estimators": "Estimators and lengths of their windows (Table II)",
    "optimizers": "Optimizers (Fig. 8)",
    "control": "Balancing and tracking under unknown loads (Sec. VI-B, Figs. 6 and 7)",
    "margins": "Stability margins, and loads from which controllers recover (ours)",
    "blind": "Blind diagnoses of robots with hidden physics (ours)",
    "real": "Diagnoses of real machines (ours)",
}
MARKDOWN = ("table.md", "score.md")  # where tasks leave their tables
PICTURES = (".png", ".gif")


@dataclass(frozen=True)
class Part:
    """What the page shows of one part.

    Attributes:
        title: Heading.
        tables: Its tables, each with the links to its files.
        pictures: Addresses of its figures.
        files: Addresses of its other files.
        failed: Why it could not be made; empty where it could.
    """

    title: str
    tables: tuple[Table, ...]
    pictures: tuple[str, ...]
    files: tuple[str, ...]
    failed: str = ""


def write_tables_page(folder: Path, names: tuple[str, ...], failed: Mapping[str, str]) -> None:
    """Write index.html, and LaTeX, PNG and PDF of each table, beside the folders of the parts.

    Args:
        folder: Holds a folder for each part.
        names: Of all parts, in their order; one that was never made is left out.
        failed: Why a part could not be made, by its name.

    Raises:
        InputError: a file cannot be written.
    """
    tables = {name: _tables(folder / name) for name in names if (folder / name).is_dir()}
    for name, found in tables.items():
        for i, table in enumerate(found):
            _write(table, folder / name / f"table{i + 1}")
    compared = comparison(tables)
    _write(compared, folder / "comparison")
    parts = [_part(folder, name, tables[name], failed.get(name, "")) for name in tables]
    page = render(
        "tables.html",
        style=("page.css",),
        script=(),
        data={},
        content={"compared": compared, "parts": parts},
    )
    # Pictures stand beside this page as files.
    write_whole(folder / "index.html", page.replace("img-src data: blob:", "img-src 'self' file: data:").encode())


def _tables(folder: Path) -> list[Table]:
    return [
        table
        for name in MARKDOWN
        if (folder / name).is_file()
        for table in tables_in((folder / name).read_text(encoding="utf-8"))
    ]


def _write(table: Table, place: Path) -> None:
    write_whole(place.with_suffix(".tex"), table.latex().encode("utf-8"))
    for suffix in (".png", ".pdf"):
        table.draw(place.with_suffix(suffix))


def _part(folder: Path, name: str, tables: list[Table], failed: str) -> Part:
    drawn = {f"table{i + 1}" for i in range(len(tables))}
    files = sorted(path for path in (folder / name).iterdir() if path.is_file() and not path.name.startswith("."))
    pictures = [path for path in files if path.suffix in PICTURES and path.stem not in drawn]
    return Part(
        TITLES.get(name, name),
        tuple(tables),
        tuple(os.path.relpath(path, folder) for path in pictures),
        tuple(os.path.relpath(path, folder) for path in files if path not in pictures),
        failed,
    )
