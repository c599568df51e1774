"""Where the mismatch is: shares of sites, intervals of signals and of time, maps over the state.

Measured by how much likelier every row becomes by the completed model, seen by the observer of the
nominal one: that one trusts the recordings most, so that an excess stays where it arises.
"""

from collections.abc import Mapping

import numpy as np

from wipx.core.diagnosis import FoundEffect
from wipx.core.location import ErrorMap, Location, Period, Region
from wipx.core.model import ModelBatch
from wipx.core.plant import Plant
from wipx.diagnosis.likelihood.fitting import Fit
from wipx.diagnosis.likelihood.force_response import motion_of
from wipx.diagnosis.likelihood.innovations import InnovationFitter
from wipx.diagnosis.likelihood.recording_batch import RecordingBatch
from wipx.diagnosis.rules import AnswerRules
from wipx.effects.catalogue import kind_of

BINS = 24  # of a map, along each axis
RUN_BINS = 40  # along each recording


def excess_of(fitter: InnovationFitter, nominal: Fit, completed: Fit) -> np.ndarray:
    """By how many nats every row becomes likelier, shape (K + 1, R); zero where rows do not count."""
    white = fitter.white_of(nominal, ModelBatch(completed.hypothesis.model))[0].reshape(nominal.white.shape)
    return 0.5 * np.sum(nominal.white**2 - white**2, axis=1).T


def located(
    fitter: InnovationFitter, nominal: Fit, completed: Fit, effects: tuple[FoundEffect, ...], rest: str | None
) -> Location:
    """Where the mismatch between nominal and completed model is.

    Args:
        fitter: Of both.
        nominal: Before.
        completed: After.
        effects: What was found, with shares.
        rest: Site of what is left unexplained; None where nothing is.
    """
    if not effects and rest is None:
        return Location({}, (), (), None)
    excess = excess_of(fitter, nominal, completed)
    data = fitter.data
    signals = motion_of(fitter, nominal)
    regions = _named_regions(effects, signals, excess, data) or _found_regions(
        signals, excess, data, fitter.rules.answer
    )
    sites = _sites(effects, rest)
    return Location(sites, regions, _periods(effects, excess, data), _map(data, sites, signals, excess))


def _sites(effects: tuple[FoundEffect, ...], rest: str | None) -> Mapping[str, float]:
    sites: dict[str, float] = {}
    for effect in effects:
        site = effect.name.partition("/")[0]
        sites[site] = sites.get(site, 0.0) + effect.share
    if rest is not None and not sites:
        sites[rest] = 1.0
    total = sum(sites.values())
    return {site: float(share / total) for site, share in sorted(sites.items(), key=lambda item: -item[1])}


def _named_regions(
    effects: tuple[FoundEffect, ...], signals: Mapping[str, np.ndarray], excess: np.ndarray, data: RecordingBatch
) -> tuple[Region, ...]:
    """Where on its way a joint meets an effect that acts on a stretch of it."""
    regions = []
    for effect in effects:
        stretch = kind_of(effect.name).stretch
        if stretch is not None:
            low, high = (effect.value(symbol) for symbol in stretch)
            signal = data.plant.columns[data.plant.joint_at(effect.name.partition("/")[0])]
            inside = (signals[signal] >= low) & (signals[signal] <= high)
            regions.append(Region(signal, low, high, _share(excess, inside, data)))
    return tuple(regions)


def _periods(effects: tuple[FoundEffect, ...], excess: np.ndarray, data: RecordingBatch) -> tuple[Period, ...]:
    """From when an effect begins to act to the end of each recording."""
    periods = []
    for effect in effects:
        symbol = kind_of(effect.name).begins
        if symbol:
            begin = effect.value(symbol)
            for r, recording in enumerate(data.recordings):
                end = float(recording.t[-1])
                column = np.zeros_like(data.rows)
                column[:, r] = data.inputs.t[:, r] >= begin
                only = np.where(np.arange(excess.shape[1]) == r, excess, 0.0)
                if begin < end:
                    periods.append(Period(recording.name, begin, end, _share(only, column, data)))
    return tuple(periods)


def _share(excess: np.ndarray, inside: np.ndarray, data: RecordingBatch) -> float:
    total = float(excess[data.counted].sum())
    return float(np.clip(excess[data.counted & inside].sum() / total, 0.0, 1.0)) if total > 0.0 else 0.0


def _found_regions(
    signals: Mapping[str, np.ndarray], excess: np.ndarray, data: RecordingBatch, rules: AnswerRules
) -> tuple[Region, ...]:
    """The interval of a signal that holds most of the excess in few rows, if one does."""
    best: tuple[float, Region] | None = None
    for name, values in signals.items():
        if name == "t":
            continue
        found = _interval(name, values[data.counted], excess[data.counted], rules)
        if found is not None and (best is None or found[0] > best[0]):
            best = found
    return () if best is None else (best[1],)


def _interval(name: str, values: np.ndarray, excess: np.ndarray, rules: AnswerRules) -> tuple[float, Region] | None:
    total = float(excess.sum())
    if total <= 0.0:
        return None
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, 41)))
    if len(edges) < 2:
        return None
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    held = np.bincount(place, weights=excess, minlength=len(edges) - 1) / total
    rows = np.bincount(place, minlength=len(edges) - 1) / len(values)
    held, rows = (np.concatenate([[0.0], np.cumsum(part)]) for part in (held, rows))
    best: tuple[float, Region] | None = None
    for i in range(len(edges) - 1):
        for j in range(i + 1, len(edges)):
            share, few = held[j] - held[i], rows[j] - rows[i]
            told = share >= rules.concentrated and few <= rules.few_rows
            if told and (best is None or share - few > best[0]):
                best = (share - few, Region(name, float(edges[i]), float(edges[j]), float(min(share, 1.0))))
    return best


def _map(
    data: RecordingBatch, sites: Mapping[str, float], signals: Mapping[str, np.ndarray], excess: np.ndarray
) -> ErrorMap:
    plant = data.plant
    names = _axes(plant, sites)
    counted = data.counted
    values = [signals[name][counted] for name in names]
    ends = [np.quantile(v, (0.002, 0.998)) for v in values]
    edges = [np.linspace(low, high, BINS + 1) for low, high in ends]
    sums = np.histogram2d(*values, bins=edges, weights=excess[counted])[0]
    counts = np.histogram2d(*values, bins=edges)[0]
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(counts > 0, sums / counts, np.nan)
    times, along = [], []
    for r in range(len(data.recordings)):
        t = data.inputs.t[counted[:, r], r]
        bounds = np.linspace(t[0], t[-1] + 1e-9, RUN_BINS + 1)
        total = np.histogram(t, bounds, weights=excess[counted[:, r], r])[0]
        times.append(0.5 * (bounds[1:] + bounds[:-1]))
        along.append(total / np.maximum(np.histogram(t, bounds)[0], 1))
    return ErrorMap(
        names,
        (plant.unit_of(names[0]), plant.unit_of(names[1])),
        (edges[0], edges[1]),
        mean,
        tuple(r.name for r in data.recordings),
        tuple(times),
        tuple(along),
    )


def _axes(plant: Plant, sites: Mapping[str, float]) -> tuple[str, str]:
    """Coordinate and rate of the driven joint; of a tree, of the joint with the largest share of the mismatch."""
    site = plant.actuated[0] if plant.tree is None else max(sites, key=lambda each: sites[each])
    joint = plant.joints.index(plant.joint_at(site))
    return plant.coordinates[joint], plant.rates[joint]
