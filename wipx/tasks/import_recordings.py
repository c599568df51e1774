"""`task=import`: what a log holds, and the recordings that it gives."""

import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from wipx.core.errors import InputError
from wipx.core.log_preview import LogPreview
from wipx.importing.mapping import LogMapping
from wipx.importing.pipeline import ImportedLog, import_log
from wipx.importing.writer import ROBOT_FILE, check_robot, copy_robot, write_recording
from wipx.report.log_preview_text import preview_text
from wipx.tasks.files.results import write_json, written_together
from wipx.tasks.shared.job import Job
from wipx.tasks.shared.progress import StageProgress

PREVIEW, PICTURE = "import.json", "import.png"


@dataclass(frozen=True)
class ImportRecordings:
    """Show what a log holds; with `write=true` write its recordings.

    Attributes:
        suffix: Of the recordings' files: "csv" or "parquet".
        robot: A robot.yaml that is put beside the recordings, with its model file; None for none.
    """

    suffix: Literal["csv", "parquet"] = "csv"
    robot: str | None = None

    def run(self, job: Job) -> None:
        """Write import.json and import.png, and the recordings where they are asked for."""
        mapping: LogMapping = job.part("log")
        write = bool(job.settings["write"])
        if write and not mapping.columns:
            raise InputError("write=true: no column is mapped; choose a mapping with import=OPTION, or write your own")
        if write:
            _check_empty(job.out)
        job.out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".reading-", dir=job.out) as work, StageProgress("import") as progress:
            imported = import_log(mapping, Path(work), progress)
            with written_together(job.out) as folder:
                self._write(imported, folder, write=write)
        print(preview_text(imported.preview))
        print(f"\n{self._last_line(job, imported.preview, write=write)}")

    def _write(self, imported: ImportedLog, folder: Path, *, write: bool) -> None:
        preview = imported.preview
        if write:
            self._write_set(imported, folder)
        write_json(folder / PREVIEW, preview_data(preview, self.suffix if write else None))
        if preview.columns:
            from wipx.report.log_preview_figure import draw_preview

            draw_preview(preview, folder / PICTURE)

    def _write_set(self, imported: ImportedLog, folder: Path) -> None:
        if not imported.recordings:
            raise InputError(
                f"{imported.preview.source}: no part of the log makes a recording; see why without write=true, and set "
                "log.longest_gap, log.longest_pause or log.shortest"
            )
        if self.robot is not None:
            check_robot(Path(self.robot), tuple(column.name for column in imported.preview.columns))
            copy_robot(Path(self.robot), folder)
        for recording in imported.recordings:
            write_recording(recording, folder / f"{recording.piece.name}.{self.suffix}")

    def _last_line(self, job: Job, preview: LogPreview, *, write: bool) -> str:
        count = len(preview.recordings)
        if not preview.columns:
            return f"Nothing is mapped; choose a mapping with import=OPTION. Details: {job.out / PREVIEW}"
        if not write:
            return f"picture: {job.out / PICTURE}\nNothing is written; write=true writes {count} recordings."
        robot = "" if self.robot is not None else f"; {ROBOT_FILE} is still missing there"
        return f"picture: {job.out / PICTURE}\n{count} recordings in {job.out}{robot}."


def preview_data(preview: LogPreview, suffix: str | None) -> dict[str, object]:
    """A preview as plain data; `suffix` of the written recordings, None where none were written."""
    content = {key: value for key, value in asdict(preview).items() if key not in ("traces", "offsets")}
    pieces = [
        {**asdict(piece), "file": f"{piece.name}.{suffix}" if suffix and piece.name else None}
        for piece in preview.pieces
    ]
    return {"schema": 1, **content, "pieces": pieces}


def _check_empty(out: Path) -> None:
    """Refuse a folder that has recordings already: they would count as recordings of this log."""
    old = sorted(path.name for path in out.glob("*") if path.suffix in (".csv", ".parquet")) if out.is_dir() else []
    if old:
        raise InputError(f"{out}: there are recordings already ({old[0]}); remove them, or set hydra.run.dir=FOLDER")
