"""Where compiled kernels are kept between runs.

numba notices a change of the kernel's own file only, not of the laws that it calls; the cache
folder is therefore named after the sources of all of them. NUMBA_CACHE_DIR moves it.
"""

import hashlib
import os
import tempfile
from pathlib import Path
from typing import Any

import numba
from numba.core import config as numba_settings

PACKAGE = Path(__file__).resolve().parent.parent


def _sources_digest() -> str:
    digest = hashlib.sha256()
    for folder in ("core", "effects", "sim"):
        for source in sorted((PACKAGE / folder).glob("*.py")):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> Path:
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = home / "wipx" / _sources_digest()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.gettempdir()) / f"wipx-{_sources_digest()}"
    return folder


def cached(function):
    """Compile a kernel, kept on disk for the next run."""
    if "NUMBA_CACHE_DIR" not in os.environ:
        settings: Any = numba_settings  # its names are made at run time
        settings.CACHE_DIR = str(_cache_folder())
    flags = {"nsz", "arcp", "contract", "afn", "reassoc"}
    return numba.njit(fastmath=flags, error_model="numpy", nogil=True, cache=True, boundscheck=False)(function)
