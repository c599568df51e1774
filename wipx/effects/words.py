"""Effects and sites in plain words, for sentences, tables and pages.

Words begin in lower case (but for names such as Coulomb), so that they fit into a sentence.
"""

from collections.abc import Sequence
from types import MappingProxyType

from wipx.effects.catalogue import kind_of, kinds, of_trees

_PLACES = MappingProxyType(
    {
        "translation": "the rail joint",
        "pitch": "the pitch joint",
        "joint1": "joint 1",
        "joint2": "joint 2",
        "actuator": "the actuator",
        "geometry": "the masses and lengths",
        "environment": "the environment",
        "sensor_x": "the position sensor",
        "sensor_theta": "the pitch sensor",
        "sensor_theta1": "the sensor of joint 1",
        "sensor_theta2": "the sensor of joint 2",
    }
)
_PLACES_OF_PLANT = MappingProxyType(
    {
        ("cartpole", "translation"): "the cart's rail",
        ("cartpole", "pitch"): "the pole's joint",
        ("pendulum", "pitch"): "the pendulum's joint",
        ("pendulum", "sensor_theta"): "the angle sensor",
        ("linear_axis", "translation"): "the axis's rail",
    }
)


def site_in_words(site: str, plant_kind: str) -> str:
    """A site of a plant, e.g. "the rail joint" for "translation" of a wip, "the drive of elbow" for a robot."""
    if plant_kind == "robot":
        return _place_on_robot(site)
    return _PLACES_OF_PLANT.get((plant_kind, site), _PLACES.get(site, site.replace("_", " ")))


def _place_on_robot(site: str) -> str:
    """A site of a robot from a model file; joints and links keep their names."""
    first, _, name = site.partition("_")
    whole = {"actuator": "all drives", "environment": "the base"}
    if site in whole or not name:
        return whole.get(site, site)
    return {"actuator": f"the drive of {name}", "sensor": f"the sensor of {name}", "link": name}.get(first, site)


def effect_in_words(name: str, plant_kind: str) -> str:
    """An effect "site/kind" of a plant, e.g. "Coulomb friction on the rail joint".

    Several effects, joined by " + ", become "... and ...". An unknown kind and a name that is no "site/kind" are
    kept.
    """
    return " and ".join(_one_effect(part.strip(), plant_kind) for part in name.split("+"))


def kind_at(sites: Sequence[str], kind: str, plant_kind: str) -> str:
    """A kind of effect at several sites, e.g. "viscous friction on elbow and wrist"."""
    known = kind_of(f"{sites[0]}/{kind}") if kind in kinds() or kind in of_trees() else None
    words = known.words if known else f"{kind.replace('_', ' ')} of {{place}}"
    return words.format(place=in_a_row([site_in_words(site, plant_kind) for site in sites]))


def in_a_row(words: Sequence[str]) -> str:
    """Words as a sentence lists them, e.g. "a, b and c"."""
    return " and ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)


def _one_effect(name: str, plant_kind: str) -> str:
    site, _, kind = name.partition("/")
    return kind_at([site], kind, plant_kind) if kind else name
