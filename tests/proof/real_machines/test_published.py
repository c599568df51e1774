"""What authors published, beside what an answer names."""

from pathlib import Path

import numpy as np
import pytest
from sim.random_trees import mjcf

from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.core.parameters import Scales
from wipx.core.plant import plant_of
from wipx.diagnosis.answer.suspects import check_suspects
from wipx.proof.baseline_answers import NamedEffect
from wipx.proof.real_machines.published import Published, counted
from wipx.recordings.robot_file import robot_from_mapping

DRY = Published(
    known={"pitch/coulomb": "F_c = 1 N m", "sensor_theta/bias": "small"},
    main={"pitch/coulomb": ["stribeck", "presliding"]},
    plausible=("actuator/delay",),
)


def pendulum() -> Model:
    plant = plant_of("pendulum")
    parameters = plant.complete({"body_mass": 0.5, "com_height": 0.1, "body_inertia": 0.0}, "test")
    return Model(plant, parameters, {"pitch/viscous": {"sigma": 0.1}})


def test_known_effects_are_asked_about_at_the_authors_figures():
    known = {"pitch/coulomb": "", "pitch/viscous": "", "actuator/delay": ""}
    authors = {"effects": {"pitch/coulomb": {"F_c": 0.3}, "pitch/viscous": {"sigma": 0.1}}}
    published = Published(known, authors=authors, figures={"pitch/viscous": {"sigma": 0.2}})
    assert published.suspects == {
        "pitch/coulomb": {"F_c": 0.3},
        "pitch/viscous": {"sigma": 0.2},
        "actuator/delay": {},
    }


def test_a_figure_of_an_effect_that_is_not_known_is_refused():
    with pytest.raises(InputError, match=r"unknown effect .* did you mean pitch/coulomb"):
        Published({"pitch/coulomb": ""}, figures={"pitch/coulom": {"F_c": 0.3}})


def test_the_authors_model_changes_and_joins_the_nominal_one():
    nominal = pendulum()
    effects = {"pitch/viscous": {"sigma": 0.2}, "pitch/coulomb": {"F_c": 0.3}}
    published = Published(authors={"parameters": {"body_mass": 0.6}, "effects": effects})
    model = published.authors_model(nominal, "task.cases.rig.authors")
    assert model is not None
    assert dict(model.parameters) == {**nominal.parameters, "body_mass": 0.6}
    assert {name: dict(values) for name, values in model.effects.items()} == effects
    assert nominal.value("pitch/viscous.sigma") == 0.1


def test_figures_for_a_robot_from_a_model_file_make_a_model_and_suspects(tmp_path: Path, fresh_seed: int):
    (tmp_path / "robot.xml").write_text(mjcf(3, np.random.default_rng(fresh_seed)), encoding="utf-8")
    nominal = robot_from_mapping({"plant": "robot", "model": "robot.xml"}, "robot.yaml", tmp_path).model
    effect = f"{nominal.plant.joints[1]}/coulomb"
    published = Published({effect: "F_c = 0.01"}, authors={"effects": {effect: {"F_c": 0.01}}})
    model = published.authors_model(nominal, "task.cases.arm.authors")
    assert model is not None
    assert model.plant is nominal.plant
    assert model.value(f"{effect}.F_c") == 0.01
    scales = {site: Scales() for site in nominal.plant.sites}
    assert check_suspects(published.suspects, nominal, scales) == {effect: {"F_c": 0.01}}


def test_without_a_published_model_there_is_none():
    assert Published().authors_model(pendulum(), "task.cases.rig.authors") is None


def test_a_mistyped_authors_model_names_its_key():
    published = Published(authors={"effects": {"pitch/coulom": {"F_c": 0.3}}})
    with pytest.raises(InputError, match=r"task\.cases\.rig\.authors.*did you mean pitch/coulomb"):
        published.authors_model(pendulum(), "task.cases.rig.authors")


@pytest.mark.parametrize(
    ("found", "naming"),
    [
        ((NamedEffect("pitch/coulomb"),), "name"),
        ((NamedEffect("actuator/dead_zone", ("pitch/coulomb",)), NamedEffect("pitch/stribeck")), "tie"),
        ((NamedEffect("pitch/stribeck"),), "same physics"),
        ((NamedEffect("actuator/dead_zone", ("pitch/presliding",)),), "same physics"),
        ((NamedEffect("sensor_theta/bias"),), "missed"),
        ((), "missed"),
    ],
)
def test_a_main_effect_is_named_tied_described_by_another_law_or_missed(found: tuple[NamedEffect, ...], naming: str):
    assert DRY.naming(found) == {"pitch/coulomb": naming}


def test_every_main_effect_of_every_answer_is_counted_once():
    answers = [DRY.naming((NamedEffect("pitch/coulomb"),)), DRY.naming(()), DRY.naming(())]
    assert counted(answers) == {"name": 1, "tie": 0, "same physics": 0, "missed": 2}


def test_names_that_are_known_plausible_tied_or_of_the_same_physics_are_not_counted_as_unpublished():
    found = (
        NamedEffect("pitch/stribeck"),
        NamedEffect("actuator/delay"),
        NamedEffect("geometry/com_offset", ("sensor_theta/bias",)),
        NamedEffect("actuator/ripple"),
    )
    assert DRY.not_published(found) == ("actuator/ripple",)
