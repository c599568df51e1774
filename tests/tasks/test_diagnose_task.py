"""`task=diagnose` from recordings to diagnosis.json, a page, and a model that `task=predict` accepts."""

import json
import re
from pathlib import Path

import pytest
import yaml
from diagnosis.recorded import recorded, write_folder

from wipx.recordings.model_file import read_model

AXIS, WIP = ("t", "x", "u"), ("t", "x", "theta", "u")
RESULTS = {"run.json", "config.yaml", "diagnosis.json", "diagnosis.png", "model.yaml", "report.html"}
EFFECT = {"name", "parameters", "equivalent", "evidence", "present_probability"}
CONTRACT = {  # keys of section 5
    "location": {"sites", "regions", "times"},
    "fit": {"horizon_s", "train", "heldout"},
    "unexplained": {"significant", "p_value", "site"},
    "identifiability": {"weak", "next_experiment"},
}
OUTSIDE = re.compile(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//|@import|url\(\s*["']?https?:""")


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An axis with Coulomb friction of 0.5 N; no test changes it."""
    recordings = recorded("linear_axis", {"translation/coulomb": {"F_c": 0.5}}, seed=12)
    return write_folder(tmp_path_factory.mktemp("task") / "axis", "linear_axis", recordings, AXIS)


def own_folder(tmp_path: Path) -> Path:
    """The recordings of a wip without missing physics, to be damaged."""
    return write_folder(tmp_path / "wip", "wip", recorded("wip", {}, seed=13), WIP)


def change_robot(folder: Path, **changes: object) -> None:
    robot = yaml.safe_load((folder / "robot.yaml").read_text())
    (folder / "robot.yaml").write_text(yaml.safe_dump({**robot, **changes}))


def test_an_axis_is_diagnosed_and_its_model_predicts(program, axis: Path, tmp_path: Path):
    answer = program("task=diagnose", f"recordings.path={axis}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    assert "Coulomb friction" in answer.out
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} - {"next_experiment.csv"} == RESULTS
    data = json.loads((out / "diagnosis.json").read_text())
    assert (data["schema"], data["verdict"]) == (1, "mismatch")
    for key, keys in CONTRACT.items():
        assert data[key].keys() >= keys
    (effect,) = data["effects"]
    assert effect.keys() >= EFFECT
    assert effect["name"] == "translation/coulomb"
    assert effect["evidence"].keys() == {"log_evidence_gain", "heldout_gain"}
    level = effect["parameters"]["F_c"]
    assert (set(level), level["unit"]) == ({"value", "ci95", "unit"}, "N")
    assert level["ci95"][0] <= level["value"] <= level["ci95"][1]
    assert level["value"] == pytest.approx(0.5, rel=0.01)
    assert sum(data["location"]["sites"].values()) == pytest.approx(1.0)
    for part in ("train", "heldout"):
        assert data["fit"][part].keys() == {"nominal", "completed", "noise_floor"}
        assert data["fit"][part]["completed"]["x"] < 0.1 * data["fit"][part]["nominal"]["x"]
    assert (out / "diagnosis.png").read_bytes().startswith(b"\x89PNG")
    needs_nothing_from_outside((out / "report.html").read_text())
    model = read_model(out / "model.yaml")
    assert model.effects["translation/coulomb"]["F_c"] == level["value"]
    arguments = (f"recordings.path={axis}", "model.path=out/model.yaml", "hydra.run.dir=seen")
    assert program("task=predict", *arguments).status == 0
    seen = json.loads((tmp_path / "seen" / "metrics.json").read_text())
    assert seen["rms"]["x"] < 0.1 * seen["rms_nominal"]["x"]


def needs_nothing_from_outside(page: str) -> None:
    assert page.lstrip().lower().startswith("<!doctype html>")
    written = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)  # the plotting library's own text
    assert OUTSIDE.search(written) is None
    assert not re.search(r"<script[^>]+src=", page)


@pytest.mark.slow
def test_suspects_are_answered_in_all_results(program, axis: Path, tmp_path: Path):
    suspects = "task.suspects={translation/coulomb: {F_c: 0.5}, actuator/delay: {}}"
    answer = program("task=diagnose", suspects, f"recordings.path={axis}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    assert "asked: translation/coulomb: named" in answer.out
    asked = json.loads((tmp_path / "out" / "diagnosis.json").read_text())["suspects"]
    assert [suspect["name"] for suspect in asked] == ["translation/coulomb", "actuator/delay"]
    assert asked[0]["suspected_size"]["values"] == {"F_c": 0.5}
    assert asked[1]["suspected_size"] is None
    assert "What was asked" in (tmp_path / "out" / "report.html").read_text()


SUSPECTS = {
    "{translation/coulom: {}}": "did you mean translation/coulomb",
    "{translation/coulomb: {F_s: 1}}": "unknown parameter 'F_s'",
    "{translation/coulomb: {F_c: 1000000}}": "expected 0 to",
    "{translation/coulomb: 1}": "task.suspects",
}


@pytest.mark.parametrize("suspects", SUSPECTS)
def test_suspects_that_cannot_be_are_refused_in_one_line(program, axis: Path, tmp_path: Path, suspects: str):
    answer = program("task=diagnose", f"task.suspects={suspects}", f"recordings.path={axis}", "hydra.run.dir=out")
    assert (answer.status, answer.out) == (2, "")
    assert answer.error.count("\n") == 1, answer.error
    assert SUSPECTS[suspects] in answer.error
    assert not (tmp_path / "out").exists()


def test_a_model_that_is_complete_is_consistent(program, tmp_path: Path):
    folder = own_folder(tmp_path)
    answer = program("task=diagnose", f"recordings.path={folder}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    data = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert (data["verdict"], data["effects"]) == ("consistent", [])
    assert data["location"] == {"sites": {}, "regions": [], "times": []}
    assert data["unexplained"]["site"] is None


@pytest.mark.slow
def test_the_same_seed_gives_the_same_answer(program, axis: Path, tmp_path: Path):
    answers = []
    for out in ("first", "second"):
        assert program("task=diagnose", "seed=5", f"recordings.path={axis}", f"hydra.run.dir={out}").status == 0
        data = json.loads((tmp_path / out / "diagnosis.json").read_text())
        answers.append({key: value for key, value in data.items() if key != "seconds"})
    assert answers[0] == answers[1]


def drop_column(folder: Path) -> None:
    path = folder / "r1.csv"
    rows = [line.split(",") for line in path.read_text().splitlines()]
    path.write_text("\n".join(",".join([row[0], row[1], row[3]]) for row in rows) + "\n")


def reverse_command(folder: Path) -> None:
    change_robot(folder, signals={"u": {"column": "u", "scale": -1.0}})


FAULTS = {
    "missing column": (drop_column, ["r1.csv", "column theta", "missing"]),
    "reversed command": (reverse_command, ["sign of u", "reverse it"]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_input_at_fault_is_refused_in_one_line(program, tmp_path: Path, fault: str):
    damage, said = FAULTS[fault]
    folder = own_folder(tmp_path)
    damage(folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    answer = program("task=diagnose", f"recordings.path={folder}", "hydra.run.dir=out")
    assert (answer.status, answer.out) == (2, "")
    assert answer.error.count("\n") == 1, answer.error
    for words in said:
        assert words in answer.error
    assert not (tmp_path / "out").exists()
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "hidden"),
    [
        ("nothing_missing", set()),
        ("one_effect", {"translation/coulomb"}),
        ("two_effects", {"actuator/delay", "translation/viscous"}),
        ("pendulum", {"pitch/coulomb"}),
    ],
)
def test_recordings_of_a_simulator_that_shares_no_code(program, examples: Path, tmp_path: Path, name: str, hidden: set):
    answer = program("task=diagnose", f"recordings.path={examples / name / 'visible'}", "hydra.run.dir=out")
    assert (answer.status, answer.error) == (0, "")
    data = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert {effect["name"] for effect in data["effects"]} == hidden  # README.md of the examples
