"""The configuration: its typed root, and the factory that builds the parts it names.

Composing the files and telling the user what is wrong with them is in `wipx.app`; the values
themselves are in `conf/`.
"""

import importlib
import types
import warnings
from collections.abc import Collection, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from hydra.core.config_store import ConfigStore
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from wipx.core.errors import InputError, unknown_name

PACKAGE = "wipx"
UNSET = "???"  # how a configuration file marks a value that the user must give


@dataclass
class ModelConfig:
    """Where a run starts from.

    Attributes:
        path: A model.yaml; None for the nominal model.
    """

    path: str | None = None


@dataclass
class RunConfig:
    """The root of the configuration: a key that is not listed here, or of another type, is refused.

    Attributes:
        name: Of the experiment; the task's name unless given.
        label: Of one job in a sweep; its number unless given.
        seed: Of every random number.
        effects: Physics that is switched on, as "site/kind".
        free: Further parameters that may change, with the relative standard deviation of their
            prior, or None.
        bounds: Search intervals [low, high] that replace the usual ones, by parameter [SI].
        model: The model to start from.
        format: Of the file that task=export writes, "mjcf" or "urdf".
        strict: Whether task=export refuses a model with an effect that the format cannot say.
        write: Whether task=import writes recordings; it shows only what they would be unless asked.
        log: What task=import reads, chosen by import=OPTION.
        task: What is done; like all the groups below a node with a `_target_`.
        diagnosis: The rules of a diagnosis.
        recordings: Where recordings come from.
        plant: The nominal model.
        sim: The simulator.
        friction: The friction model.
        optimizer: The search.
        objective: The loss.
        target: The robot that is driven.
        controller: What drives it.
        baseline: What people would use in place of a diagnosis.
        method: Which simulation a training set comes from.
        estimator: What estimates the equilibrium pitch.
        tracking: Where runs are logged.
    """

    name: str
    label: str | None
    seed: int = 0
    effects: list[str] = field(default_factory=list)
    free: dict[str, Any] = field(default_factory=dict)
    bounds: dict[str, Any] = field(default_factory=dict)
    model: ModelConfig = field(default_factory=ModelConfig)
    format: str = "mjcf"
    strict: bool = False
    write: bool = False
    log: Any = None
    task: Any = None
    diagnosis: Any = None
    recordings: Any = None
    plant: Any = None
    sim: Any = None
    friction: Any = None
    optimizer: Any = None
    objective: Any = None
    target: Any = None
    controller: Any = None
    baseline: Any = None
    method: Any = None
    estimator: Any = None
    tracking: Any = None


def register() -> None:
    """Make known to Hydra the schema `base_run`, which conf/config.yaml uses."""
    schema = OmegaConf.structured(RunConfig)
    schema.log = OmegaConf.create({"columns": {}, "rename": {}})
    for names in (schema.free, schema.bounds, schema.log.columns, schema.log.rename):
        OmegaConf.set_struct(names, False)  # any name may be added; the task knows which exist
    ConfigStore.instance().store(name="base_run", node=schema)


def _chosen_option(group: str, *, _root_: DictConfig) -> str:
    """The option that is used of a group: while a sweep is prepared only the configuration itself knows it."""
    composed = _root_.hydra if "hydra" in _root_ else HydraConfig.get()
    return str(composed.runtime.choices[group])


# A process that a launcher starts knows both, since it imports this module.
OmegaConf.register_new_resolver("chosen", _chosen_option, replace=True)
# Options in conf/hydra/launcher have the names of the plugins' own, whose keys and types thus hold for them.
warnings.filterwarnings("ignore", message=r"\s*'hydra/launcher/\w+' is validated against ConfigStore schema")


def unknown_key(key: str, valid: Collection[str], where: str) -> InputError:
    """The error for a key that does not exist; `valid` are those that do, `where` is the node's name."""
    if not valid:
        return InputError(f"{where}: unknown key {key!r}; this option has no settings, leave it out")
    return unknown_name("key", key, valid, where)


def mistyped_root_key(key: str, value: object) -> InputError | None:
    """The error for a value that the type of a root key refuses; None where `key` is no plain root key."""
    kind = get_type_hints(RunConfig).get(key, Any)
    return None if kind in (Any, ModelConfig) else _mistyped(value, kind, key)


def build(node: object, group: str) -> Any:
    """The object that a node of the configuration describes.

    Args:
        node: Mapping of a `_target_`, the full name of a frozen dataclass of this package at the
            module that defines it, and of its settings.
        group: Name of the group, for messages.

    Raises:
        InputError: the target does not exist or needs a package that is not installed; a setting
            is unknown, missing or of the wrong type.
    """
    if not isinstance(node, Mapping) or "_target_" not in node:
        raise InputError(f"{group}: no option is chosen (the node has no _target_); choose one with {group}=OPTION")
    target = _target(node["_target_"], f"{group}._target_")
    return _filled(target, {key: value for key, value in node.items() if key != "_target_"}, group)


def _filled(target: type[Any], settings: Mapping[Any, Any], group: str) -> Any:
    """A frozen dataclass with settings; `group` is its node's name, for messages."""
    declared = {item.name: item for item in fields(target) if item.init}
    for key in settings:
        if key not in declared:
            raise unknown_key(key, declared, group)
    for name, item in declared.items():
        if settings.get(name) == UNSET or (name not in settings and _is_required(item)):
            raise InputError(f"{group}.{name} is missing; give {group}.{name}=VALUE")
    kinds = get_type_hints(target)
    return target(**{key: typed(value, kinds[key], f"{group}.{key}") for key, value in settings.items()})


def _is_required(item: Field[Any]) -> bool:
    return item.default is MISSING and item.default_factory is MISSING


def _target(path: object, where: str) -> type[Any]:
    """The frozen dataclass of that full name."""
    module_name, _, name = str(path).rpartition(".")
    if not module_name.startswith(f"{PACKAGE}."):
        raise InputError(f"{where} is {path!r}, expected a class of this package: {PACKAGE}.module.Class")
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        missing = str(error.name)
        if module_name == missing or module_name.startswith(f"{missing}."):
            raise InputError(f"{where}: there is no module {missing}; correct {path}") from error
        raise InputError(f"{where}: {path} needs the package {missing}; install it with pip") from error
    target = vars(module).get(name)
    if not isinstance(target, type) or target.__module__ != module_name:
        own = [key for key, value in vars(module).items() if is_dataclass(value) and value.__module__ == module_name]
        raise unknown_name(f"class of {module_name}", name, own, where)
    if not is_dataclass(target) or not vars(target)["__dataclass_params__"].frozen:
        raise InputError(f"{where}: {path} is no frozen dataclass and cannot be built from a configuration")
    return target


def _part(kind: type[Any], value: object, where: str) -> Any:
    """A part of a part: the class that the value names, or else a dataclass with the settings that it lists."""
    if is_dataclass(kind) and isinstance(value, Mapping) and "_target_" not in value:
        return _filled(kind, value, where)
    return build(value, where)


def typed(value: object, kind: Any, where: str) -> Any:
    """`value` as a field annotated `kind` takes it; a field annotated with a class of this package holds a part.

    An integer is accepted where a float is expected and a list where a tuple is; a truth value is
    no number.

    Args:
        value: Plain containers, strings, numbers, truth values or None.
        kind: The annotation: these types, unions of them, `Literal`, `list[...]`, `tuple[...]`,
            `dict[str, ...]`, `Mapping[str, ...]`, a frozen dataclass of such fields or `Any`.
        where: Key, for messages.

    Raises:
        InputError: the value is of another type.
        TypeError: the annotation is none of these.
    """
    if kind is Any or kind is object:
        return value
    if isinstance(kind, type) and kind.__module__.startswith(f"{PACKAGE}."):
        return _part(kind, value, where)
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return _member(value, kind, where)
    if origin is Literal:
        if value not in arguments:
            raise unknown_name("value", value, map(str, arguments), where)
        return value
    if origin in (list, tuple) and isinstance(value, list | tuple):
        return _sequence(value, kind, where)
    if origin in (dict, Mapping) and isinstance(value, Mapping):
        return {str(key): typed(item, arguments[1], f"{where}.{key}") for key, item in value.items()}
    scalar = _scalar(value, kind)
    if scalar is _REFUSED:
        if kind not in _IN_WORDS and origin not in (list, tuple, dict, Mapping):
            raise TypeError(f"{where}: fields of a part cannot be annotated {kind}")
        raise _mistyped(value, kind, where)
    return scalar


_REFUSED = object()
_IN_WORDS = {int: "a whole number", float: "a number", str: "a text", bool: "true or false", type(None): "null"}


def _scalar(value: object, kind: Any) -> object:
    if kind is float and type(value) is int:
        return float(value)
    return value if kind in _IN_WORDS and type(value) is kind else _REFUSED


def _member(value: object, kind: Any, where: str) -> object:
    """`value` as the first member of the union that takes it."""
    for member in get_args(kind):
        try:
            return typed(value, member, where)
        except InputError:
            continue
    raise _mistyped(value, kind, where)


def _sequence(value: list[Any] | tuple[Any, ...], kind: Any, where: str) -> list[Any] | tuple[Any, ...]:
    origin, arguments = get_origin(kind), get_args(kind)
    any_length = origin is list or arguments[-1] is Ellipsis
    expected = (arguments[0],) * len(value) if any_length else arguments
    if len(value) != len(expected):
        raise _mistyped(value, kind, where)
    return origin(typed(item, one, f"{where}[{i}]") for i, (item, one) in enumerate(zip(value, expected, strict=True)))


def _mistyped(value: object, kind: Any, where: str) -> InputError:
    return InputError(f"{where} is {value!r}, expected {_words(kind)}; correct it")


def _words(kind: Any) -> str:
    """An annotation in words."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return " or ".join(map(_words, arguments))
    if origin is Literal:
        return " or ".join(map(repr, arguments))
    if origin in (dict, Mapping):
        return f"a mapping of names to {_words(arguments[1])}"
    if origin is list or (origin is tuple and arguments[-1] is Ellipsis):
        return f"a list, each item {_words(arguments[0])}"
    if origin is tuple:
        return f"a list of {len(arguments)} items ({', '.join(map(_words, arguments))})"
    return _IN_WORDS.get(kind, "a value")
