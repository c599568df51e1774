"""A diagnosis of a robot with many joints is judged joint by joint."""

from wipx.proof.blind_robots.score import failed, score

TRUTH = {
    "tier": "tree_many",
    "plant": "3 joints",
    "joints": {f"j{i}": {"body": f"b{i}", "drive": "torque"} for i in range(3)},
    "effects": [
        {"name": "j0/coulomb", "parameters": {"F_c": 1.0}},
        {"name": "actuator_j0/offset", "parameters": {"F_0": 0.2}},
        {"name": "link_b2/payload", "parameters": {"mass": 0.1, "x": 0.0, "y": 0.0, "z": 0.1}},
    ],
    "outside": None,
    "regions": [],
    "times": [],
    "dirt": None,
    "contrast": {"j0/coulomb": {"j0": 30.0}, "link_b2/payload": {"j2": 9.0}},
}


def answer(*names: str, equivalent: dict[str, list[str]] | None = None) -> dict:
    effects = [{"name": name, "parameters": {}, "equivalent": (equivalent or {}).get(name, [])} for name in names]
    sites = {name.partition("/")[0]: 1.0 / len(names) for name in names}
    return {"verdict": "mismatch", "effects": effects, "location": {"sites": sites, "regions": [], "times": []}}


def test_an_exact_answer_is_exact_at_every_joint():
    found = score("c", TRUTH, answer("j0/coulomb", "actuator_j0/offset", "link_b2/payload"), 1.0)
    assert found.exact
    assert found.tree is not None
    assert (found.tree.exact, found.tree.affected, found.tree.sites, found.tree.false_effects) == (2, 2, 3, 0)


def test_two_levels_of_dry_friction_are_coulomb_friction_and_an_offset():
    found = score("c", TRUTH, answer("j0/asymmetric_coulomb", "link_b2/payload"), 1.0)
    assert found.exact
    assert found.tree is not None
    assert found.tree.found == 3


def test_a_false_effect_spoils_its_own_joint_only():
    found = score("c", TRUTH, answer("j0/coulomb", "actuator_j0/offset", "link_b2/payload", "j2/viscous"), 1.0)
    assert not found.exact
    assert found.tree is not None
    assert (found.tree.exact, found.tree.affected, found.tree.false_effects) == (1, 2, 1)


def test_an_equivalent_at_another_joint_counts():
    named = answer(
        "j0/coulomb", "actuator_j0/offset", "j1/rotor_inertia", equivalent={"j1/rotor_inertia": ["link_b2/payload"]}
    )
    found = score("c", TRUTH, named, 1.0)
    assert found.exact
    assert found.tree is not None
    assert (found.tree.exact, found.tree.sites) == (2, 3)


def test_many_missed_effects_are_counted_at_once():
    hidden = [{"name": f"j{i % 3}/kind{i}", "parameters": {}} for i in range(40)]
    found = score("c", {**TRUTH, "effects": hidden}, answer("j0/coulomb", "j1/viscous"), 1.0)
    assert found.tree is not None
    assert (found.tree.found, found.tree.false_effects) == (0, 2)


def test_without_an_answer_nothing_is_right():
    found = failed("c", TRUTH, 1.0, "exit status 1")
    assert found.tree is not None
    assert (found.tree.exact, found.tree.found, found.tree.false_effects) == (0, 0, 0)
