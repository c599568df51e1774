"""Compile ahead what takes longest: the simulator, and in a process of its own the filters along recordings.

`python -m wipx.compilation` does both, as `make setup` does. A task that finds nothing compiled begins with
`compile_filters_meanwhile`, and compiles the simulator as soon as it uses it.
"""

import subprocess
import sys

import numpy as np
from filelock import FileLock, Timeout

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.cache import AHEAD, compiled_folder, is_kept
from wipx.sim.inputs import Inputs
from wipx.sim.kernel import rollout
from wipx.sim.simulator import Simulator

BODY = {"body_mass": 1.0, "com_height": 0.5, "body_inertia": 0.1}
FILTERS_ONLY = "--filters"
_begun: "list[subprocess.Popen[bytes]]" = []  # processes that nobody waits for


def compile_filters_meanwhile(simulator: Simulator) -> None:
    """Say that code must be compiled, if that is so, and have the filters compiled in a process of its own.

    Args:
        simulator: That is about to be used; only the analytic one is compiled as a whole.
    """
    if isinstance(simulator, AnalyticSimulator) and not is_kept(rollout):
        print("compiling the simulator and the filters, once; this takes up to a minute", file=sys.stderr)
        _begun.append(_filters_in_a_process())


def compile_filters() -> None:
    """Compile the filters, unless another process does."""
    import wipx.diagnosis.pipeline  # noqa: F401  # with all of them

    try:
        with FileLock(compiled_folder() / "filters.lock", timeout=0):
            for kernel, types in AHEAD:
                kernel.compile(types)
    except Timeout:
        pass


def compile_simulator() -> None:
    """Compile the simulator."""
    plant = plant_of("pendulum")
    model = Model(plant, plant.complete(BODY, "compilation"), {})
    AnalyticSimulator().replay(ModelBatch(model), Inputs.regular(0.01, 100.0, 1), np.zeros((2, 1, 1)))


def _filters_in_a_process() -> "subprocess.Popen[bytes]":
    command = [sys.executable, "-m", "wipx.compilation", FILTERS_ONLY]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def main() -> int:
    """Compile the filters, the simulator too unless only filters are asked for.

    Returns:
        Exit status.
    """
    if FILTERS_ONLY in sys.argv:
        compile_filters()
        return 0
    filters = _filters_in_a_process()
    compile_simulator()
    return filters.wait()


if __name__ == "__main__":
    sys.exit(main())
