"""Text files that are written whole or not at all, whatever interrupts the writing."""

import os
from pathlib import Path


def write_whole(path: Path, text: str) -> None:
    """Write a text file, ending in a line feed, beside its place and move it there."""
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        draft.write_text(f"{text}\n", encoding="utf-8")
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)
