"""Input at fault: exit status 2, one line that says where and what, and no file left behind."""

from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

Damage = Callable[..., object]


def write_model(folder, change: dict) -> None:
    robot = folder.robot
    (folder.path.parent / "model.yaml").write_text(yaml.safe_dump({"schema": 1, **robot, **change}))


def swap_rows(folder) -> None:
    lines = folder.lines
    lines[5], lines[6] = lines[6], lines[5]
    folder.write(lines)


def replace_parameter(folder, **parameters: float | None) -> None:
    robot = folder.robot
    merged = {**robot["parameters"], **parameters}
    folder.describe({**robot, "parameters": {name: v for name, v in merged.items() if v is not None}})


RECORDINGS: dict[str, tuple[Damage, list[str]]] = {
    "missing column": (
        lambda f: f.write([line.rpartition(",")[0] for line in f.lines]),
        ["b.csv", "column u", "missing"],
    ),
    "unknown unit": (
        lambda f: f.describe({**f.robot, "signals": {"theta": {"column": "theta", "unit": "furlong"}}}),
        ["robot.yaml", "theta", "furlong"],
    ),
    "time decreases": (swap_rows, ["b.csv", "line 7", "t decreases"]),
    "time repeats": (lambda f: f.cell(7, 0, "0.04"), ["b.csv", "line 7", "t repeats 0.04"]),
    "not a number": (lambda f: f.cell(9, 1, "NaN"), ["b.csv", "line 9", "theta", "NaN"]),
    "text": (lambda f: f.cell(9, 2, "off"), ["b.csv", "line 9", "u is 'off'"]),
    "empty file": (lambda f: f.write([]), ["b.csv", "empty"]),
    "header alone": (lambda f: f.write(f.lines[:1]), ["b.csv", "a header line but no row"]),
    "shorter than a window": (lambda f: f.write(f.lines[:50]), ["b.csv", "s long, expected more than 0.55 s"]),
    "ragged row": (lambda f: f.write([*f.lines, "9.9,0"]), ["b.csv", "line 202"]),
    "no recordings": (lambda f: [p.unlink() for p in f.path.glob("*.csv")], ["swing", "no recordings"]),
    "no robot": (lambda f: (f.path / "robot.yaml").unlink(), ["robot.yaml is missing"]),
    "robot is no YAML": (lambda f: (f.path / "robot.yaml").write_text("plant: [a"), ["robot.yaml"]),
    "missing parameter": (lambda f: replace_parameter(f, com_height=None), ["robot.yaml", "lacks com_height [m]"]),
    "negative mass": (lambda f: replace_parameter(f, body_mass=-1.0), ["robot.yaml", "body_mass = -1", "positive"]),
    "unknown parameter": (lambda f: replace_parameter(f, body_mas=1.0), ["robot.yaml", "did you mean body_mass?"]),
    "unknown plant": (lambda f: f.describe({**f.robot, "plant": "segway"}), ["robot.yaml", "segway", "cartpole"]),
    "unknown effect": (
        lambda f: f.describe({**f.robot, "effects": {"pitch/colomb": {"F_c": 1}}}),
        ["robot.yaml", "did you mean pitch/coulomb?"],
    ),
}
MODELS: dict[str, tuple[Damage, list[str]]] = {
    "missing": (lambda f: None, ["model.yaml", "No such file", "check the path"]),
    "a table": (lambda f: (f.path.parent / "model.yaml").write_text("t,x\n0,1\n"), ["model.yaml", "expected"]),
    "of another plant": (
        lambda f: write_model(f, {"plant": "linear_axis", "parameters": {"body_mass": 1, "wheel_mass": 1}}),
        ["model.yaml", "linear_axis", "pendulum"],
    ),
    "with code": (
        lambda f: (f.path.parent / "model.yaml").write_text("plant: !!python/object/apply:os.getcwd []\n"),
        ["model.yaml", "python"],
    ),
    "of a later schema": (lambda f: write_model(f, {"schema": 9}), ["model.yaml", "schema is 9"]),
    "with an effect at fault": (
        lambda f: write_model(f, {"effects": {"pitch/coulomb": {"F_c": -1.0}}}),
        ["model.yaml", "pitch/coulomb", "F_c = -1"],
    ),
}
ARGUMENTS: dict[str, tuple[list[str], list[str]]] = {
    "task": (["task=predit"], ["task", "'predit'", "did you mean predict?"]),
    "optimizer": (["task=identify", "optimizer=adam"], ["optimizer", "'adam'", "least_squares"]),
    "effect": (["task=identify", "effects=[pitch/colomb]"], ["'pitch/colomb'", "did you mean pitch/coulomb?"]),
    "effect of another plant": (
        ["task=identify", "effects=[translation/coulomb]"],
        ["pendulum", "translation/coulomb"],
    ),
    "recordings": (["recordings=moon"], ["recordings", "'moon'", "folder"]),
    "folder": (["recordings.path=nowhere"], ["recordings.path nowhere does not exist"]),
    "free parameter": (["task=identify", "free.body_mas=0.1"], ["'body_mas'", "did you mean body_mass?"]),
    "bounds": (["task=identify", "bounds={pitch/stribeck.F_c: [0.0, 1.0]}"], ["bounds", "pitch/coulomb.F_c"]),
    "friction that excludes another": (
        ["task=identify", "effects=[pitch/stribeck]"],
        ["pitch/coulomb", "pitch/stribeck", "keep one"],
    ),
    "objective without controller": (["task=identify", "objective=paper"], ["objective=paper", "controller"]),
    "friction without a model": (["task=identify", "friction=identified"], ["friction=identified", "model.path"]),
    "plant": (["plant=wip"], ["plant=wip", "pendulum"]),
    "output folder": (["hydra.run.dir=swing/a.csv/out"], ["swing/a.csv/out", "Not a directory", "hydra.run.dir"]),
}


def assert_refused(answer, said: list[str]) -> None:
    assert (answer.status, answer.out) == (2, "")
    assert answer.error.count("\n") == 1, answer.error
    for words in said:
        assert words in answer.error


@pytest.mark.parametrize("fault", RECORDINGS)
def test_recordings_at_fault(program, folder, tmp_path: Path, fault: str):
    damage, said = RECORDINGS[fault]
    damage(folder)
    assert_refused(program("task=predict", f"recordings.path={folder.path}", "hydra.run.dir=out"), said)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("fault", MODELS)
def test_a_model_file_at_fault(program, folder, tmp_path: Path, fault: str):
    damage, said = MODELS[fault]
    damage(folder)
    arguments = (f"recordings.path={folder.path}", "model.path=model.yaml", "hydra.run.dir=out")
    assert_refused(program("task=predict", *arguments), said)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("fault", ARGUMENTS)
def test_arguments_at_fault(program, folder, tmp_path: Path, fault: str):
    arguments, said = ARGUMENTS[fault]
    defaults = ("task=predict", f"recordings.path={folder.path}", "hydra.run.dir=out")
    given = {argument.partition("=")[0] for argument in arguments}
    kept = [argument for argument in defaults if argument.partition("=")[0] not in given]
    assert_refused(program(*kept, *arguments), said)
    assert not (tmp_path / "out").exists()
    assert sorted(path.name for path in folder.path.iterdir()) == ["a.csv", "b.csv", "robot.yaml"]


@pytest.mark.slow
def test_results_of_an_earlier_run_survive_a_failure(program, folder, tmp_path: Path):
    arguments = ("task=predict", f"recordings.path={folder.path}", "hydra.run.dir=out")
    assert program(*arguments).status == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    swap_rows(folder)
    assert program(*arguments).status == 2
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before
