"""The numbers an identification may change, and the unit cube in which optimizers search."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from wipx.core.errors import InputError, unknown_name
from wipx.core.model import Model, ModelBatch
from wipx.core.parameters import FreeParameter, Scales
from wipx.core.plant import Plant
from wipx.core.recording import Recording
from wipx.effects.catalogue import effect_of
from wipx.sim.tree.inertias import rest_inertia

LOGARITHMIC = 50.0  # bounds further apart than this factor are searched on a logarithmic scale
FREE_RANGE = 30.0  # a freed plant parameter may lie within this factor of its nominal value
DECADES = 3.5  # of distance from the neutral value that random starts cover
PRIOR_RANGE = 4.0  # standard deviations of a prior that the search covers


@dataclass(frozen=True)
class ParameterSpace:
    """A box of free parameters around a model, mapped to the unit cube.

    Attributes:
        model: The model whose numbers vary.
        free: The numbers, D of them.
    """

    model: Model
    free: tuple[FreeParameter, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters."""
        return tuple(p.name for p in self.free)

    @property
    def start(self) -> np.ndarray:
        """Where a search begins, in the cube, shape (D,)."""
        return self.to_cube(np.array([p.start for p in self.free]))

    @property
    def neutral(self) -> np.ndarray:
        """The model before the identification, or its nearest neighbour in the cube, shape (D,)."""
        return self.to_cube(np.array([p.neutral for p in self.free]))

    def sample(self, count: int, rng: np.random.Generator, reach: float = 1.0) -> np.ndarray:
        """Random positions, shape (count, D), most of them close to the neutral one.

        Physics that was left out is mostly small beside what moves the robot: distances from
        the neutral value are spread evenly over decades. Numbers that are searched on a
        logarithmic scale are spread evenly over it.

        Args:
            count: How many.
            rng: Draws them.
            reach: Share of the way from the neutral value to the end of an interval, up to which is drawn.
        """
        from scipy.stats import qmc  # slow to import, and few need it

        uniform = qmc.Sobol(len(self.free), rng=rng).random_base2(int(np.ceil(np.log2(max(count, 2)))))[:count]
        neutral = self.neutral
        end = (rng.random(uniform.shape) < 1.0 - neutral).astype(float)
        near = neutral + reach * (end - neutral) * 10.0 ** (-DECADES * uniform)
        return np.where(self._logarithmic(), uniform, near)

    def to_cube(self, values: np.ndarray) -> np.ndarray:
        """Positions in the unit cube of values (..., D) [SI]."""
        low, high = self._ends()
        return np.clip((self._scaled(values) - low) / (high - low), 0.0, 1.0)

    def to_values(self, cube: np.ndarray) -> np.ndarray:
        """Values [SI] of positions (..., D) in the unit cube."""
        low, high = self._ends()
        scaled = low + np.asarray(cube) * (high - low)
        return np.where(self._logarithmic(), np.exp(np.where(self._logarithmic(), scaled, 0.0)), scaled)

    def batch(self, cube: np.ndarray) -> ModelBatch:
        """The models at positions (P, D) of the unit cube."""
        return ModelBatch(self.model, self.names, self.to_values(np.atleast_2d(cube)))

    def prior_residuals(self, cube: np.ndarray) -> np.ndarray:
        """Distance from the priors in standard deviations, shape (P, number of priors)."""
        values = self.to_values(np.atleast_2d(cube))
        mean, std = self._priors()
        held = ~np.isnan(std)
        of_factor = np.array([p.of_factor for p in self.free], dtype=bool)
        factors = np.where(of_factor, values / np.where(of_factor, mean, 1.0), 1.0)
        return (np.where(of_factor, mean * np.log(factors), values - mean) / std)[:, held]

    def _priors(self) -> tuple[np.ndarray, np.ndarray]:
        mean = np.array([np.nan if p.prior_mean is None else p.prior_mean for p in self.free])
        std = np.array([np.nan if p.prior_std is None else p.prior_std for p in self.free])
        return mean, std

    def _logarithmic(self) -> np.ndarray:
        return np.array([p.low > 0.0 and p.high / p.low >= LOGARITHMIC for p in self.free], dtype=bool)

    def _scaled(self, values: np.ndarray) -> np.ndarray:
        logarithmic = self._logarithmic()
        return np.where(logarithmic, np.log(np.where(logarithmic, np.maximum(values, 1e-300), 1.0)), values)

    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        low = np.array([p.low for p in self.free])
        high = np.array([p.high for p in self.free])
        return self._scaled(low), self._scaled(high)


def parameter_space(
    model: Model,
    switched_on: tuple[str, ...],
    uncertainty: Mapping[str, float],
    free: Mapping[str, float | None],
    bounds: Mapping[str, tuple[float, float]],
    scales: Mapping[str, Scales],
) -> ParameterSpace:
    """All parameters of the effects that were switched on, and the nominal ones that are not exact.

    Args:
        model: Nominal model with the switched-on effects in it.
        switched_on: Effects whose parameters are all free.
        uncertainty: Relative standard deviation of nominal numbers the owner is not sure of.
        free: Further numbers, each with a relative standard deviation or None for no prior.
        bounds: Search intervals that replace the default ones [SI].
        scales: Characteristic sizes by site.

    Raises:
        InputError: a name that the model does not have, or bounds that exclude the start.
    """
    parameters = [p for name in switched_on for p in effect_parameters(name, model.plant, scales)]
    taken = {p.name for p in parameters}
    known = set(model.parameters) | {f"{e}.{s}" for e, symbols in model.effects.items() for s in symbols}
    for name, deviation in {**uncertainty, **free}.items():
        if name not in known:
            raise unknown_name("parameter", name, known, "free or uncertainty")
        if name not in taken:
            parameters.append(_nominal_parameter(name, model, deviation))
            taken.add(name)
    for name in bounds:
        if name not in taken:
            raise unknown_name("free parameter", name, taken, "bounds")
    bounded = tuple(_bounded(p, bounds.get(p.name)) for p in parameters)
    if not bounded:
        raise InputError(
            "nothing to identify: switch on effects=[site/kind, ...] or a friction, or free=... a parameter"
        )
    start = {p.name: p.start for p in bounded}
    return ParameterSpace(model.with_values(start), bounded)


def effect_parameters(name: str, plant: Plant, scales: Mapping[str, Scales]) -> Iterator[FreeParameter]:
    """The numbers of an effect, with the intervals in which they are searched."""
    site = name.partition("/")[0]
    for p in effect_of(name, plant).parameters:
        size = scales[site].of(p.dimension)
        unit = p.unit(angular=plant.is_angular(site))
        yield FreeParameter(f"{name}.{p.name}", unit, p.low * size, p.high * size, p.start * size, p.neutral)


def _nominal_parameter(name: str, model: Model, deviation: float | None) -> FreeParameter:
    value = model.value(name)
    size = abs(value)
    effect, _, symbol = name.rpartition(".")
    if name not in model.parameters:
        spec = next(p for p in effect_of(effect, model.plant).parameters if p.name == symbol)
        unit = spec.unit(angular=model.plant.is_angular(effect.partition("/")[0]))
        lowest = 0.0 if spec.low >= 0.0 else -np.inf
    else:
        known = model.plant.parameters[name]
        unit, size = known.unit, 1.0 if known.absolute else size
        lowest = -np.inf
        if deviation is not None and value > 0.0 and not known.absolute:
            factor = min(float(np.exp(min(PRIOR_RANGE * deviation, 100.0))), FREE_RANGE)
            std = deviation * value
            return FreeParameter(name, unit, value / factor, value * factor, value, value, value, std, of_factor=True)
    if deviation is not None:
        reach = PRIOR_RANGE * deviation * size
        low = max(value - reach, lowest)
        return FreeParameter(name, unit, low, value + reach, value, value, value, deviation * size)
    if value == 0.0:
        raise InputError(f"free: {name} is 0, which says nothing of its size; give bounds={{{name}: [low, high]}}")
    ends = sorted((value / FREE_RANGE, value * FREE_RANGE))
    return FreeParameter(name, unit, ends[0], ends[1], value, value)


def _bounded(p: FreeParameter, bounds: tuple[float, float] | None) -> FreeParameter:
    if bounds is None:
        return p
    low, high = bounds
    if not low < high:
        raise InputError(f"bounds.{p.name}: [{low:g}, {high:g}], expected low < high")
    return replace(p, low=low, high=high, start=min(max(p.start, low), high))


def scales_of(model: Model, recordings: tuple[Recording, ...]) -> dict[str, Scales]:
    """Characteristic sizes of every site, from what the joints did in the recordings."""
    plant = model.plant
    joints = {site: _joint_scales(model, site, column, recordings) for site, column in plant.columns.items()}
    first = next(iter(joints.values()))
    everywhere = {site: first for site in plant.sites}
    own = {site: joints[plant.joint_at(site)] for site in plant.sites if plant.joint_at(site) != plant.joints[0]}
    own |= {f"sensor_{column}": joints[site] for site, column in plant.columns.items()}
    return {**everywhere, **own, "actuator": joints[plant.joint_at("actuator")], **joints}


def _joint_scales(model: Model, site: str, column: str, recordings: tuple[Recording, ...]) -> Scales:
    plant, p = model.plant, model.parameters
    speeds = np.concatenate([_speeds(r.t, r[column]) for r in recordings])
    velocity = max(float(np.quantile(np.abs(speeds), 0.99)), 1e-6)
    places = np.concatenate([r[column] for r in recordings])
    travel = max(float(np.quantile(np.abs(places), 0.99)), 1e-6)
    radius = p["wheel_radius"] if "wheel_radius" in p and not plant.is_angular(site) else 1.0
    turn = max(float(np.ptp(np.quantile(places, (0.005, 0.995)))) / radius, 1e-6)
    commanded = np.zeros(1)
    if site in plant.actuated:
        command = plant.commands[plant.actuated.index(site)]
        recorded = np.concatenate([r[command] for r in recordings])
        commanded = np.abs(_asked(model, site, recorded, np.concatenate([r[column] for r in recordings])))
    force = max(float(np.quantile(commanded, 0.99)), _inertia(model, site) * velocity / 0.1)
    largest = max(float(commanded.max()), 1e-6 * force)
    usual = max(float(np.sqrt(np.mean(commanded**2))), 1e-6 * force)
    if plant.tree is not None:
        body = next(link.body for link in plant.tree.links if link.joint == site)
        reach = [float(np.linalg.norm(link.place)) for link in plant.tree.links if link.place.any()]
        length = max(reach, default=1.0)
        whole = sum(p[f"{link.body}.mass"] for link in plant.tree.links if link.mass)
        mass = max(p.get(f"{body}.mass", 0.0), 0.1 * whole)
    else:
        mass = p.get("body_mass", p.get("link1_mass", 1.0)) or 1.0
        length = p.get("com_height", p.get("link1_length", 1.0))
    longest = max(float(r.t[-1]) for r in recordings)
    return Scales(force, velocity, travel, mass, length, longest, largest, usual, turn)


def _asked(model: Model, site: str, command: np.ndarray, coordinate: np.ndarray) -> np.ndarray:
    """Force that a command asks for [N or N m], shape (N,)."""
    p = model.parameters
    drive = model.plant.drives.get(site)
    if drive is None:
        return command * p["input_gain"]
    if drive.kind == "torque":
        return command * p[f"{site}.gain"]
    force = (command - coordinate) * model.servo(site)[0]
    return force if drive.limit is None else np.clip(force, -drive.limit, drive.limit)


def _speeds(t: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Mean speeds over about 50 ms."""
    n = max(1, min(round(0.05 / float(np.median(np.diff(t)))), len(t) - 1))
    return (q[n:] - q[:-n]) / (t[n:] - t[:-n])


def _inertia(model: Model, site: str) -> float:
    p = model.parameters
    if model.plant.tree is not None:
        return float(rest_inertia(model.plant.tree)[model.plant.joints.index(site)])
    if site == "translation":
        return p["body_mass"] + p["wheel_mass"] + p["wheel_inertia"] / p["wheel_radius"] ** 2
    if site == "pitch":
        return p["body_mass"] * p["com_height"] ** 2 + p["body_inertia"]
    return p["link1_inertia"] + p["link2_mass"] * p["link1_length"] ** 2 if site == "joint1" else p["link2_inertia"]
