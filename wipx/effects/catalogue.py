"""Every effect, found by name: one module of this package each, no list to edit."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from wipx import effects
from wipx.core.effect import Effect
from wipx.core.errors import InputError, unknown_name
from wipx.core.plant import Plant

_REGISTERED: dict[str, Effect] = {}  # from elsewhere, by kind


def kinds() -> dict[str, Effect]:
    """All effects by kind."""
    return {**_of_this_package(), **_REGISTERED}


def kind_of(name: str) -> Effect:
    """The effect that a name "site/kind" means."""
    kind = name.partition("/")[2]
    return _REGISTERED.get(kind) or _of_this_package()[kind]


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
    names = sorted(module.name for module in iter_modules(effects.__path__))
    modules = (import_module(f"{effects.__name__}.{name}") for name in names)
    found = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    return {effect.kind: effect for effect in found}


def vocabulary(plant: Plant) -> dict[str, Effect]:
    """The effects that can act on a plant, by "site/kind"."""
    have = {*plant.joints, *plant.parameters}
    return {
        f"{site}/{effect.kind}": effect
        for effect in kinds().values()
        for site in effect.sites
        if site in plant.sites and have.issuperset(effect.needs)
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


def check_together(names: tuple[str, ...], plant: Plant, where: str = "effects") -> None:
    """Refuse names that do not exist and kinds that exclude each other at one site.

    Raises:
        InputError: see above.
    """
    for name in names:
        site = name.partition("/")[0]
        for other in effect_of(name, plant, where).excludes:
            if f"{site}/{other}" in names:
                raise InputError(f"{where}: {name} and {site}/{other} describe the same friction; keep one of them")
