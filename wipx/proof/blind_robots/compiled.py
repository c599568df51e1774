"""Compilation of the equations of motion, kept on disk in a folder named after this package's sources.

numba notices a change of the compiled function's own file only, not of the functions that it calls.
"""

import hashlib
import os
import tempfile
from pathlib import Path
from typing import Any

import numba
from numba.core import config as numba_settings

equation = numba.njit(error_model="numpy", nogil=True)


def _cache_folder() -> Path:
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).resolve().parent.rglob("*.py")):
        digest.update(source.read_bytes())
    name = f"blind-{digest.hexdigest()[:16]}"
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "wipx" / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.gettempdir()) / f"wipx-{name}"
    return folder


def kept(function):
    """Compile an entry point whose machine code is kept for the next run; NUMBA_CACHE_DIR moves it."""
    settings: Any = numba_settings  # its names are made at run time
    before = settings.CACHE_DIR
    if "NUMBA_CACHE_DIR" not in os.environ:
        settings.CACHE_DIR = str(_cache_folder())
    try:
        return numba.njit(error_model="numpy", nogil=True, cache=True)(function)
    finally:
        settings.CACHE_DIR = before
