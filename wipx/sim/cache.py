"""Where compiled kernels are kept between runs.

numba notices a change of the kernel's own file only, not of what it calls in other modules; the cache folder is
therefore named after the sources of all modules that have compiled code. NUMBA_CACHE_DIR moves it.
"""

import hashlib
import os
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config as numba_settings

PACKAGE = Path(__file__).resolve().parent.parent
UNSEEN = "concealed"  # folder whose code is its own, and which nothing else may open
COMPILED = ("wipx.sim.cache import cached", "wipx.core.law import", "wipx.sim import rows")  # marks of such modules


def sources_digest(package: Path) -> str:
    """Digest of the sources of all modules of a package that have compiled code, or constants of it."""
    digest = hashlib.sha256()
    for source in sorted(package.rglob("*.py")):
        if source.parent.name == UNSEEN:
            continue
        text = source.read_bytes()
        if source.parent.name in ("core", "effects", "sim") or any(mark.encode() in text for mark in COMPILED):
            digest.update(text)
    return digest.hexdigest()[:16]


@cache
def _cache_folder() -> Path:
    digest = sources_digest(PACKAGE)
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = home / "wipx" / digest
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.gettempdir()) / f"wipx-{digest}"
    return folder


def cached(function):
    """Compile a kernel, kept on disk for the next run."""
    if "NUMBA_CACHE_DIR" not in os.environ:
        settings: Any = numba_settings  # its names are made at run time
        settings.CACHE_DIR = str(_cache_folder())
    flags = {"nsz", "arcp", "contract", "afn", "reassoc"}
    return numba.njit(fastmath=flags, error_model="numpy", nogil=True, cache=True, boundscheck=False)(function)
