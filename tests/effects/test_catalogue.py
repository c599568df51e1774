"""The catalogue holds the vocabulary of contract section 3, and every effect says what it is."""

from pathlib import Path

import numpy as np
import pytest
from sim.random_trees import mjcf

from wipx.core.effect import Effect
from wipx.core.errors import InputError
from wipx.core.parameters import Parameter
from wipx.core.plant import PLANTS, Drive, plant_of, robot_plant
from wipx.diagnosis.candidates.screening import SCANS
from wipx.effects.catalogue import check_together, effect_of, kinds, vocabulary
from wipx.recordings.robot_model import read_tree

# Contract section 3: kind, sites on a wip, parameters that the contract names.
CONTRACT = (
    ("viscous", ("translation", "pitch"), {"sigma"}),
    ("coulomb", ("translation", "pitch"), {"F_c"}),
    ("stribeck", ("translation", "pitch"), {"F_s", "F_c", "v_s"}),
    ("presliding", ("translation", "pitch"), {"stiffness", "F_c"}),
    ("quadratic_drag", ("translation", "pitch"), {"c"}),
    ("sticky_spot", ("translation",), {"F_c", "lo", "hi"}),
    ("gain", ("actuator",), {"k"}),
    ("dead_zone", ("actuator",), {"band"}),
    ("delay", ("actuator", "sensor_x", "sensor_theta"), {"tau"}),
    ("lag", ("actuator",), {"tau"}),
    ("saturation", ("actuator",), {"F_max"}),
    ("speed_limit", ("actuator",), {"F_stall", "v_free"}),
    ("backlash", ("actuator",), {"gap"}),
    ("ripple", ("actuator",), {"A", "n", "phase"}),
    ("payload", ("geometry",), {"mass", "height"}),
    ("payload_event", ("geometry",), {"mass", "height", "t0"}),
    ("com_offset", ("geometry",), {"theta_eq"}),
    ("inertia", ("geometry",), {"scale"}),
    ("rail_tilt", ("environment",), {"angle"}),
    ("spring", ("environment",), {"k", "x0"}),
    ("bias", ("sensor_theta",), {"b"}),
    ("scale", ("sensor_x", "sensor_theta"), {"e"}),
)
# Contract section 6: kinds by site, of a robot from a model file whose second drive is a position drive.
FRICTION = "viscous coulomb stribeck presliding asymmetric_coulomb quadratic_drag load_friction sticky_spot"
CONTRACT_OF_TREES = {
    "j0": f"{FRICTION} rotor_inertia spring",
    "actuator_j0": "gain offset dead_zone delay lag saturation speed_limit ripple backlash elasticity",
    "actuator_j1": "kp kd",
    "actuator": "delay",
    "sensor_j0": "bias scale delay",
    "link_b0": "payload com_offset inertia",
    "environment": "base_tilt",
}
ALL = sorted(kinds())


def test_the_vocabulary_of_the_contract_is_there():
    known = vocabulary(plant_of("wip"))
    for kind, sites, parameters in CONTRACT:
        assert {name for name in known if name.endswith(f"/{kind}")} == {f"{site}/{kind}" for site in sites}
        assert parameters <= {p.name for p in kinds()[kind].parameters}, kind


def test_the_vocabulary_of_robots_from_model_files_is_there(tmp_path: Path):
    file = tmp_path / "robot.xml"
    file.write_text(mjcf(2, np.random.default_rng(0)), encoding="utf-8")
    plant = robot_plant(read_tree(file, {}), {"j1": Drive("position", kp=20.0, kd=1.0)})
    known = {name for name, effect in vocabulary(plant).items() if not effect.is_outside(plant)}
    missing = {f"{site}/{kind}" for site, kinds in CONTRACT_OF_TREES.items() for kind in kinds.split()} - known
    assert not missing


@pytest.mark.parametrize("kind", ALL)
def test_every_effect_says_what_it_is(kind: str):
    effect = kinds()[kind]
    assert effect.kind == kind
    assert effect.words
    assert effect.law
    assert effect.source
    assert effect.sites
    assert effect.parameters
    assert set(effect.excludes) <= set(ALL)
    names = [p.name for p in effect.parameters]
    assert len(set(names)) == len(names)
    assert effect.neutral.keys() == set(names)
    for p in effect.parameters:
        assert p.meaning
        assert p.low < p.high
        assert p.low <= p.start <= p.high


@pytest.mark.parametrize("kind", ALL)
def test_what_an_effect_says_of_others_and_of_its_numbers_exists(kind: str):
    effect = kinds()[kind]
    relations = (effect.contains, effect.extends, effect.with_constant)
    assert {relation.kind for relation in relations if relation} <= set(ALL)
    if effect.contains:
        assert set(effect.contains.symbols) <= effect.neutral.keys()
        assert set(effect.contains.symbols.values()) <= kinds()[effect.contains.kind].neutral.keys()
    if effect.extends:
        assert kinds()[effect.extends.kind].neutral.keys() <= effect.neutral.keys()
    if effect.made_of:
        known = {f"{site}/{other}.{p.name}" for other in ALL for site in kinds()[other].sites for p in params(other)}
        assert set(effect.made_of.numbers) <= known
        assert set(effect.made_of.numbers.values()) <= effect.neutral.keys()
    if effect.non_smooth:
        assert effect.non_smooth.ridge.keys() | effect.non_smooth.imitates.keys() <= effect.neutral.keys()
        assert set(effect.non_smooth.imitates.values()) <= set(ALL)
    assert {*effect.linear_in, *(effect.stretch or ()), *filter(None, (effect.begins,))} <= effect.neutral.keys()
    assert not effect.linear_at_rest or effect.linear_at_rest in ALL
    assert not effect.scan or effect.scan in SCANS
    assert {name.partition("/")[2] for name in effect.indistinguishable} <= set(ALL)


def params(kind: str) -> tuple[Parameter, ...]:
    return kinds()[kind].parameters


def test_every_kind_is_defined_once():
    assert len({effect.law for effect in kinds().values()}) == len(ALL)


def test_units_follow_the_joint():
    F_c = kinds()["coulomb"].parameters[0]
    assert (F_c.unit(angular=False), F_c.unit(angular=True)) == ("N", "N m")
    sigma = kinds()["viscous"].parameters[0]
    assert (sigma.unit(angular=False), sigma.unit(angular=True)) == ("N s/m", "N m s/rad")
    wip, pendulum = PLANTS["wip"], PLANTS["pendulum"]
    assert wip.is_angular("pitch")
    assert not wip.is_angular("translation")
    assert not wip.is_angular("actuator")
    assert pendulum.is_angular("actuator")
    assert wip.is_angular("sensor_theta")
    assert not wip.is_angular("sensor_x")


@pytest.mark.parametrize(
    ("plant", "has", "lacks"),
    [
        (
            "pendulum",
            {"pitch/coulomb", "geometry/payload", "sensor_theta/bias"},
            {"translation/coulomb", "environment/spring"},
        ),
        (
            "linear_axis",
            {"translation/sticky_spot", "environment/rail_tilt"},
            {"geometry/com_offset", "geometry/inertia"},
        ),
        (
            "double_pendulum",
            {"joint1/stribeck", "joint2/lugre", "sensor_theta2/delay"},
            {"geometry/payload", "joint1/sticky_spot"},
        ),
    ],
)
def test_a_plant_has_the_effects_that_mean_something_there(plant: str, has: set[str], lacks: set[str]):
    known = set(vocabulary(PLANTS[plant]))
    assert has <= known
    assert not lacks & known
    assert {name.partition("/")[0] for name in known} <= set(PLANTS[plant].sites)


def test_an_unknown_effect_lists_the_valid_ones():
    with pytest.raises(InputError) as caught:
        effect_of("translation/colomb", plant_of("wip"), "robot.yaml: effects")
    message = str(caught.value)
    assert message.startswith("robot.yaml: effects: ")
    assert "did you mean translation/coulomb?" in message
    assert all(name in message for name in vocabulary(plant_of("wip")))
    assert "\n" not in message


@pytest.mark.parametrize(
    "names",
    [
        ("pitch/stribeck", "pitch/coulomb"),
        ("pitch/coulomb", "pitch/stribeck"),
        ("pitch/presliding", "pitch/lugre"),
        ("translation/lagged_stribeck", "translation/viscous"),
        ("translation/coulomb", "translation/asymmetric_coulomb"),
    ],
)
def test_two_names_for_one_friction_at_a_joint_are_refused(names: tuple[str, ...]):
    with pytest.raises(InputError, match="describe the same physics; keep one of them"):
        check_together(names, plant_of("wip"))


def test_friction_at_different_joints_and_different_physics_at_one_go_together():
    names = (
        "pitch/stribeck",
        "translation/coulomb",
        "translation/viscous",
        "translation/sticky_spot",
        "actuator/delay",
    )
    check_together(names, plant_of("wip"))


def test_neutral_values_are_by_name():
    assert isinstance(kinds()["gain"], Effect)
    assert kinds()["gain"].neutral == {"k": 1.0}
    assert kinds()["delay"].neutral == {"tau": 0.0}
