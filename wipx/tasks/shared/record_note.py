"""record.json: which command made the recordings of a folder, and what became of each trial."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from wipx.core.errors import InputError
from wipx.core.recording import Recording
from wipx.core.whole_file import write_whole

NOTE = "record.json"


def read_note(folder: Path) -> dict[str, Any]:
    """Overrides of the command, and origin, length and whether it was kept of every recording; empty without a note.

    Raises:
        InputError: the file is damaged.
    """
    path = folder / NOTE
    if not path.is_file():
        return {"command": [], "recordings": {}}
    try:
        note = json.loads(path.read_text(encoding="utf-8"))
        return {"command": list(note["command"]), "recordings": dict(note["recordings"])}
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: damaged ({error}); remove it, or set another hydra.run.dir") from error


def begin_note(folder: Path, overrides: Sequence[str]) -> None:
    """Note the command whose recordings a folder takes.

    Raises:
        InputError: the folder belongs to another command, or has recordings of another origin.
    """
    if not (folder / NOTE).is_file():
        old = sorted(path.name for path in (*folder.glob("*.csv"), *folder.glob("*.parquet")))
        if old:
            raise InputError(f"{folder}: there are recordings already ({old[0]}); set another hydra.run.dir")
        write_whole(folder / NOTE, json.dumps({"command": list(overrides), "recordings": {}}, indent=2))
    before = read_note(folder)["command"]
    if before != list(overrides):
        made = " ".join(["python", "-m", "wipx", *before])
        raise InputError(f"{folder}: made by another command, {made}; set another hydra.run.dir")


def note_recording(folder: Path, recording: Recording, *, kept: bool) -> None:
    """Note a trial that was recorded."""
    note = read_note(folder)
    note["recordings"][recording.name] = {
        "origin": recording.source,
        "seconds": recording.duration,
        "rows": len(recording),
        "kept": kept,
    }
    write_whole(folder / NOTE, json.dumps(note, indent=2))
