"""How an exported robot predicts recordings in MuJoCo, beside the completed model that it was made of.

All predictions start from the states that the completed model smooths. What an effect costs that the file lacks is
what its removal costs in wipx. What an approximated effect costs is measured with MuJoCo's own joint (or drive) in
place of wipx's, and wipx's laws everywhere else.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace

from wipx.core.export_result import FILE, RUNTIME, WIPX, ExportErrors, Statement, WaysTrace
from wipx.core.model import Model
from wipx.core.recording import Recording
from wipx.core.results import HORIZON
from wipx.export.file_simulator import FileSimulator
from wipx.export.file_world import LawsInFile, LeftOn, steps_within
from wipx.export.mjcf import ExportedFile
from wipx.identify.evaluation import FromSameStates, Judge
from wipx.identify.noise import sensor_noise
from wipx.sim.simulator import Simulator

Watcher = Callable[[str, float], None]
ALL_DRIVES = "actuator"  # site of the drives of plants that have no model file


def judged(
    model: Model,
    file: ExportedFile,
    simulator: Simulator,
    recordings: tuple[Recording, ...],
    watch: Watcher,
) -> tuple[ExportErrors, tuple[Statement, ...]]:
    """Errors of the exported robot, and what becomes of its effects with what that costs.

    Args:
        model: The completed model.
        file: What was made of it.
        simulator: For the completed model.
        recordings: To be predicted.
        watch: Is told what is done, and which share.

    Raises:
        InputError: the recordings are too short.
    """
    watch("states", 0.0)
    same = Judge(simulator, sensor_noise(recordings, model.plant), HORIZON).from_same_states(model, recordings)
    doubtful = [statement for statement in file.statements if statement.status != "exact"]
    simulators: dict[str, Simulator] = {WIPX: simulator, FILE: FileSimulator(file=file)}
    if file.has_runtime:
        simulators[RUNTIME] = LawsInFile(step=file.step / steps_within(file.step), file=file)
    parts = 1 + len(simulators) + len(doubtful)
    predicted = {}
    for i, (way, other) in enumerate(simulators.items()):
        watch(way.replace("_", " "), (1 + i) / parts)
        predicted[way] = same.predicted(model, other)
    rms = {way: same.errors(values) for way, values in predicted.items()}
    costs = {}
    for i, statement in enumerate(doubtful):
        watch(statement.effect, (1 + len(simulators) + i) / parts)
        costs[statement.effect] = _cost(same, model, file, simulator, statement, rms[WIPX])
    statements = tuple(s if s.effect not in costs else s.costing(costs[s.effect]) for s in file.statements)
    series = {way: same.by_recording(values) for way, values in predicted.items()}
    names, windows = model.plant.coordinates, same.starts.windows
    traces = tuple(
        WaysTrace(
            recording.name,
            recording.t,
            {name: recording[name] for name in names},
            {way: dict(zip(names, values[i].T, strict=True)) for way, values in series.items()},
            windows.starts[windows.recording == i],
        )
        for i, recording in enumerate(recordings)
    )
    return ExportErrors(HORIZON, windows.count, rms, same.floor(), traces), statements


def _cost(
    same: FromSameStates,
    model: Model,
    file: ExportedFile,
    simulator: Simulator,
    statement: Statement,
    without: Mapping[str, float],
) -> dict[str, float]:
    """By how much the errors grow because of one effect."""
    other, engine = without_effect(model, statement.effect), simulator
    if statement.status == "approximated" and not statement.effect.startswith("sensor_"):
        left_on, other = mujocos_own(model, statement.effect)
        engine = LawsInFile(step=file.step / steps_within(file.step), file=file, left_on=left_on)
    errors = same.errors(same.predicted(other, engine))
    return {name: error - without[name] for name, error in errors.items()}


def without_effect(model: Model, effect: str) -> Model:
    """A model without one of its effects, or with zero for a number of its rigid body."""
    if effect in model.parameters:
        return model.with_values({effect: 0.0})
    return replace(model, effects={name: values for name, values in model.effects.items() if name != effect})


def mujocos_own(model: Model, effect: str) -> tuple[LeftOn, Model]:
    """What MuJoCo does itself where an effect acts, and the model without it."""
    plant = model.plant
    site = effect.partition("/")[0]
    joint = effect.rpartition(".")[0] if "/" not in effect else plant.joint_at(site)
    effects = {name: dict(values) for name, values in model.effects.items()}
    if site in plant.joints and "/" in effect:
        kept = {name: v for name, v in effects.items() if not name.startswith(f"{site}/") or _is_inertia(name)}
        zero = {f"{joint}.{name}": 0.0 for name in ("damping", "friction") if f"{joint}.{name}" in model.parameters}
        return LeftOn(joints=(joint,)), replace(model, effects=kept).with_values(zero)
    together = plant.tree is None or site == ALL_DRIVES
    driven = plant.actuated if together else (joint,)
    sites = (ALL_DRIVES, *(f"actuator_{each}" for each in driven)) if together else (f"actuator_{joint}",)
    kept = {name: values for name, values in effects.items() if name.partition("/")[0] not in sites}
    silenced = (ALL_DRIVES,) if plant.tree is None else tuple(f"actuator_{each}" for each in driven)
    return LeftOn(drives=driven), replace(model, effects={**kept, **{f"{each}/gain": {"k": 0.0} for each in silenced}})


def _is_inertia(name: str) -> bool:
    return name.endswith("/rotor_inertia")
