"""Laws that contain simpler ones: when a rich law was fitted but only its simple part is needed.

Which law contains which, and when it amounts to it, the effects say themselves (`wipx.core.effect.Effect`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.plant import Plant
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.likelihood.sandwich import covariance
from wipx.effects.catalogue import effect_of, kind_of, kinds, vocabulary
from wipx.identify.noise import quantisation, sensor_noise

SPEED_OVER = 0.05  # [s] over which a speed is measured


@dataclass(frozen=True)
class FittedAt:
    """An effect of a fit, and what the recordings show of its joint (a `wipx.core.effect.FittedEffect`).

    Attributes:
        effect: "site/kind".
        fit: With the effect.
        data: The recordings.
    """

    effect: str
    fit: Fit
    data: RecordingBatch

    @property
    def values(self) -> Mapping[str, float]:
        """Its numbers by symbol [SI]."""
        prefix = f"{self.effect}."
        return {n.removeprefix(prefix): v for n, v in self.fit.hypothesis.values.items() if n.startswith(prefix)}

    @property
    def positions(self) -> np.ndarray:
        """Coordinate of the joint in every row, shape (N,) [m or rad]."""
        return self.data.measured[:, self._joint][self.data.rows]

    @property
    def resolution(self) -> float:
        """Smallest deflection of the joint that its sensor shows [m or rad]."""
        series = [r[self._coordinate] for r in self.data.recordings]
        return max(quantisation(series), float(sensor_noise(self.data.recordings, self.data.plant)[self._joint]))

    @property
    def top_speed(self) -> float:
        """Largest speed of the joint [m/s or rad/s]."""
        speeds = []
        for r in self.data.recordings:
            q = r[self._coordinate]
            step = max(1, min(round(SPEED_OVER * r.rate), len(q) - 1))
            speeds.append(np.abs((q[step:] - q[:-step]) / (r.t[step:] - r.t[:-step])).max())
        return float(max(speeds))

    @property
    def rate(self) -> float:
        """Rows per second of the fastest log [Hz]."""
        return max(r.rate for r in self.data.recordings)

    @property
    def latest_start(self) -> float:
        """When the last of the recordings starts [s]."""
        return float(self.data.inputs.t[0].max())

    def deviation(self, weights: Mapping[str, float]) -> float:
        """Standard deviation of a weighted sum of its numbers [SI]."""
        space = self.fit.hypothesis.space
        slope = np.zeros(len(space.free))
        for symbol, weight in weights.items():
            i = space.names.index(f"{self.effect}.{symbol}")
            slope[i] = weight * (space.free[i].high - space.free[i].low)
        return float(np.sqrt(max(slope @ covariance(self.fit) @ slope, 0.0)))

    @property
    def _joint(self) -> int:
        plant = self.data.plant
        return plant.joints.index(plant.joint_at(self.effect.partition("/")[0]))

    @property
    def _coordinate(self) -> str:
        return self.data.plant.coordinates[self._joint]


def simple_law(effect: str) -> str | None:
    """The simple law that an effect contains; None where it contains none."""
    site, contains = effect.partition("/")[0], kind_of(effect).contains
    if contains is None:
        return None
    return f"{site.removeprefix('actuator_') if contains.at_joint else site}/{contains.kind}"


def comes_to_rest(effect: str) -> bool:
    """Whether an effect may gain beyond the simple law in it by how a joint comes to rest."""
    contains = kind_of(effect).contains
    return contains is not None and contains.comes_to_rest


def reduced_effects(fit: Fit, data: RecordingBatch) -> tuple[str, ...] | None:
    """The effects of a fit with one law replaced by the simpler one that it amounts to; None where it does not."""
    for effect in fit.effects:
        simple, contains = simple_law(effect), kind_of(effect).contains
        if simple and contains and simple not in fit.effects and contains.when(FittedAt(effect, fit, data)):
            return tuple(simple if e == effect else e for e in fit.effects)
    return None


def reduced_law(effect: str, beside: tuple[str, ...], plant: Plant) -> str | None:
    """The simple law that an effect contains; None where it contains none, or none that may stand beside the others."""
    simple = simple_law(effect)
    if simple is None:
        return None
    site, _, kind = simple.partition("/")
    here = [e for e in beside if e.startswith(f"{site}/")]
    excluded = simple in beside or any(kind in effect_of(e, plant).excludes for e in here)
    return None if excluded else simple


def effects_in_parts(fit: Fit, data: RecordingBatch) -> tuple[str, ...] | None:
    """The effects of a fit with one in its parts, the parts last; None where no effect has any."""
    known = vocabulary(fit.hypothesis.model.plant)
    for effect in fit.effects:
        parts = [name.partition(".")[0] for name in _numbers_of_parts(effect)]
        rest = tuple(e for e in fit.effects if e != effect and e not in parts)
        made_of = kind_of(effect).made_of
        if parts and made_of and all(part in known for part in parts) and made_of.when(FittedAt(effect, fit, data)):
            return (*rest, *parts)
    return None


def laws_with_constants(fit: Fit) -> Iterator[tuple[str, str, Mapping[str, str]]]:
    """Effects of a fit, the law that each is together with a constant force, and its symbols by those of that law."""
    for effect in fit.effects:
        site, _, kind = effect.partition("/")
        for law in kinds().values():
            if law.with_constant is not None and law.with_constant.kind == kind:
                yield effect, f"{site}/{law.kind}", law.with_constant.symbols


def extended_effects(fit: Fit, effect: str) -> tuple[tuple[str, ...], list[dict[str, float]]] | None:
    """The effects of a fit with a law from beyond the vocabulary, the last, in the place of one that it contains.

    With values to start from; None where no such law is known.
    """
    site, _, kind = effect.partition("/")
    for extended in kinds().values():
        extends = extended.extends
        if extends is not None and extends.kind == kind:
            law = f"{site}/{extended.kind}"
            values = fit.hypothesis.values
            kept = {n.replace(effect, law): value for n, value in values.items() if n.startswith(f"{effect}.")}
            starts = [{**values, **kept, **{f"{law}.{s}": v for s, v in start.items()}} for start in extends.starts]
            return (*(e for e in fit.effects if e != effect), law), starts
    return None


def reduced_values(fit: Fit) -> dict[str, float]:
    """Numbers of the fit's laws as those of the laws that may take their place, so far as they share them."""
    found = {}
    for name, value in fit.hypothesis.values.items():
        effect, _, symbol = name.rpartition(".")
        contains = kind_of(effect).contains if "/" in effect else None
        if contains is not None:
            found[f"{simple_law(effect)}.{contains.symbols.get(symbol, symbol)}"] = value
    for effect in fit.effects:
        for number, symbol in _numbers_of_parts(effect).items():
            found[number] = fit.hypothesis.values[f"{effect}.{symbol}"]
    for effect, law, symbols in laws_with_constants(fit):
        found |= {f"{law}.{own}": fit.hypothesis.values[f"{effect}.{other}"] for own, other in symbols.items()}
    return found


def _numbers_of_parts(effect: str) -> Mapping[str, str]:
    """Symbols of an effect by the numbers of its parts that they are; empty where it has none."""
    site, made_of = effect.partition("/")[0], kind_of(effect).made_of
    return made_of.numbers if made_of is not None and made_of.site == site else {}
