"""Every effect has words that a person understands."""

from pathlib import Path

import pytest
from diagnosis.recorded_arm import arm

from wipx.core.plant import PLANTS
from wipx.effects.catalogue import vocabulary
from wipx.effects.words import effect_in_words, site_in_words


def test_words_name_the_physics_and_the_place():
    assert effect_in_words("translation/coulomb", "wip") == "Coulomb friction on the rail joint"
    assert effect_in_words("sensor_theta/delay", "wip") == "delay of the pitch sensor"
    assert effect_in_words("joint2/viscous", "double_pendulum") == "viscous friction on joint 2"


def test_several_effects_are_joined_by_and():
    words = effect_in_words("pitch/viscous + actuator/delay", "pendulum")
    assert words == "viscous friction on the pendulum's joint and delay of the actuator"


@pytest.mark.parametrize("plant", PLANTS.values(), ids=list(PLANTS))
def test_effects_of_a_plant_have_words_of_their_own(plant):
    words = [effect_in_words(name, plant.kind) for name in vocabulary(plant)]
    assert len(set(words)) == len(words)


def test_effects_of_a_robot_from_a_file_say_at_which_joint_they_are(tmp_path: Path):
    names = vocabulary(arm(tmp_path).plant)
    words = [effect_in_words(name, "robot") for name in names]
    assert len(set(words)) == len(words)
    for joint in ("shoulder", "elbow"):
        own = [effect_in_words(name, "robot") for name in names if joint in name.partition("/")[0]]
        assert all(joint in words for words in own)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=list(PLANTS))
def test_every_site_has_words(plant):
    assert all("_" not in site_in_words(site, plant.kind) for site in plant.sites)


def test_an_unknown_kind_keeps_its_name():
    assert effect_in_words("pitch/some_thing", "wip") == "some thing of the pitch joint"
