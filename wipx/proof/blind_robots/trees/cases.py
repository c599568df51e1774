"""Cases with many joints: a robot with hidden physics and its recordings, drawn until the physics shows."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from wipx.proof.blind_robots.trees.choices import choose, draw_unmodelled, families, unmodelled_of
from wipx.proof.blind_robots.trees.links import corrected
from wipx.proof.blind_robots.trees.logging import Run, Tuning, control_of, record
from wipx.proof.blind_robots.trees.physics import Hidden, real
from wipx.proof.blind_robots.trees.plans import UNSEEN, VISIBLE, LogSettings, Scenario, draw_log_settings, draw_scenario
from wipx.proof.blind_robots.trees.robots import GRAVITY, Robot, draw_robot
from wipx.proof.blind_robots.trees.run import Control
from wipx.proof.blind_robots.trees.sizes import Doing, Draw, doing, draw_details, draw_values

TREE_TIERS = {  # share of the cases
    "tree_nothing": 0.25,
    "tree_few": 0.2,  # one to three effects in all
    "tree_many": 0.33,  # none to three for each joint
    "tree_wrong_parameters": 0.07,
    "tree_outside": 0.15,
}
SHOWS, SHOWS_OUTSIDE = 4.0, 6.0  # least difference of some signal, over the noise
KNOWN_SHARE = 0.15  # of robots whose owner knows friction of a joint beside what the file says
ROUNDS = 3  # of taking out what does not show


@dataclass(frozen=True, eq=False)
class Case:
    """A robot, what is hidden in it, and its recordings.

    Attributes:
        tier: A key of `TREE_TIERS`.
        robot: As its owner believes it to be.
        known: Effects that the owner knows, by "site/kind".
        uncertainty: Standard deviations that the owner gives, relative (of a centre of mass [m]), by parameter.
        parameters: True values of the uncertain parameters.
        hidden: What is missing from the owner's model.
        settings: How the runs are logged.
        visible: Recordings that a diagnosis may read.
        unseen: Recordings to judge the completed model by.
        excitations: Of the visible recordings, then of the unseen ones.
        contrast: Difference that each hidden effect makes, over the noise, by effect and signal.
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

    def noise(self) -> dict[str, float]:
        """Standard deviation of what the log adds to each position: noise, and resolution / sqrt(12)."""
        return noise_of(self.robot, self.settings)


def noise_of(robot: Robot, settings: LogSettings) -> dict[str, float]:
    """Standard deviation of noise and resolution by joint [rad or m]."""
    each = zip(robot.joints, settings.noise, settings.resolution, strict=True)
    return {name: float(np.hypot(noise, max(step, 1e-8) / np.sqrt(12.0))) for name, noise, step in each}


def draw_tree_case(
    rng: np.random.Generator,
    tier: str,
    lengths: tuple[float, float],
    known: frozenset[str],
    joints: int | None = None,
) -> Case:
    """A case of a tier.

    Args:
        rng: Random numbers.
        tier: A key of `TREE_TIERS`.
        lengths: Shortest and longest time that a recording lasts [s].
        known: Kinds of effects that those know who are to find them.
        joints: Number of joints; None for a random one.
    """
    while True:
        case = realise(rng, tier, lengths, known, joints)
        if case is not None:
            return case


def realise(
    rng: np.random.Generator, tier: str, lengths: tuple[float, float], known: frozenset[str], joints: int | None
) -> Case | None:
    """A robot with its recordings; None where it leaves its limits or where too little of the physics shows."""
    robot = draw_robot(rng, joints)
    settings = draw_log_settings(robot, rng)
    control = control_of(robot, Tuning(2.0 * np.pi * rng.uniform(1.2, 2.5), rng.uniform(0.6, 0.9)))
    shown = (
        "fourier",
        *(VISIBLE[i] for i in np.sort(rng.permutation(np.arange(1, len(VISIBLE)))[: rng.integers(3, 5)])),
    )
    scenarios = [draw_scenario(robot, settings, name, rng, lengths) for name in (*shown, *UNSEEN)]
    visible, later = scenarios[: len(shown)], scenarios[len(shown) :]
    lab = _Laboratory(robot, control, settings)
    nominal = lab.runs(Hidden(), visible)
    if nominal is None:
        return None
    does = doing(robot, nominal)
    lab = replace(lab, robot=_limited(robot, does, rng))
    draw = Draw(lab.robot, does, rng)
    uncertainty, parameters = _wrong(tier, lab.robot, rng)
    lab = replace(lab, parameters=parameters)
    hidden = _hidden(tier, draw, known)
    owned = _known(hidden, draw)
    found = lab.showing(hidden, owned, visible)
    if found is None:
        return None
    seen, hidden, contrast = found
    if tier in ("tree_few", "tree_many") and not hidden.effects:
        return None
    unseen = lab.runs(hidden.beside(owned), later)
    if unseen is None:
        return None
    excitations = (*shown, *UNSEEN)
    return Case(tier, lab.robot, owned, uncertainty, parameters, hidden, settings, seen, unseen, excitations, contrast)


@dataclass(frozen=True, eq=False)
class _Laboratory:
    """Records a robot with whatever is hidden in it.

    Attributes:
        robot: As its owner believes it to be.
        control: Its controller.
        settings: Of the log.
        parameters: True values of wrong parameters.
    """

    robot: Robot
    control: Control
    settings: LogSettings
    parameters: Mapping[str, float] = field(default_factory=dict)

    def runs(self, hidden: Hidden, scenarios: list[Scenario]) -> tuple[Run, ...] | None:
        """The runs of the robot; None where it leaves its limits."""
        truth = real(corrected(self.robot.links, self.parameters), self.robot.drives, GRAVITY, hidden)
        found = []
        for scenario in scenarios:
            run = record(self.robot, truth, self.control, scenario, self.settings)
            if run is None:
                return None
            found.append(run)
        return tuple(found)

    def showing(
        self, hidden: Hidden, owned: Mapping[str, Mapping[str, float]], scenarios: list[Scenario]
    ) -> tuple[tuple[Run, ...], Hidden, dict[str, dict[str, float]]] | None:
        """Recordings, what is hidden in them and shows, and how much; effects that do not show are taken out.

        None where the robot leaves its limits, where physics outside the vocabulary does not show, or where something
        else stops showing each time that something is taken out.
        """
        for _ in range(ROUNDS):
            seen = self.runs(hidden.beside(owned), scenarios)
            if seen is None:
                return None
            contrast = {}
            for name in (*hidden.effects, *([] if hidden.unmodelled is None else [hidden.unmodelled.name])):
                others = self.runs(hidden.without(name).beside(owned), scenarios)
                if others is None:
                    return None
                contrast[name] = self._contrast(seen, others)
            faint = [name for name in hidden.effects if max(contrast[name].values()) < SHOWS]
            if hidden.unmodelled is not None and max(contrast[hidden.unmodelled.name].values()) < SHOWS_OUTSIDE:
                return None
            if not faint:
                return seen, hidden, contrast
            for name in faint:
                hidden = hidden.without(name)
        return None

    def _contrast(self, runs: tuple[Run, ...], others: tuple[Run, ...]) -> dict[str, float]:
        """Root mean square difference of the same runs of two robots, by signal, over the signal's noise."""
        noise, found = noise_of(self.robot, self.settings), {}
        for name in runs[0].columns:
            if name == "t" or name.endswith(("_dot", "_measured")):
                continue
            ours = np.concatenate([run.columns[name] for run in runs])
            theirs = np.concatenate([run.columns[name] for run in others])
            # the noise of a command is what a parabola through three rows leaves over
            scale = noise[name] if name in noise else float(np.std(np.diff(theirs, 2)) / np.sqrt(6.0))
            size = float(np.sqrt(np.mean((ours - theirs) ** 2)))
            found[name] = size / scale if scale > 0.0 else 0.0
        return found


def _limited(robot: Robot, does: Doing, rng: np.random.Generator) -> Robot:
    """The robot with limits of its position drives, somewhat above what the nominal motion takes."""
    drives = [
        replace(drive, limit=float(f"{rng.uniform(1.5, 3.0) * peak:.3g}")) if drive.kind == "position" else drive
        for drive, peak in zip(robot.drives, does.peak, strict=True)
    ]
    return replace(robot, drives=tuple(drives))


def _hidden(tier: str, draw: Draw, known: frozenset[str]) -> Hidden:
    rng = draw.rng
    count = {"tree_nothing": 0, "tree_few": int(rng.integers(1, 4)), "tree_wrong_parameters": int(rng.integers(0, 3))}
    count |= {"tree_outside": int(rng.integers(0, 3))}
    names = choose(draw.robot, count.get(tier), known, rng)
    if tier == "tree_wrong_parameters":  # nothing that a wrong mass looks like
        names = tuple(name for name in names if not families(name) & {"mass", "scale", "constant"})
    unmodelled = None
    if tier == "tree_outside":
        unmodelled = draw_unmodelled(str(rng.choice(unmodelled_of(draw.robot))), draw)
        names = tuple(name for name in names if draw.joint(name.partition("/")[0]) != unmodelled.joint)
    effects = {name: draw_values(name, draw) for name in names}
    return Hidden(effects, {name: draw_details(name, values, draw) for name, values in effects.items()}, unmodelled)


def _known(hidden: Hidden, draw: Draw) -> dict[str, dict[str, float]]:
    """Viscous friction that the owner knows, in some cases, at a joint where no damping is hidden."""
    if draw.rng.random() >= KNOWN_SHARE or hidden.unmodelled is not None:
        return {}
    name = f"{draw.rng.choice(draw.robot.joints)}/viscous"
    j = draw.joint(name.partition("/")[0])
    if any(families(other) & families(name) for other in hidden.effects if draw.joint(other.partition("/")[0]) == j):
        return {}
    return {name: draw_values(name, draw)}


def _wrong(tier: str, robot: Robot, rng: np.random.Generator) -> tuple[dict[str, float], dict[str, float]]:
    """Standard deviations that the owner gives for some numbers of links, and the true numbers."""
    uncertainty, true = {}, {}
    if tier != "tree_wrong_parameters":
        return uncertainty, true
    for i in np.sort(rng.permutation(len(robot.links))[: rng.integers(1, 4)]):
        link = robot.links[i]
        error = float(rng.choice([-1.0, 1.0])) * rng.uniform(0.04, 0.15)
        deviation = round(float(max(0.05, abs(error) * rng.uniform(0.7, 1.5))), 2)
        what = str(rng.choice(["mass", "com", "inertia"]))
        uncertainty[f"{link.body}.{what}"] = deviation if what != "com" else round(deviation * link.length, 4)
        if what == "com":
            for axis, value in zip("xyz", link.com - link.origin, strict=True):
                true[f"{link.body}.com_{axis}"] = float(f"{value + rng.normal(0.0, 0.6) * deviation * link.length:.5g}")
        else:
            true[f"{link.body}.{what}"] = float(f"{(link.mass if what == 'mass' else 1.0) * (1.0 + error):.5g}")
    return uncertainty, true
