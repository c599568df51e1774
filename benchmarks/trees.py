"""Speed of robots from model files: integration steps per second of one core beside MuJoCo, and compilation.

The robots are the first joints of an arm of seven, every joint with dry friction, damping and a rotor. Rows of 10 steps
of 1 ms, 512 rollouts; commands keep the joints moving, with stops.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from timing import interleaved, print_table

from wipx.core.model import Model, ModelBatch
from wipx.core.plant import robot_plant
from wipx.recordings.robot_model import read_drives, read_tree
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

mujoco: Any = import_module("mujoco")  # its names are made at run time

JOINTS = (1, 2, 4, 6, 7)
BATCH, ROWS, SUBSTEPS, STEP = 512, 50, 10, 1e-3
ROUNDS = 7
# Of each link: axis of its joint, place on the link below [m], mass [kg], centre [m], moments [kg m^2], dry friction
# [N m], damping [N m s/rad], rotor [kg m^2], size of the command [N m]. An arm of the usual kind, numbers made up.
LINKS = (
    ("0 0 1", "0 0 0.2", 7.0, "0 -0.02 0.06", "0.03 0.03 0.02", 2.0, 1.0, 0.5, 12.0),
    ("0 1 0", "0 0 0.15", 12.0, "0 0 0.25", "0.4 0.4 0.03", 3.0, 1.5, 0.6, 60.0),
    ("0 1 0", "0 0 0.6", 4.0, "0.01 0 0.2", "0.1 0.1 0.01", 1.5, 0.8, 0.3, 25.0),
    ("0 0 1", "0.05 0 0.3", 2.0, "0 0.01 0.05", "0.01 0.01 0.005", 0.6, 0.2, 0.05, 3.0),
    ("0 1 0", "0 0 0.25", 2.0, "0 0.01 0.02", "0.005 0.005 0.004", 0.5, 0.2, 0.05, 4.0),
    ("0 0 1", "0 0 0.1", 0.8, "0.01 0 0.03", "0.002 0.002 0.001", 0.3, 0.1, 0.03, 1.0),
    ("0 1 0", "0.05 0 0.08", 0.4, "0 0 0.04", "0.001 0.001 0.0005", 0.2, 0.05, 0.02, 0.6),
)
FIRST_USE = """
import sys, time
began = time.perf_counter()
from trees import call_of
imported = time.perf_counter()
call_of(sys.argv[1], 64)()
print(imported - began, time.perf_counter() - imported)
"""


def mjcf(joints: int) -> str:
    """Model file of the first joints of the arm."""
    bodies = "".join(
        f'<body name="b{i}" pos="{place}"><inertial pos="{com}" mass="{mass}" diaginertia="{moments}"/>'
        f'<joint name="j{i}" axis="{axis}" frictionloss="{friction}" damping="{damping}" armature="{rotor}"/>'
        for i, (axis, place, mass, com, moments, friction, damping, rotor, _) in enumerate(LINKS[:joints])
    )
    motors = "".join(f'<motor name="m{i}" joint="j{i}"/>' for i in range(joints))
    option = f'<option timestep="{STEP}"><flag contact="disable"/></option>'
    return f"<mujoco>{option}<worldbody>{bodies}{'</body>' * joints}</worldbody><actuator>{motors}</actuator></mujoco>"


def call_of(path: str, batch: int) -> Callable[[], object]:
    """A call that simulates a batch of the robot."""
    tree, drives = read_tree(Path(path)), read_drives(Path(path))
    plant = robot_plant(tree, drives)
    model = Model(plant, plant.complete({}, path), {})
    joints = len(tree.links)
    inputs = Inputs.regular(ROWS * SUBSTEPS * STEP, 1.0 / (SUBSTEPS * STEP), joints)
    inputs = Inputs(inputs.t, commands(joints)[:, :, None], inputs.first, inputs.last)
    masses = model.parameters["b0.mass"] * np.linspace(0.9, 1.1, batch)[:, None]
    models = ModelBatch(model, ("b0.mass",), masses)
    simulator = AnalyticSimulator(step=STEP, threads=1)
    return lambda: simulator.replay(models, inputs, np.zeros((2 * joints, batch, 1)))


def commands(joints: int) -> np.ndarray:
    """Torques of the rows, shape (K, joints) [N m]."""
    t = np.arange(ROWS)[:, None] * SUBSTEPS * STEP
    sizes = np.array([link[-1] for link in LINKS[:joints]])
    return sizes * np.sin(2.0 * np.pi * (3.0 + np.arange(joints)) * t)


def mujoco_call(text: str) -> Callable[[], object]:
    """One rollout with `mj_step`, called once a row."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    rows = commands(model.nv)

    def call() -> None:
        mujoco.mj_resetData(model, data)
        for row in rows:
            data.ctrl[:] = row
            mujoco.mj_step(model, data, SUBSTEPS)

    return call


def measure_trees() -> dict[str, dict[str, float]]:
    """Steps per second and seconds of compilation by number of joints, printed and returned."""
    found, lines = {}, []
    with tempfile.TemporaryDirectory() as folder:
        for joints in JOINTS:
            path = Path(folder, f"arm{joints}.xml")
            path.write_text(mjcf(joints), encoding="utf-8")
            calls = {"wipx": call_of(str(path), BATCH), "mujoco": mujoco_call(mjcf(joints))}
            timings = interleaved(calls, ROUNDS)
            steps = ROWS * SUBSTEPS
            rate, peer = steps * BATCH / timings["wipx"].median, steps / timings["mujoco"].median
            first, again = _first_use(path, folder), _first_use(path, folder)
            figures = {"steps_per_second": rate, "mj_step_per_second": peer, "first_s": first, "again_s": again}
            found[str(joints)] = figures
            lines.append(
                (
                    str(joints),
                    f"{rate / 1e6:.1f}",
                    f"{peer / 1e6:.2f}",
                    f"{rate / peer:.0f}",
                    f"{first:.1f}",
                    f"{again:.1f}",
                )
            )
    print_table(
        f"Robots from model files with dry friction, one thread, {BATCH} rollouts, rows of {SUBSTEPS} steps",
        ("joints", "million steps/s", "mj_step, million/s", "ratio", "first use [s]", "from disk [s]"),
        lines,
    )
    return found


def _first_use(path: Path, cache: str) -> float:
    """Time of the first call in a new process, with a cache of compiled code of its own [s]."""
    here = Path(__file__).resolve().parent
    environment = {**os.environ, "XDG_CACHE_HOME": cache, "PYTHONPATH": os.pathsep.join([str(here), str(here.parent)])}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", FIRST_USE, str(path)], env=environment, capture_output=True, text=True, check=True
    )
    return float(done.stdout.split()[-1])


if __name__ == "__main__":
    measure_trees()
