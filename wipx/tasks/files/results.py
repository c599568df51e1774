"""Writing a task's results: all of them or none."""

import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from wipx.core.errors import InputError

RESULT = "result.json"  # what a job found, with its settings
UNFINISHED = ".unfinished-"
FIGURES = (".png", ".pdf")  # kinds of files in which tables of sweeps leave their figures
BEGIN, END = "<!-- table: begin -->\n", "<!-- table: end -->"


def replace_table(page: Path, table: str) -> None:
    """Replace what stands between the marks of a table in a Markdown page.

    Raises:
        InputError: the page or its marks are missing.
    """
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    head, begin, rest = text.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not (begin and end):
        raise InputError(f"{page}: no table to replace, expected a page with lines {BEGIN.strip()} and {END}")
    page.write_text(f"{head}{BEGIN}{table.rstrip()}\n{END}{tail}", encoding="utf-8")


@contextmanager
def written_together(out: Path) -> Iterator[Path]:
    """A folder to write results to; they appear in `out` when the block ends without an error.

    `RESULT`, by which a job counts as finished, appears after all others.

    Raises:
        InputError: `out` cannot be written.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        folder = Path(tempfile.mkdtemp(prefix=UNFINISHED, dir=out))
    except OSError as error:
        raise InputError(f"{out}: cannot write results here ({error.strerror}); set hydra.run.dir=FOLDER") from error
    try:
        yield folder
        for path in sorted(folder.iterdir(), key=lambda path: (path.name == RESULT, path.name)):
            target = out / path.name
            if target.is_dir():
                shutil.rmtree(target)
            path.replace(target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def write_json(path: Path, data: Mapping[str, object]) -> None:
    """Write JSON; numbers that do not exist become null."""
    path.write_text(json.dumps(_plain(data), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def write_csv(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Write columns of equal length; NaN becomes an empty cell."""
    lines = [",".join(columns)]
    rows = zip(*(np.asarray(c, dtype=float).tolist() for c in columns.values()), strict=True)
    lines += [",".join("" if value != value else f"{value:.9g}" for value in row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def flat(settings: Mapping[str, object], prefix: str = "") -> dict[str, object]:
    """Nested settings as one level, "optimizer.starts", so that runs compare."""
    level: dict[str, object] = {}
    for key, value in settings.items():
        name = f"{prefix}{key}"
        level |= flat(value, f"{name}.") if isinstance(value, Mapping) and value else {name: value}
    return level


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(v) for v in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    return value
