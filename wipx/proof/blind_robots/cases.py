"""Cases: a robot with hidden physics and its recordings, drawn until the physics shows and the robot stays up."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wipx.core.plant import PLANTS
from wipx.proof.blind_robots.logging import Run, record
from wipx.proof.blind_robots.physics import DRIVEN, MOVING, Hidden, physics
from wipx.proof.blind_robots.robots import Robot, draw_robot
from wipx.proof.blind_robots.scenario import (
    LENGTHS,
    UNSEEN,
    VISIBLE,
    LogSettings,
    Scenario,
    draw_log_settings,
    draw_scenario,
)
from wipx.proof.blind_robots.sizes import Draw, consequences, draw_details, draw_values, effect_names, families
from wipx.proof.blind_robots.trees.cases import TREE_TIERS
from wipx.proof.blind_robots.unmodelled_physics import draw_unmodelled, unmodelled_names

TIERS = {  # share of the cases; 40 % with nothing hidden, so that 300 cases hold 120 chances of a false alarm
    "nothing": 0.40,
    "single_clear": 0.18,
    "single_weak": 0.11,
    "pair": 0.08,
    "triple": 0.05,
    "outside": 0.08,
    "wrong_parameters": 0.05,
    "poor_logging": 0.05,
}
DIRTY_TIERS = {"dirty": 0.75, "dirt_only": 0.25}  # robots that keep to no law, see `dirty`
PLANT_SHARES = {"wip": 0.6, "cartpole": 0.12, "pendulum": 0.12, "linear_axis": 0.08, "double_pendulum": 0.08}
KNOWN_SHARE = 0.15  # of robots whose owner knows the viscous friction of a joint
SHOWS = {
    "clear": 3.0,
    "weak": 0.7,
    "outside": 4.0,
}  # least difference of some signal, over the noise
ATTEMPTS = 40  # robots for one choice of effects, before another choice
UNCERTAIN = {
    "wip": ("body_inertia", "com_height", "body_mass", "wheel_mass"),
    "cartpole": ("body_inertia", "com_height", "body_mass", "wheel_mass"),
    "pendulum": ("body_inertia", "com_height", "body_mass"),
    "linear_axis": ("wheel_mass", "body_mass"),
    "double_pendulum": ("link1_inertia", "link2_inertia", "link2_com"),
}


@dataclass(frozen=True)
class Case:
    """A robot, what is hidden in it, and its recordings.

    Attributes:
        tier: How hard it is, a key of `TIERS`.
        robot: As its owner believes it to be.
        known: Effects that the owner knows, values of their parameters by "site/kind".
        uncertainty: Relative standard deviations that the owner gives, by parameter.
        parameters: True rigid body [SI].
        hidden: What is missing from the owner's model.
        settings: How the runs are logged.
        visible: Recordings that a diagnosis may read.
        unseen: Recordings to judge the completed model by.
        excitations: Of the visible recordings, then of the unseen ones.
        contrast: Root mean square difference that each hidden effect makes, over the noise, by effect and signal.
        dirt: What keeps to no law and how much it matters, see `dirty.account`; None for an exact robot.
    """

    tier: str
    robot: Robot
    known: Mapping[str, Mapping[str, float]]
    uncertainty: Mapping[str, float]
    parameters: Mapping[str, float]
    hidden: Hidden
    settings: LogSettings
    visible: tuple[Run, ...]
    unseen: tuple[Run, ...]
    excitations: tuple[str, ...]
    contrast: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    dirt: Mapping[str, Any] | None = None

    def noise(self) -> dict[str, float]:
        """Standard deviation of the sensors' noise, with that of their resolution, by coordinate's column."""
        return noise_of(self.robot.kind, self.settings)


def noise_of(kind: str, settings: LogSettings) -> dict[str, float]:
    """Standard deviation of what the log adds to the coordinates: noise, and resolution / sqrt(12)."""
    return {
        name: float(np.hypot(settings.noise[joint], max(settings.resolution[joint], 1e-5) / np.sqrt(12.0)))
        for joint, name in zip(MOVING[kind], PLANTS[kind].coordinates, strict=True)
    }


@dataclass(frozen=True)
class Choice:
    """What a case is about, before sizes are drawn.

    Attributes:
        tier: Key of `TIERS`.
        plant: Kind of plant.
        names: Hidden effects, "site/kind".
        unmodelled: Physics outside the vocabulary; None without.
    """

    tier: str
    plant: str
    names: tuple[str, ...]
    unmodelled: str | None = None


def stratified(cases: int, first: int, tiers: tuple[str, ...], rng: np.random.Generator) -> tuple[str, ...]:
    """The tier of each case: tiers by their shares, in random order.

    Every tier occurs where there are cases enough; the same holds for the first ones on their own.

    Args:
        cases: How many.
        first: Cases at the beginning that are to be a sample of all tiers too.
        tiers: Those to choose from, keys of `TIERS`, of `DIRTY_TIERS` or of `trees.cases.TREE_TIERS`.
        rng: Of the order.
    """
    everywhere = _apportioned(cases, np.array([{**TIERS, **DIRTY_TIERS, **TREE_TIERS}[tier] for tier in tiers]))
    beginning = _apportioned(first, everywhere)
    blocks = (np.repeat(tiers, counts) for counts in (beginning, everywhere - beginning))
    return tuple(str(tier) for block in blocks for tier in rng.permutation(block))


def _apportioned(seats: int, weights: np.ndarray) -> np.ndarray:
    """Whole numbers that sum to `seats`, close to proportional; none zero where there is room and weight."""
    due = seats * weights / weights.sum()
    given = np.where(weights > 0, 1, 0) if seats >= np.count_nonzero(weights) else np.zeros(len(weights), dtype=int)
    for _ in range(seats - int(given.sum())):
        given[np.argmax(due - given)] += 1
    return given


def draw_case(rng: np.random.Generator, tier: str, lengths: tuple[float, float] = LENGTHS) -> Case:
    """A case of a tier; each of its recordings lasts a time between the two `lengths` [s]."""
    while True:
        choice = choose(rng, tier)
        for _ in range(ATTEMPTS):
            case = realise(choice, rng, lengths)
            if case is not None:
                return case


def choose(rng: np.random.Generator, tier: str) -> Choice:
    """Plant and effects; effects uniform over the plant's vocabulary."""
    plant = str(rng.choice(list(PLANT_SHARES), p=list(PLANT_SHARES.values())))
    if tier == "outside":
        return Choice(tier, plant, (), str(rng.choice(unmodelled_names(plant))))
    either = {"wrong_parameters": int(rng.integers(1, 3)), "poor_logging": int(rng.integers(2))}
    count = {"nothing": 0, "pair": 2, "triple": 3, **either}.get(tier, 1)
    return Choice(tier, plant, _compatible(plant, count, tier, rng))


def _compatible(plant: str, count: int, tier: str, rng: np.random.Generator) -> tuple[str, ...]:
    """Effects of different families; none that a wrong parameter looks like."""
    taken = {"mass", "scale"} if tier == "wrong_parameters" else set()
    names: list[str] = []
    for name in rng.permutation(effect_names(plant)).tolist():
        if len(names) < count and not families(name) & taken:
            names.append(name)
            taken |= families(name)
    return tuple(names)


def realise(choice: Choice, rng: np.random.Generator, lengths: tuple[float, float] = LENGTHS) -> Case | None:
    """A robot with that physics and its recordings; None where it falls or where the physics does not show."""
    robot = draw_robot(choice.plant, rng)
    settings = draw_log_settings(choice.plant, rng, poor=choice.tier == "poor_logging")
    shown = _visible_excitations(rng)
    scenarios = tuple(draw_scenario(robot, settings, name, rng, lengths) for name in (*shown, *UNSEEN))
    visible, later = scenarios[: len(shown)], scenarios[len(shown) :]
    nominal = _record(robot, robot.parameters, Hidden(), visible, settings)
    if nominal is None:
        return None
    draw = Draw(robot, consequences(robot, nominal), rng, weak=choice.tier == "single_weak")
    known = _known(choice, draw)
    parameters, uncertainty = _wrong(choice, robot, rng)
    hidden = _hidden(choice, draw)
    real = Hidden({**known, **hidden.effects}, hidden.details, hidden.unmodelled)
    seen = _record(robot, parameters, real, visible, settings)
    if seen is None or not _visited(hidden, seen):
        return None
    contrast = _contrasts(robot, parameters, real, hidden, visible, seen, settings)
    least = SHOWS["weak" if draw.weak else "outside" if hidden.unmodelled else "clear"]
    if contrast is None or any(max(signals.values()) < least for signals in contrast.values()):
        return None
    unseen = _record(robot, parameters, real, later, settings)
    if unseen is None:
        return None
    return Case(
        choice.tier,
        robot,
        known,
        uncertainty,
        parameters,
        hidden,
        settings,
        seen,
        unseen,
        (*shown, *UNSEEN),
        contrast,
    )


def _visible_excitations(rng: np.random.Generator) -> tuple[str, ...]:
    """Four to six of them, a release and a sine among them."""
    count = int(rng.integers(4, 7))
    others = rng.permutation(VISIBLE[2:])[: count - 2].tolist()
    return tuple(name for name in VISIBLE if name in (*VISIBLE[:2], *others))


def _record(
    robot: Robot,
    parameters: Mapping[str, float],
    hidden: Hidden,
    scenarios: tuple[Scenario, ...],
    settings: LogSettings,
) -> tuple[Run, ...] | None:
    """The runs of a robot; None where it falls in one of them."""
    truth = physics(robot.kind, parameters, hidden)
    runs = []
    for scenario in scenarios:
        run = record(robot, truth, scenario, settings)
        if run.fell:
            return None
        runs.append(run)
    return tuple(runs)


def _known(choice: Choice, draw: Draw) -> dict[str, dict[str, float]]:
    """Viscous friction that the owner knows, in some cases, at a joint where none is missing."""
    if draw.rng.random() >= KNOWN_SHARE:
        return {}
    joint = str(draw.rng.choice(PLANTS[choice.plant].joints))
    name = f"{joint}/viscous"
    if any(families(other) & families(name) for other in choice.names) or choice.unmodelled is not None:
        return {}
    return {name: draw_values(name, draw)}


def _wrong(choice: Choice, robot: Robot, rng: np.random.Generator) -> tuple[Mapping[str, float], dict[str, float]]:
    """True parameters, and what the owner says about the uncertain ones."""
    if choice.tier != "wrong_parameters":
        return robot.parameters, {}
    true, uncertainty = dict(robot.parameters), {}
    for name in rng.permutation(UNCERTAIN[choice.plant])[: rng.integers(1, 3)].tolist():
        error = float(rng.choice([-1.0, 1.0])) * rng.uniform(0.05, 0.15)
        true[name] = robot.parameters[name] / (1.0 + error)
        uncertainty[name] = round(float(max(0.05, abs(error) * rng.uniform(0.7, 1.5))), 2)
    return true, uncertainty


def _hidden(choice: Choice, draw: Draw) -> Hidden:
    effects = {name: draw_values(name, draw) for name in choice.names}
    details = {name: draw_details(name, values, draw) for name, values in effects.items()}
    unmodelled = None if choice.unmodelled is None else draw_unmodelled(choice.unmodelled, draw)
    return Hidden(effects, details, unmodelled)


def _visited(hidden: Hidden, runs: tuple[Run, ...]) -> bool:
    """Whether every sticky spot lies where a run comes by, also where other effects move the robot elsewhere.

    Its contrast would not tell: where a joint sticks besides, runs also differ that differ by rounding alone.
    """
    spots = [values for name, values in hidden.effects.items() if name.endswith("/sticky_spot")]
    places = np.concatenate([run.exact["x"] for run in runs]) if spots else np.empty(0)
    return all(((spot["lo"] <= places) & (places <= spot["hi"])).any() for spot in spots)


def _contrasts(
    robot: Robot,
    parameters: Mapping[str, float],
    real: Hidden,
    hidden: Hidden,
    scenarios: tuple[Scenario, ...],
    seen: tuple[Run, ...],
    settings: LogSettings,
) -> dict[str, dict[str, float]] | None:
    """What each hidden effect changes in the recordings, over the noise; None where the robot falls without it."""
    names = [*hidden.effects, *([] if hidden.unmodelled is None else [hidden.unmodelled.name])]
    found = {}
    for name in names:
        others = _record(robot, parameters, real.without(name), scenarios, settings)
        if others is None:
            return None
        found[name] = difference_over_noise(robot.kind, seen, others, noise_of(robot.kind, settings))
    return found


def difference_over_noise(
    kind: str, runs: tuple[Run, ...], others: tuple[Run, ...], noise: Mapping[str, float]
) -> dict[str, float]:
    """Root mean square difference of the same runs of two robots, by signal, over the signal's noise."""
    found = {}
    for name in (*PLANTS[kind].coordinates, *(PLANTS[kind].commands[: len(DRIVEN[kind])])):
        ours = np.concatenate([run.columns[name] for run in runs])
        theirs = np.concatenate([run.columns[name] for run in others])
        # the noise of a command is what a parabola through three rows leaves over
        scale = noise[name] if name in noise else float(np.std(np.diff(theirs, 2)) / np.sqrt(6.0))
        found[name] = float(np.sqrt(np.mean((ours - theirs) ** 2))) / max(scale, 1e-9)
    return found
