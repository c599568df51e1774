"""Laws that contain simpler ones."""

from wipx.core.plant import plant_of
from wipx.diagnosis.selection.nested_laws import reduced_law

WIP = plant_of("wip")


def test_a_rich_law_has_a_simple_one_where_there_is_room():
    assert reduced_law("pitch/presliding", (), WIP) == "pitch/coulomb"
    assert reduced_law("pitch/presliding", ("translation/coulomb",), WIP) == "pitch/coulomb"
    assert reduced_law("pitch/presliding", ("pitch/coulomb",), WIP) is None
    assert reduced_law("pitch/sticky_spot", ("pitch/stribeck",), WIP) is None  # which excludes Coulomb friction
    assert reduced_law("pitch/viscous", (), WIP) is None
