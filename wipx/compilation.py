"""Compile ahead what takes longest: the simulator, the laws beside other engines, and the filters along recordings.

`python -m wipx.compilation` does all, as `make setup` does. A program that finds nothing compiled compiles the
simulator and the filters while it runs (`wipx.sim.first_use`).
"""

import sys

import numpy as np
from filelock import FileLock, Timeout

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import plant_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.bullet import BulletSimulator
from wipx.sim.cache import AHEAD, compiled_folder
from wipx.sim.first_use import FILTERS, begun
from wipx.sim.inputs import Inputs
from wipx.sim.simulator import Simulator

BODY = {"body_mass": 1.0, "com_height": 0.5, "body_inertia": 0.1}


def compile_filters() -> None:
    """Compile the filters, unless another process does."""
    import wipx.control.motion  # with their own
    import wipx.diagnosis.pipeline  # noqa: F401  # with all others

    try:
        with FileLock(compiled_folder() / "filters.lock", timeout=0):
            for kernel, types in AHEAD:
                kernel.compile(types)
    except Timeout:
        pass


def compile_simulator(simulator: Simulator | None = None) -> None:
    """Compile a simulator, by default the analytic one, which has the filters compiled meanwhile."""
    plant = plant_of("pendulum")
    model = Model(plant, plant.complete(BODY, "compilation"), {})
    (simulator or AnalyticSimulator()).replay(ModelBatch(model), Inputs.regular(0.01, 100.0, 1), np.zeros((2, 1, 1)))


def main() -> int:
    """Compile the filters, the simulator too unless only filters are asked for.

    Returns:
        Exit status.
    """
    if FILTERS[-1] not in sys.argv:
        compile_simulator()
        compile_simulator(BulletSimulator())
    if begun:
        return begun[0].wait()
    compile_filters()
    return 0


if __name__ == "__main__":
    sys.exit(main())
