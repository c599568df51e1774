"""Laws that contain simpler ones: when a rich law was fitted but only its simple part is needed."""

import numpy as np

from wipx.core.plant import Plant
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.likelihood.sandwich import covariance
from wipx.diagnosis.rules import NestingRules
from wipx.effects.catalogue import effect_of, vocabulary
from wipx.identify.noise import quantisation, sensor_noise

CONTAINS = {  # rich law: the simple one that it can always imitate
    "stribeck": "coulomb",
    "presliding": "coulomb",
    "sticky_spot": "coulomb",
    "speed_limit": "saturation",
    "payload_event": "payload",
}
# What an effect is whose memory is never tried: a bristle that does not slip is a spring, with its damping.
PARTS = {"translation/presliding": {"environment/spring.k": "stiffness", "translation/viscous.sigma": "damping"}}
CONTAINED_IN = {"presliding": "hysteresis"}  # law of the vocabulary: a richer one from beyond it
SHAPES = ({"n": 2.0}, {"n": 2.0, "gamma": 0.4}, {"n": 2.0, "gamma": -0.4})  # of hysteresis, to start from
SYMBOLS = {"F_stall": "F_max"}  # of the rich law whose number has another symbol in the simple one


def reduced_effects(fit: Fit, data: RecordingBatch, rules: NestingRules) -> tuple[str, ...] | None:
    """The effects of a fit with one law replaced by the simpler one that it amounts to; None where it does not."""
    for effect in fit.effects:
        kind = _amounts_to(effect, fit, data, rules)
        if kind is not None:
            other = f"{effect.partition('/')[0]}/{kind}"
            rest = tuple(other if e == effect else e for e in fit.effects)
            if len(set(rest)) == len(rest):
                return rest
    return None


def reduced_law(effect: str, beside: tuple[str, ...], plant: Plant) -> str | None:
    """The simple law that an effect contains; None where it contains none, or none that may stand beside the others."""
    site, _, kind = effect.partition("/")
    simple = f"{site}/{CONTAINS[kind]}" if kind in CONTAINS else None
    here = [e for e in beside if e.startswith(f"{site}/")]
    excluded = simple in beside or any(CONTAINS.get(kind) in effect_of(e, plant).excludes for e in here)
    return None if excluded else simple


def effects_in_parts(fit: Fit, data: RecordingBatch, rules: NestingRules) -> tuple[str, ...] | None:
    """The effects of a fit with one in its parts, the parts last; None where no effect has any."""
    plant = fit.hypothesis.model.plant
    for effect in fit.effects:
        parts = [name.partition(".")[0] for name in PARTS.get(effect, ())]
        rest = tuple(e for e in fit.effects if e != effect and e not in parts)
        if parts and all(part in vocabulary(plant) for part in parts) and _hardly_slips(effect, fit, data, rules):
            return (*rest, *parts)
    return None


def _hardly_slips(effect: str, fit: Fit, data: RecordingBatch, rules: NestingRules) -> bool:
    """Whether a bristle bends by a good part of what its joint travels before it slips."""
    value = fit.hypothesis.values
    travel = float(np.ptp(data.measured[:, data.plant.joints.index(effect.partition("/")[0])][data.rows]))
    return value[f"{effect}.F_c"] > rules.hardly_slips * travel * value[f"{effect}.stiffness"]


def extended_effects(fit: Fit, effect: str) -> tuple[tuple[str, ...], list[dict[str, float]]] | None:
    """The effects of a fit with a law from beyond the vocabulary, the last, in the place of one that it contains.

    With values to start from; None where no such law is known.
    """
    site, _, kind = effect.partition("/")
    if kind not in CONTAINED_IN:
        return None
    law = f"{site}/{CONTAINED_IN[kind]}"
    values = fit.hypothesis.values
    kept = {name.replace(effect, law): value for name, value in values.items() if name.startswith(f"{effect}.")}
    starts = [{**values, **kept, **{f"{law}.{symbol}": value for symbol, value in shape.items()}} for shape in SHAPES]
    return (*(e for e in fit.effects if e != effect), law), starts


def reduced_values(fit: Fit) -> dict[str, float]:
    """Numbers of the fit's rich laws as those of the simple ones that they contain."""
    found = {}
    for name, value in fit.hypothesis.values.items():
        effect, _, symbol = name.rpartition(".")
        site, _, kind = effect.partition("/")
        if kind in CONTAINS:
            found[f"{site}/{CONTAINS[kind]}.{SYMBOLS.get(symbol, symbol)}"] = value
    for effect, parts in PARTS.items():
        if effect in fit.effects:
            found.update({name: fit.hypothesis.values[f"{effect}.{symbol}"] for name, symbol in parts.items()})
    return found


def _amounts_to(effect: str, fit: Fit, data: RecordingBatch, rules: NestingRules) -> str | None:
    site, _, kind = effect.partition("/")
    value = {name.rpartition(".")[2]: v for name, v in fit.hypothesis.values.items() if name.startswith(f"{effect}.")}
    if kind == "presliding":
        visible = rules.invisible * _resolution(site, data)
        return "coulomb" if value["F_c"] < visible * value["stiffness"] else None
    if kind == "stribeck":
        return "coulomb" if not _peak_is_certain(effect, fit, rules) else None
    if kind == "speed_limit":
        return "saturation" if value["v_free"] > rules.beyond_reach * _top_speed(data) else None
    if kind == "payload_event":
        return "payload" if value["t0"] <= float(data.inputs.t[0].max()) + 0.15 else None
    if kind == "sticky_spot":
        travel = data.measured[:, 0][data.rows]
        inside = np.mean((travel >= value["lo"]) & (travel <= value["hi"]))
        return "coulomb" if inside > rules.all_over else None
    return None


def _resolution(site: str, data: RecordingBatch) -> float:
    joint = data.plant.joints.index(site)
    series = [r[data.plant.coordinates[joint]] for r in data.recordings]
    return max(quantisation(series), float(sensor_noise(data.recordings, data.plant)[joint]))


def _peak_is_certain(effect: str, fit: Fit, rules: NestingRules) -> bool:
    """Whether static and Coulomb level differ by more than chance."""
    space, cube = fit.hypothesis.space, fit.hypothesis.cube
    static, level = space.names.index(f"{effect}.F_s"), space.names.index(f"{effect}.F_c")
    size = np.array([p.high - p.low for p in space.free])
    slope = np.zeros(len(cube))
    slope[[static, level]] = size[static], -size[level]
    peak = float(slope @ cube)
    return peak > rules.certain_peak * float(np.sqrt(slope @ covariance(fit) @ slope))


def _top_speed(data: RecordingBatch) -> float:
    joint = data.plant.joints.index(data.plant.actuated[0])
    speeds = []
    for r in data.recordings:
        q = r[data.plant.coordinates[joint]]
        step = max(1, min(round(0.05 * r.rate), len(q) - 1))
        speeds.append(np.abs((q[step:] - q[:-step]) / (r.t[step:] - r.t[:-step])).max())
    return float(max(speeds))
