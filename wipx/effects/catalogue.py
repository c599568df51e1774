"""Every effect, found by name: one module of this package each, no list to edit."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from itertools import combinations
from pkgutil import iter_modules
from types import ModuleType

from wipx import effects
from wipx.core.effect import Effect
from wipx.core.errors import InputError, unknown_name
from wipx.core.plant import Plant
from wipx.effects import trees

_REGISTERED: dict[str, Effect] = {}  # from elsewhere, by kind


def kinds() -> dict[str, Effect]:
    """All effects by kind."""
    return {**_of_this_package(), **_REGISTERED}


def kind_of(name: str) -> Effect:
    """The effect that a name "site/kind" means.

    Some kinds act otherwise at links and joints of a robot from a model file than at the sites of the other plants.
    """
    site, _, kind = name.partition("/")
    known = kinds().get(kind)
    return known if known is not None and (site in known.sites or kind not in of_trees()) else of_trees()[kind]


@contextmanager
def registered(effect: Effect) -> Iterator[Effect]:
    """An effect from elsewhere than this package, known while the block runs.

    Raises:
        InputError: there is an effect of that kind already.
    """
    if effect.kind in kinds():
        raise InputError(f"effect {effect.kind}: there is one of that kind already; choose another name")
    _REGISTERED[effect.kind] = effect
    try:
        yield effect
    finally:
        del _REGISTERED[effect.kind]


@cache
def _of_this_package() -> dict[str, Effect]:
    return _found_in(effects)


@cache
def of_trees() -> dict[str, Effect]:
    """Effects that act on robots from a model file only, by kind."""
    return _found_in(trees)


def _found_in(package: ModuleType) -> dict[str, Effect]:
    names = sorted(module.name for module in iter_modules(package.__path__) if not module.ispkg)
    modules = (import_module(f"{package.__name__}.{name}") for name in names)
    found = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    return {effect.kind: effect for effect in found}


def vocabulary(plant: Plant) -> dict[str, Effect]:
    """The effects that can act on a plant, by "site/kind"."""
    have = {*plant.joints, *plant.parameters}
    every = (*kinds().values(), *(of_trees().values() if plant.tree is not None else ()))
    sites: dict[str, list[str]] = {}
    for site in plant.sites:
        sites.setdefault(plant.class_of(site), []).append(site)
    return {
        f"{site}/{effect.kind}": effect
        for effect in every
        for at in effect.sites
        for site in sites.get(at, ())
        if have.issuperset(effect.needs) and plant.shows(site, effect.kind)
    }


def effect_of(name: str, plant: Plant, where: str = "effects") -> Effect:
    """The effect "site/kind" of a plant.

    Raises:
        InputError: the plant has no such effect; the message lists those that it has.
    """
    known = vocabulary(plant)
    if name not in known:
        raise unknown_name(f"effect of plant {plant.kind}", name, known, where)
    return known[name]


def alike(plant: Plant) -> dict[str, tuple[str, ...]]:
    """Effects of a plant that no recording tells apart, by each of them.

    If a robot has one joint, what a late drive makes it do is what a late sensor shows of it: its motion under past
    commands.
    """
    known = vocabulary(plant)
    pairs = [(name, other) for name, effect in known.items() for other in effect.indistinguishable if other in known]
    if len(plant.joints) == 1:
        pairs += combinations([name for name in known if name.endswith("/delay")], 2)
    found: dict[str, tuple[str, ...]] = {}
    for one, other in pairs:
        found[one] = (*found.get(one, ()), other)
        found[other] = (*found.get(other, ()), one)
    return found


def check_together(names: tuple[str, ...], plant: Plant, where: str = "effects") -> None:
    """Refuse names that do not exist and kinds that exclude each other at one site.

    Raises:
        InputError: see above.
    """
    for name in names:
        site = name.partition("/")[0]
        for other in effect_of(name, plant, where).excludes:
            if f"{site}/{other}" in names:
                raise InputError(f"{where}: {name} and {site}/{other} describe the same physics; keep one of them")
