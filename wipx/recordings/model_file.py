"""model.yaml: a model as a file that every task and simulator can be given.

    schema: 1
    plant: wip
    parameters: {body_mass: 2.6, ...}                 # SI
    effects: {translation/coulomb: {F_c: 3.1}}        # SI
    bandwidths: {x: 3.0, theta: 10.0}                 # rad/s, optional: of the filter from which predictions start

A robot.yaml is a model file too: what it says besides plant, parameters and effects is left
to `wipx.recordings.robot_file`.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from wipx.core.effect import Effect
from wipx.core.errors import InputError, unknown_name
from wipx.core.model import Model
from wipx.core.plant import PLANTS, Plant, plant_of
from wipx.effects.catalogue import check_together, effect_of
from wipx.recordings.strict_yaml import finite_number, load_mapping
from wipx.recordings.tree_file import plant_from_mapping, plant_to_mapping

SCHEMA = 1
ROBOT = "robot"  # plant whose mechanics a model file gives
MODEL_KEYS = ("plant", "parameters", "effects", "bandwidths", "model", "locked", "drives", "tree")
ROBOT_KEYS = (*MODEL_KEYS, "uncertainty", "controller", "signals", "loads", "limits", "emulated")


def write_model(model: Model, path: Path) -> None:
    """Write a model; the file is written whole or not at all.

    Numbers are written with all digits, so that `read_model` returns the same ones.
    """
    content = {
        "schema": SCHEMA,
        "plant": model.plant.kind,
        **(plant_to_mapping(model.plant) if model.plant.tree is not None else {}),
        "parameters": _plain(model.parameters),
        "effects": {name: _plain(values) for name, values in model.effects.items()},
    }
    if model.bandwidths:
        content["bandwidths"] = _plain(model.bandwidths)
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        partial.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def read_model(path: Path) -> Model:
    """The model in a model.yaml or a robot.yaml; nothing in the file is executed.

    Raises:
        InputError: the file is missing or not plain YAML, a key, parameter or effect is unknown,
            missing or of the wrong sign.
    """
    data = load_mapping(path)
    where = str(path)
    check_keys(data, ("schema", *ROBOT_KEYS), where)
    schema = data.get("schema", SCHEMA)
    if schema != SCHEMA:
        raise InputError(f"{where}: schema is {schema!r}, expected {SCHEMA}; write the model again")
    return model_from_mapping(data, where, path.parent)


def model_from_mapping(data: Mapping[str, object], where: str, folder: Path | None = None) -> Model:
    """The model that the keys plant, parameters and effects describe.

    Args:
        data: Content of a file or of a configuration; further keys are ignored.
        where: File or key that holds it, for messages.
        folder: That paths in it are relative to; None for the present one.

    Raises:
        InputError: see `read_model`.
    """
    is_robot = data.get("plant") == ROBOT
    for key in ("plant",) if is_robot else ("plant", "parameters"):
        if data.get(key) is None:
            raise InputError(f"{where}: {key} is missing; add it (plants: {', '.join(sorted((*PLANTS, ROBOT)))})")
    if is_robot:
        plant = plant_from_mapping(data, where, folder or Path())
    else:
        plant = plant_of(str(data["plant"]), f"{where}: plant")
    return _model(plant, data, where)


def model_of(plant: Plant, parameters: Mapping[str, float], effects: Mapping[str, Any], where: str) -> Model:
    """A model of a plant, checked like one of a file.

    Args:
        plant: The plant.
        parameters: As under `parameters` of a file [SI].
        effects: Likewise, under `effects`.
        where: Key that holds them, for messages.

    Raises:
        InputError: see `read_model`.
    """
    return _model(plant, {"parameters": parameters, "effects": effects}, where)


def _model(plant: Plant, data: Mapping[str, object], where: str) -> Model:
    parameters = plant.complete(mapping_of(data, "parameters", where), f"{where}: parameters")
    listed = mapping_of(data, "effects", where)
    check_together(tuple(listed), plant, f"{where}: effects")
    effects = {name: _effect_values(listed[name], name, effect_of(name, plant), where) for name in listed}
    return Model(plant, parameters, effects, _bandwidths(data, plant, where))


def _bandwidths(data: Mapping[str, object], plant: Plant, where: str) -> dict[str, float]:
    """Bandwidth of each coordinate's filter [rad/s]; none where the file has none."""
    given = mapping_of(data, "bandwidths", where)
    for name in given:
        if name not in plant.coordinates:
            raise unknown_name("coordinate", name, plant.coordinates, f"{where}: bandwidths")
    found = {name: _number(given, name, f"{where}: bandwidths") for name in given}
    for name in plant.coordinates if given else ():
        if found.get(name, 0.0) <= 0.0:
            raise InputError(f"{where}: bandwidths: {name} is {found.get(name)}, expected a positive number in rad/s")
    return found


def mapping_of(data: Mapping[str, object], key: str, where: str) -> Mapping[str, Any]:
    """The mapping under a key; empty where the key is absent or has no value.

    Raises:
        InputError: there is something else, or a key of it is no text.
    """
    found = data.get(key)
    if found is None:
        return {}
    if not isinstance(found, Mapping):
        raise InputError(f"{where}: {key} is {found!r}, expected names with values, one per line")
    for name in found:
        if not isinstance(name, str):
            raise InputError(f"{where}: {key} has the key {name!r}, expected a name")
    return found


def check_keys(data: Mapping[str, object], valid: tuple[str, ...], where: str) -> None:
    """Refuse keys that are not valid.

    Raises:
        InputError: the message lists the valid keys.
    """
    for key in data:
        if key not in valid:
            raise unknown_name("key", key, valid, where)


def _effect_values(data: object, name: str, effect: Effect, where: str) -> dict[str, float]:
    where = f"{where}: {name}"
    symbols = {p.name: p for p in effect.parameters}
    if not isinstance(data, Mapping):
        example = ", ".join(f"{symbol}: ..." for symbol in symbols)
        raise InputError(f"{where} is {data!r}, expected its parameters {{{example}}}")
    for symbol in data:
        if symbol not in symbols:
            raise unknown_name("parameter", symbol, symbols, where)
    values = {}
    for symbol, parameter in symbols.items():
        if symbol not in data and parameter.default is not None:
            values[symbol] = parameter.default
            continue
        if symbol not in data:
            raise InputError(f"{where} lacks {symbol} ({parameter.meaning}); add it")
        value = _number(data, symbol, where)
        # A search interval that begins at zero or above belongs to a law for that sign alone.
        negative = value < 0.0 and parameter.low >= 0.0 and not parameter.signed
        if negative or (parameter.low > 0.0 and value == 0.0):
            sign = "positive" if parameter.low > 0.0 else "non-negative"
            raise InputError(f"{where}: {symbol} = {value:g}, expected a {sign} number ({parameter.meaning})")
        values[symbol] = value
    return values


def _number(data: Mapping[str, object], name: str, where: str) -> float:
    value = finite_number(data[name])
    if value is None:
        raise InputError(f"{where}: {name} is {data[name]!r}, expected a finite number in SI units")
    return value


def _plain(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items()}
