"""Where compiled kernels are kept between runs.

numba notices a change of the kernel's own file only, not of what it takes from other modules. The cache folder is
therefore named after the sources of all compiled functions and of everything that these take from other modules.
NUMBA_CACHE_DIR moves it.
"""

import ast
import hashlib
import os
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config as numba_settings

from wipx.core.law import IN_PLACE, OPTIONS

PACKAGE = Path(__file__).resolve().parent.parent
UNSEEN = "blind_robots"  # folder whose code is its own, and which nothing else may open
COMPILED = ("cached", "cached_for", "in_place", "law", "inlined", "part")  # decorators
KEPT: dict[str, Any] = {**OPTIONS, "nogil": True, "cache": True, "boundscheck": False}
AHEAD: list[tuple[Any, tuple[Any, ...]]] = []  # kernels that take long to compile, each with the types of its arguments


def sources_digest(package: Path) -> str:
    """Digest of the sources of a package's compiled functions, and of the modules that these take names from."""
    marks = [f"@{name}{end}" for name in COMPILED for end in "\n("]
    todo = [path for path in package.rglob("*.py") if UNSEEN not in path.parts]
    todo = [path for path in todo if any(mark in path.read_text(encoding="utf-8") for mark in marks)]
    found: set[Path] = set()
    while todo:
        path = todo.pop()
        if path not in found and path.is_file():
            found.add(path)
            todo += _taken_from(path, package)
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(found))).hexdigest()[:16]


def simulator_digest(package: Path = PACKAGE) -> str:
    """Digest of the sources of the laws and of the engines: what was simulated with others is to be made anew."""
    sources = sorted(path for folder in ("effects", "sim") for path in (package / folder).rglob("*.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]


def _taken_from(source: Path, package: Path) -> Iterator[Path]:
    """Modules of the package from which the compiled functions and the constants of a source take names."""
    tree = ast.parse(source.read_bytes())
    users = [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign) or _is_compiled(node)]
    names = {node.id for user in users for node in ast.walk(user) if isinstance(node, ast.Name)}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.module and node.module.partition(".")[0] == "wipx":
            folder = package.joinpath(*node.module.split(".")[1:])
            for alias in node.names:
                if (alias.asname or alias.name) in names:
                    yield folder.with_suffix(".py")
                    yield folder / f"{alias.name}.py"


def _is_compiled(node: ast.stmt) -> bool:
    if not isinstance(node, ast.FunctionDef):
        return False
    used = [one.func if isinstance(one, ast.Call) else one for one in node.decorator_list]
    return any(isinstance(one, ast.Name) and one.id in COMPILED for one in used)


@cache
def compiled_folder() -> Path:
    """Folder of compiled code, named after its sources; NUMBA_CACHE_DIR moves only what numba keeps itself."""
    digest = sources_digest(PACKAGE)
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = home / "wipx" / digest
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.gettempdir()) / f"wipx-{digest}"
    return folder


def _keep_on_disk() -> None:
    if "NUMBA_CACHE_DIR" not in os.environ:
        settings: Any = numba_settings  # its names are made at run time
        settings.CACHE_DIR = str(compiled_folder())


def cached(function):
    """Compile a kernel, kept on disk for the next run. What it calls is a `law` or `inlined` (`wipx.core.law`)."""
    _keep_on_disk()
    return numba.njit(**KEPT)(function)


def in_place(function):
    """Compile a kernel that allocates nothing and copies no slice, as `cached` does.

    numba then does not count who uses an array whenever a view of it is taken. That costs a small batch of rollouts a
    third of its time.
    """
    _keep_on_disk()
    return numba.njit(**KEPT, **IN_PLACE)(function)


def cached_for(*types):
    """Compile as `cached` does, and ahead for arguments of these types (`wipx.compilation`): kernels that take long."""

    def decorate(function):
        kernel = cached(function)
        AHEAD.append((kernel, types))
        return kernel

    return decorate


def settled(kernel: Any, *arguments: Any) -> Any:
    """The machine code of a kernel for arguments of these types.

    A call of it does not look at its arguments' types. numba finds that of a function anew at every call, which takes
    longer than a step of a simulation.
    """
    types = tuple(kernel.typeof_pyval(argument) for argument in arguments)
    kernel.compile(types)
    return kernel.get_overload(types)


def is_kept(kernel: Any) -> bool:
    """Whether machine code of a kernel is on the disk, or none is wanted (NUMBA_DISABLE_JIT)."""
    if not hasattr(kernel, "stats"):
        return True
    return any(Path(kernel.stats.cache_path).glob(f"*.{kernel.__name__}-*.nbi"))


def floats(dimensions: int) -> Any:
    """The type of a contiguous array of real numbers."""
    return numba.types.Array(numba.float64, dimensions, "C")


def integers(dimensions: int) -> Any:
    """The type of a contiguous array of whole numbers."""
    return numba.types.Array(numba.int64, dimensions, "C")


def booleans(dimensions: int) -> Any:
    """The type of a contiguous array of truth values."""
    return numba.types.Array(numba.boolean, dimensions, "C")


def tuples(fields: type, item: Any) -> Any:
    """The type of a named tuple whose fields all have one type."""
    return numba.types.NamedUniTuple(item, len(fields._fields), fields)


def part(function):
    """Compile a rigid body, which the kernel is given at run time.

    It is a function of the rows of the robot and of its joints, the lanes in use, the flags, and what is asked for
    (`wipx.sim.rows.FORCES` and so on).
    """
    _keep_on_disk()
    rows, blocks, flags = numba.types.float64[::1], numba.types.float64[:, ::1], numba.types.boolean[::1]
    return numba.cfunc(
        numba.types.void(rows, blocks, numba.types.int64, flags, numba.types.int64), cache=True, **OPTIONS, **IN_PLACE
    )(function)
