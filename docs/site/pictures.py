"""The picture of an effect: its curve in steady motion, and a simulated motion with and without it."""

import io
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from wipx.core.effect import Effect
from wipx.core.model import Model, ModelBatch
from wipx.core.parameters import Parameter, Scales
from wipx.core.plant import Plant, plant_of
from wipx.effects.catalogue import kinds, vocabulary
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

# A carriage that a force of 5 N moves to and fro, and a pendulum that a torque swings about its lower position.
NUMBERS = {
    "linear_axis": {"body_mass": 2.0, "wheel_mass": 0.5},
    "pendulum": {"body_mass": 0.8, "com_height": 0.45, "body_inertia": 0.037},
    "wip": {
        "body_mass": 2.6,
        "wheel_mass": 1.2,
        "com_height": 0.35,
        "body_inertia": 0.11,
        "wheel_inertia": 0.0023,
        "wheel_radius": 0.0625,
    },
}
START = {"linear_axis": (0.0, -0.64), "pendulum": (np.pi, 0.0), "wip": (0.0, np.pi, 0.0, 0.0)}
COMMAND = {"linear_axis": 5.0, "pendulum": 0.4, "wip": 5.0}
SCALES = {
    "linear_axis": Scales(5.0, 0.64, 0.2, 2.0, 0.3, 6.0, 5.0),
    "pendulum": Scales(0.4, 1.5, 0.5, 0.8, 0.45, 6.0, 0.4),
    "wip": Scales(5.0, 1.0, 0.3, 2.6, 0.35, 6.0, 5.0),
}
PERIOD = 2.0  # [s] of the command
VISIBLE = 0.1  # of the motion's standard deviation: below that the effect is doubled
DOUBLINGS = 8


def effect_picture(kind: str) -> bytes:
    """The picture as SVG."""
    effect = kinds()[kind]
    plant, name = _robot(kind)
    values, bare, moved, t = _motion(effect, plant, name)
    figure = Figure(figsize=(9.0 if effect.steady else 6.0, 3.0), layout="constrained")
    axes = figure.subplots(1, 2 if effect.steady else 1, squeeze=False)[0]
    if effect.steady:
        _draw_law(axes[0], effect, plant, name, values)
    coordinate, unit = _coordinate(plant, name)
    axes[-1].plot(t, bare, color="0.5", linestyle="--", label="without")
    axes[-1].plot(t, moved, color="tab:blue", label="with")
    axes[-1].set(xlabel="t [s]", ylabel=f"{coordinate} [{unit}]", title=f"{name} of a {plant.kind}".replace("_", " "))
    axes[-1].legend(loc="upper right")
    figure.supxlabel(", ".join(f"{symbol} = {value:.3g}" for symbol, value in values.items()), fontsize=8)
    picture = io.BytesIO()
    figure.savefig(picture, format="svg", metadata={"Date": None})
    return picture.getvalue()


def _robot(kind: str) -> tuple[Plant, str]:
    """The first robot that can have the effect, and the effect's name on it."""
    for plant in map(plant_of, NUMBERS):
        for name in vocabulary(plant):
            if name.endswith(f"/{kind}"):
                return plant, name
    raise LookupError(f"no robot of this page can have {kind}; add one to NUMBERS")


def _motion(effect: Effect, plant: Plant, name: str) -> tuple[dict[str, float], np.ndarray, np.ndarray, np.ndarray]:
    """Values at which the effect shows, and the coordinate without and with it, shape (rows,)."""
    scales = SCALES[plant.kind]
    values = {p.name: _shown(p, effect) * scales.of(p.dimension) for p in effect.parameters}
    t = np.arange(0.0, 6.0, 0.005)
    bare = _simulate(plant, {}, t, name)
    moved = _simulate(plant, {name: values}, t, name)
    for _ in range(DOUBLINGS):
        if not effect.linear_in or np.sqrt(np.mean((moved - bare) ** 2)) > VISIBLE * np.std(bare):
            break
        values |= {symbol: 2.0 * values[symbol] for symbol in effect.linear_in}
        moved = _simulate(plant, {name: values}, t, name)
    return values, bare, moved, t


def _shown(parameter: Parameter, effect: Effect) -> float:
    """A value to begin with, in multiples of the scales: one at which a diagnosis looks for the effect."""
    least = 0.05 if parameter.name in effect.linear_in else 0.0
    return parameter.grid[len(parameter.grid) // 2] if parameter.grid else parameter.start or least


def _simulate(plant: Plant, effects: Mapping[str, Mapping[str, float]], t: np.ndarray, name: str) -> np.ndarray:
    model = Model(plant, plant.complete(NUMBERS[plant.kind], "pictures"), effects)
    command = COMMAND[plant.kind] * np.sin(2.0 * np.pi * t / PERIOD)[:, None]
    inputs = Inputs.of([t], [command], [0])
    start = np.array(START[plant.kind])[:, None, None]
    coordinates = AnalyticSimulator(threads=1).replay(ModelBatch(model), inputs, start).coordinates
    return coordinates[:, _joint(plant, name), 0, 0]


def _joint(plant: Plant, name: str) -> int:
    """The joint whose coordinate shows the effect: its own, or the first."""
    site = name.partition("/")[0].removeprefix("sensor_")
    shown = [site in (joint, column) for joint, column in plant.columns.items()]
    return shown.index(True) if True in shown else 0


def _coordinate(plant: Plant, name: str) -> tuple[str, str]:
    column = plant.coordinates[_joint(plant, name)]
    return column, plant.unit_of(column)


def _draw_law(axis, effect: Effect, plant: Plant, name: str, values: Mapping[str, float]) -> None:
    assert effect.steady is not None
    scales = SCALES[plant.kind]
    coordinate, unit = _coordinate(plant, name)
    force = plant.unit_of(plant.commands[0])
    reach, label = {
        "rate": (scales.velocity, f"rate [{unit}/s]"),
        "coordinate": (scales.coordinate, f"{coordinate} [{unit}]"),
        "command": (1.5 * scales.command, f"command [{force}]"),
    }[effect.steady.over]
    signal = np.linspace(-reach, reach, 400)
    body = plant.complete(NUMBERS[plant.kind], "pictures")
    axis.axhline(0.0, color="0.8", linewidth=0.8)
    axis.plot(signal, effect.steady.force(signal, values, body), color="tab:red")
    axis.set(xlabel=label, ylabel=f"added force [{force}]", title="steady motion")
