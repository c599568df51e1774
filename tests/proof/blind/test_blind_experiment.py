"""`+experiment=blind` as a user meets it."""

import pytest
import yaml
from tasks.conftest import Program


def test_help_names_the_experiment_and_its_profiles(program: Program):
    text = program("--help").out
    assert "python -m wipx +experiment=blind" in text
    assert "profile: consistency_full, consistency_quick, full, quick" in text


@pytest.mark.parametrize(("profile", "cases"), [("quick", 30), ("full", 300)])
def test_one_switch_chooses_the_size(program: Program, profile: str, cases: int):
    task = yaml.safe_load(program("+experiment=blind", f"profile={profile}", "--cfg=job").out)["task"]
    assert task["cases"] == cases
    assert 0 < task["baselines_cases"] < cases


@pytest.mark.parametrize(("profile", "cases"), [("quick", 20), ("full", 200)])
def test_dirty_robots_are_an_experiment_of_their_own(program: Program, profile: str, cases: int):
    task = yaml.safe_load(program("+experiment=dirty", f"profile={profile}", "--cfg=job").out)["task"]
    assert task["cases"] == cases
    assert task["tiers"] == ["dirty", "dirt_only"]
    assert 0 < task["baselines_cases"] < cases


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("+experiment=blnd", "experiment: unknown option 'blnd'; did you mean blind?"),
        ("profile=ful", "profile: unknown option 'ful'; did you mean full?"),
        ("task.cases=0", "task.cases is 0, expected 1 or more"),
        ("task.lengths=[7,5]", "task.lengths is [7.0, 5.0], expected the shortest and the longest time of a recording"),
        ("task.tiers=[single]", "task.tiers: unknown tier 'single'"),
    ],
)
def test_a_slip_is_one_line_and_status_2(program: Program, argument: str, message: str):
    chosen = () if argument.startswith("+experiment") else ("+experiment=blind",)
    done = program(*chosen, argument, "hydra.run.dir=out")
    assert (done.status, done.out) == (2, "")
    assert message in done.error
    assert done.error.count("\n") == 1
