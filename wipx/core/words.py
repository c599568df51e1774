"""Effects and sites in plain words, for sentences, tables and pages.

Words begin in lower case (but for names such as Coulomb), so that they fit into a sentence.
"""

from types import MappingProxyType

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
_KINDS = MappingProxyType(
    {
        "asymmetric_coulomb": "Coulomb friction that differs by direction on {place}",
        "back_emf": "back-EMF of the motor",
        "backlash": "backlash of the drive",
        "bias": "constant error (bias) of {place}",
        "com_offset": "centre of mass beside the body axis",
        "coulomb": "Coulomb friction on {place}",
        "dead_zone": "dead zone of {place}",
        "delay": "delay of {place}",
        "gain": "wrong gain of {place}",
        "hysteresis": "hysteresis (Bouc-Wen) on {place}",
        "inertia": "wrong moment of inertia of the body",
        "lag": "first-order lag of {place}",
        "lagged_stribeck": "lagged Stribeck friction on {place}",
        "load_friction": "load-dependent gear friction on {place}",
        "lugre": "LuGre friction (damped bristle with a Stribeck peak) on {place}",
        "offset": "constant force offset of {place}",
        "payload": "payload on the body",
        "payload_event": "payload that comes during the recording",
        "presliding": "pre-sliding (bristle) friction on {place}",
        "quadratic_drag": "quadratic drag on {place}",
        "rail_tilt": "tilt of the rail",
        "remainder": "force of unknown origin on {place}",
        "resonance": "resonance (something swings along) on {place}",
        "ripple": "torque ripple (cogging) of the motor",
        "rotor_inertia": "reflected rotor inertia on {place}",
        "saturation": "saturation of {place}",
        "scale": "scale error of {place}",
        "speed_limit": "torque-speed limit of the motor",
        "spring": "spring or cable that pulls on the carriage",
        "sticky_spot": "sticky spot on the rail",
        "stribeck": "Stribeck friction on {place}",
        "viscous": "viscous friction on {place}",
    }
)


def site_in_words(site: str, plant_kind: str) -> str:
    """A site of a plant, e.g. "the rail joint" for "translation" of a wip."""
    return _PLACES_OF_PLANT.get((plant_kind, site), _PLACES.get(site, site.replace("_", " ")))


def effect_in_words(name: str, plant_kind: str) -> str:
    """An effect "site/kind" of a plant, e.g. "Coulomb friction on the rail joint".

    Several effects, joined by " + ", become "... and ...". A kind without words of its own and a name that
    is no "site/kind" are kept.
    """
    return " and ".join(_one_effect(part.strip(), plant_kind) for part in name.split("+"))


def has_words(kind: str) -> bool:
    """Whether a kind of effect has words of its own."""
    return kind in _KINDS


def _one_effect(name: str, plant_kind: str) -> str:
    site, _, kind = name.partition("/")
    if not kind:
        return name
    fallback = f"{kind.replace('_', ' ')} of {{place}}"
    return _KINDS.get(kind, fallback).format(place=site_in_words(site, plant_kind))
