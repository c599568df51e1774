"""The factory that builds parts from their nodes, and the configuration files that ship."""

import sys
import types
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import pytest
import yaml

from wipx.app import configuration_folder
from wipx.config import build, typed
from wipx.core.errors import InputError

PRESETS = ("experiment", "profile")  # of several groups at once
OPTIONS = sorted(path for path in configuration_folder().glob("*/*.yaml") if path.parent.name not in PRESETS)


@dataclass(frozen=True)
class Search:
    budget: int
    tolerance: float = 1e-6
    method: Literal["trf", "lm"] = "trf"
    span: tuple[float, float] = (0.0, 1.0)
    starts: tuple[float, ...] = ()
    weights: Mapping[str, float] = field(default_factory=dict)
    verbose: bool = False
    path: str | None = None
    limit: int | float | None = None


@dataclass
class Thawed:
    budget: int = 1


@pytest.fixture(autouse=True)
def stub_module(monkeypatch: pytest.MonkeyPatch):
    module = types.ModuleType("wipx.stub")
    vars(module).update(Search=Search, Thawed=Thawed, loads=yaml.safe_load, Borrowed=Path)
    monkeypatch.setattr(Search, "__module__", "wipx.stub")
    monkeypatch.setattr(Thawed, "__module__", "wipx.stub")
    monkeypatch.setitem(sys.modules, "wipx.stub", module)


def node(**settings: Any) -> dict[str, Any]:
    return {"_target_": "wipx.stub.Search", "budget": 10, **settings}


def test_settings_reach_the_part_as_its_fields_are_annotated():
    part = build(
        node(tolerance=1, span=[0, 2], starts=[1, 2.5, 3], weights={"x": 2}, method="lm", limit=None), "optimizer"
    )
    assert part == Search(10, 1.0, "lm", (0.0, 2.0), (1.0, 2.5, 3.0), {"x": 2.0}, limit=None)
    assert type(part.tolerance) is float
    assert type(part.starts) is tuple


def test_a_part_within_a_part_is_built_and_named_by_its_place():
    assert typed(node(), Search, "holder.search") == Search(10)
    with pytest.raises(InputError, match=r"holder\.search\.budget is missing"):
        typed({"_target_": "wipx.stub.Search"}, Search, "holder.search")
    with pytest.raises(InputError, match=r"choose one with holder\.search=OPTION"):
        typed("quick", Search, "holder.search")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"buget": 3}, "optimizer: unknown key 'buget'; did you mean budget?"),
        ({"budget": "???"}, "optimizer.budget is missing"),
        ({"budget": 1.5}, "optimizer.budget is 1.5, expected a whole number"),
        ({"budget": True}, "optimizer.budget is True, expected a whole number"),
        ({"budget": None}, "optimizer.budget is None, expected a whole number"),
        ({"tolerance": True}, "optimizer.tolerance is True, expected a number"),
        ({"tolerance": "1e-3x"}, "optimizer.tolerance is '1e-3x', expected a number"),
        ({"verbose": 1}, "optimizer.verbose is 1, expected true or false"),
        ({"path": 3}, "optimizer.path is 3, expected a text or null"),
        ({"method": "tfr"}, "optimizer.method: unknown value 'tfr'; did you mean trf?"),
        ({"span": [1]}, "optimizer.span is [1], expected a list of 2 items (a number, a number)"),
        ({"starts": [1, "a"]}, "optimizer.starts[1] is 'a', expected a number"),
        ({"starts": 1}, "optimizer.starts is 1, expected a list, each item a number"),
        ({"weights": {"x": "a"}}, "optimizer.weights.x is 'a', expected a number"),
        ({"_target_": "os.path.join"}, "optimizer._target_ is 'os.path.join', expected a class of this package"),
        ({"_target_": "wipxx.stub.Search"}, "expected a class of this package"),
        ({"_target_": "wipx.nowhere.Search"}, "there is no module wipx.nowhere"),
        ({"_target_": "wipx.stub.Serach"}, "unknown class of wipx.stub 'Serach'; did you mean Search?"),
        ({"_target_": "wipx.stub.Borrowed"}, "unknown class of wipx.stub 'Borrowed'"),
        ({"_target_": "wipx.stub.loads"}, "unknown class of wipx.stub 'loads'"),
        ({"_target_": "wipx.stub.Thawed"}, "is no frozen dataclass"),
    ],
)
def test_a_wrong_setting_gets_one_line_that_names_its_key(settings: dict[str, Any], message: str):
    with pytest.raises(InputError) as caught:
        build(node(**settings), "optimizer")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_setting_without_default_must_be_given():
    with pytest.raises(InputError, match=r"optimizer\.budget is missing; give optimizer\.budget=VALUE"):
        build({"_target_": "wipx.stub.Search"}, "optimizer")


@pytest.mark.parametrize("empty", [None, "trf", {}, {"budget": 3}])
def test_a_node_without_target_says_how_to_choose_an_option(empty: object):
    with pytest.raises(InputError, match="choose one with optimizer=OPTION"):
        build(empty, "optimizer")


def test_a_package_that_is_not_installed_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "wipx_needy.py").write_text("import surely_not_installed\n")
    monkeypatch.setattr(sys.modules["wipx"], "__path__", [*sys.modules["wipx"].__path__, str(tmp_path)])
    with pytest.raises(InputError, match="needs the package surely_not_installed"):
        build({"_target_": "wipx.wipx_needy.Part"}, "sim")


def test_an_annotation_that_no_configuration_can_hold_is_a_defect():
    with pytest.raises(TypeError, match="cannot be annotated"):
        typed("x", Path, "sim.path")


def composed(path: Path) -> dict[str, Any]:
    """An option, with the one that it extends and parts of other groups at its own keys as Hydra composes them."""
    content = yaml.safe_load(path.read_text())
    for item in content.pop("defaults", []):
        if isinstance(item, str) and item != "_self_":
            content = {**composed(path.with_name(f"{item}.yaml")), **content}
        for place, option in item.items() if isinstance(item, dict) else ():
            group, _, key = place.lstrip("/").partition("@")
            if "." not in key:
                part = yaml.safe_load((configuration_folder() / group / f"{option}.yaml").read_text())
                content[key] = {**part, **content.get(key, {})}
    return content


def test_every_option_that_ships_builds_or_says_what_it_lacks():
    for path in OPTIONS:
        content = composed(path)
        missing = [key for key, value in content.items() if value == "???"]
        if missing:
            with pytest.raises(InputError, match=rf"{path.parent.name}\.{missing[0]} is missing"):
                build(content, path.parent.name)
        else:
            assert type(build(content, path.parent.name)).__name__ == content["_target_"].rpartition(".")[2], path


def test_every_default_option_ships():
    root = yaml.safe_load((configuration_folder() / "config.yaml").read_text())
    chosen = {
        group.removeprefix("override "): option
        for item in root["defaults"]
        if isinstance(item, dict)
        for group, option in item.items()
    }
    absent = [
        f"{group}={option}"
        for group, option in chosen.items()
        if not (configuration_folder() / group / f"{option}.yaml").is_file()
    ]
    assert not absent
