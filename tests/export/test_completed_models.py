"""Twenty completed models in MuJoCo: with the runtime their predictions err as wipx's do.

`python -m pytest -n0 -s -m slow tests/export/test_completed_models.py` prints what each of them errs by.
"""

from pathlib import Path

import numpy as np
import pytest
from sim.random_trees import mjcf
from sim.robots import robot

from wipx.core.drive import Drive
from wipx.core.export_result import FILE, RUNTIME, WIPX
from wipx.core.model import Model, ModelBatch
from wipx.core.plant import PLANTS, Plant, robot_plant
from wipx.core.recording import Recording
from wipx.effects.catalogue import vocabulary
from wipx.export.judged import judged
from wipx.export.mjcf import export_mjcf
from wipx.recordings.robot_model import read_tree
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs
from wipx.sim.mjcf import NO_CONTACT

pytest.importorskip("mujoco")
WITHIN = 1.02  # of wipx's error
NOISE = 1e-4  # [rad, m]
WRONG = 0.02  # relative standard deviation of the numbers that a completion found
HANGING = {"wip": (0.0, np.pi), "cartpole": (0.0, np.pi), "pendulum": (np.pi,)}  # where nothing falls over
FRICTION = {  # one of them at a joint
    "coulomb": {"F_c": 0.1},
    "stribeck": {"F_c": 0.1, "F_s": 0.18, "v_s": 0.1},
    "lagged_stribeck": {"F_s": 0.15, "F_c": 0.1, "v_s": 0.1, "sigma": 0.02, "epsilon": 1e-3, "alpha": 0.7},
    "presliding": {"F_c": 0.1, "stiffness": 20.0, "damping": 0.05},
    "lugre": {"F_c": 0.1, "F_s": 0.15, "v_s": 0.1, "stiffness": 20.0, "damping": 0.05},
    "hysteresis": {"F_c": 0.1, "stiffness": 20.0, "damping": 0.05, "n": 2.0, "gamma": 0.1},
    "asymmetric_coulomb": {"F_plus": 0.12, "F_minus": 0.06},
}
DRAG = {"viscous": {"sigma": 0.05}, "quadratic_drag": {"c": 0.05}}
AT_JOINTS = {
    "rotor_inertia": {"J": 0.02},
    "spring": {"k": 0.2, "q0": 0.1, "x0": 0.1},
    "load_friction": {"K_motor": 0.05, "K_external": 0.05},
    "sticky_spot": {"F_c": 0.05, "lo": -0.1, "hi": 0.1},
}
AT_DRIVES = {
    "gain": {"k": 0.9},
    "offset": {"F_0": 0.05},
    "dead_zone": {"band": 0.08},
    "delay": {"tau": 0.008},
    "kp": {"factor": 0.9},
    "kd": {"factor": 0.9},
    "lag": {"tau": 0.01},
    "saturation": {"F_max": 1.5},
    "ripple": {"A": 0.05, "n": 5.0, "phase": 0.3},
    "backlash": {"gap": 0.01},
    "back_emf": {"k_e": 0.02},
    "speed_limit": {"F_stall": 3.0, "v_free": 8.0},
}
AT_SENSORS = {"delay": {"tau": 0.006}, "scale": {"e": 0.02}, "bias": {"b": 0.01}}
ELSEWHERE = {  # at bodies, base and rail
    "payload": {"mass": 0.2, "height": 0.3, "x": 0.05, "y": 0.0, "z": 0.1},
    "payload_event": {"mass": 0.2, "height": 0.3, "t0": 0.5},
    "com_offset": {"theta_eq": 0.02, "x": 0.01, "y": 0.0, "z": 0.01},
    "inertia": {"scale": 1.1},
    "base_tilt": {"roll": 0.02, "pitch": 0.02},
    "rail_tilt": {"angle": 0.01},
}


def drawn(plant: Plant, rng: np.random.Generator) -> dict[str, dict[str, float]]:
    """Friction at every joint, and at each joint, drive, sensor and body something more in some cases."""
    found: dict[str, dict[str, float]] = {}
    known = vocabulary(plant)

    def put(site: str, numbers: dict[str, dict[str, float]], share: float = 1.0) -> None:
        kinds = [kind for kind in numbers if f"{site}/{kind}" in known]
        if kinds and rng.random() < share:
            kind = str(rng.choice(kinds))
            have = [parameter.name for parameter in known[f"{site}/{kind}"].parameters]
            found[f"{site}/{kind}"] = {
                name: value * rng.uniform(0.7, 1.3) for name, value in numbers[kind].items() if name in have
            }

    for joint in plant.joints:
        put(joint, FRICTION)
        put(joint, DRAG)
        put(joint, AT_JOINTS, 0.5)
    for site in plant.sites:
        if plant.class_of(site) in ("actuator", "drive"):
            put(site, AT_DRIVES, 0.75)
        elif site.startswith("sensor_"):
            put(site, AT_SENSORS, 0.3)
        elif site not in plant.joints:
            put(site, ELSEWHERE, 0.5 / len(plant.joints))
    return found


def a_tree(joints: int, rng: np.random.Generator, folder: Path) -> Model:
    """A random tree with damped joints and drives of all kinds."""
    path = folder / "tree.xml"
    text = mjcf(joints, rng, slides=0.1)
    path.write_text(text.replace("/><world", f">{NO_CONTACT}</option><world"), encoding="utf-8")
    tree = read_tree(path)
    kinds = rng.choice(["position", "torque", "none"], size=joints, p=[0.6, 0.3, 0.1])
    kinds[0] = "position"
    drives = {
        joint: Drive("position", kp=20.0, kd=1.0) if kind == "position" else Drive(str(kind))  # pyright: ignore
        for joint, kind in zip(tree.joints, kinds, strict=True)
    }
    plant = robot_plant(tree, drives)
    return Model(plant, plant.complete({}, "robot.yaml"), drawn(plant, rng))


def recorded(model: Model, rng: np.random.Generator) -> tuple[Recording, ...]:
    """A robot that the model nearly is, driven by sums of sines."""
    plant = model.plant
    values = {
        f"{name}.{symbol}": value * (1.0 + WRONG * rng.normal())
        for name, numbers in model.effects.items()
        for symbol, value in numbers.items()
    }
    true, t = model.with_values(values), np.arange(0.0, 4.0, 0.005)
    sizes = [1.0 if plant.unit_of(command) in ("N", "N m") else 0.5 for command in plant.commands]
    runs = []
    for k in range(2):
        frequency, phase = rng.uniform(0.3, 1.8, (3, len(sizes))), rng.uniform(0.0, 6.28, (3, len(sizes)))
        waves = np.sin(6.28 * frequency[:, None] * t[:, None] + phase[:, None])
        commands = waves.sum(axis=0) * np.array(sizes)
        rest = np.array(HANGING.get(plant.kind, np.zeros(len(plant.joints))))
        initial = np.concatenate([rest, np.zeros(len(rest))])[:, None, None]
        run = AnalyticSimulator(2.5e-4).replay(ModelBatch(true), Inputs.of([t], [commands], [0]), initial)
        q = run.coordinates[:, :, 0, 0] + NOISE * rng.normal(size=(len(t), len(rest)))
        columns = dict(zip(plant.coordinates, q.T, strict=True)) | dict(zip(plant.commands, commands.T, strict=True))
        runs.append(Recording(f"r{k}.csv", {"t": t, **columns}))
    return tuple(runs)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(20))
def test_with_the_runtime_the_error_is_that_of_wipx(number: int, tmp_path: Path, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    if number < 10:
        kind = sorted(PLANTS)[number % 5]
        model = robot(kind)
        model = model.with_effects(drawn(model.plant, rng))
    else:
        model = a_tree(2 + number % 5, rng, tmp_path)
    file = export_mjcf(model)
    errors, said = judged(model, file, AnalyticSimulator(), recorded(model, rng), lambda *_: None)
    counts = [sum(s.status == status for s in said) for status in ("exact", "approximated", "lost")]
    shares = {
        way: max(errors.rms[way][name] / errors.rms[WIPX][name] for name in errors.noise_floor) for way in errors.rms
    }
    kinds = sorted({name.partition("/")[2] for name in model.effects})
    print(
        f"\n{', '.join(kinds)}\n{model.plant.kind} of {len(model.plant.joints)} joints: "
        f"{counts} effects exact, approximated, lost; "
        f"error over wipx's: runtime {shares[RUNTIME]:.4f}, file alone {shares[FILE]:.3g}"
    )
    assert shares[RUNTIME] < WITHIN
