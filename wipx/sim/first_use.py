"""The first use after an installation or an edit: the simulator is compiled as soon as it runs.

That is said, and the filters along recordings are compiled meanwhile in a process of their own (`wipx.compilation`).
"""

import subprocess
import sys
from contextlib import suppress
from functools import cache

from wipx.sim.cache import is_kept
from wipx.sim.kernel import rollout

FILTERS = (sys.executable, "-m", "wipx.compilation", "--filters")
begun: "list[subprocess.Popen[bytes]]" = []  # processes that compile filters


@cache
def compile_filters_meanwhile() -> None:
    """Say that code must be compiled, and have the filters compiled, if the simulator is about to be; once."""
    if not is_kept(rollout):
        print("compiling the simulator and the filters, once; this takes up to a minute", file=sys.stderr)
        with suppress(OSError):  # where no process may be started, filters are compiled when they are needed
            begun.append(subprocess.Popen(FILTERS, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
