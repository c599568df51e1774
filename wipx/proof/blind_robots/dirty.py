"""Dirty robots: dominant effects of the vocabulary, and what no law describes, as much of it as real machines have.

    python -m wipx.proof.blind_robots.dirty --cases 20 --seed 7 --out runs/dirty_dev

draws robots with their answers in the open, to work with: for each case the folders `visible` and `unseen` and
`answer.json`. The benchmark `+experiment=dirty` draws others, and seals them.

The dirt is scaled until it makes a drawn share, 10 to 35 %, of the dominant effects' squared error over 0.5 s. Of a
robot with dirt only it is the share of the error that drawn, typical effects would make.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wipx.core.plant import PLANTS
from wipx.proof.blind_robots.blemishes import Blemishes, blemished, draw_blemishes
from wipx.proof.blind_robots.cases import DIRTY_TIERS, Case, noise_of, stratified
from wipx.proof.blind_robots.dirt import LARGEST, Dirt, draw_dirt, draw_waves
from wipx.proof.blind_robots.foresight import foretell, motion, shown
from wipx.proof.blind_robots.logging import Course, Run, drive, logged
from wipx.proof.blind_robots.physics import MOVING, Hidden, physics
from wipx.proof.blind_robots.robots import Robot, draw_robot, log_uniform
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
from wipx.proof.blind_robots.write import case_files, write_files

PLANT_SHARES = {"wip": 0.3, "cartpole": 0.2, "pendulum": 0.2, "linear_axis": 0.2, "double_pendulum": 0.1}
SHARE = (0.10, 0.35)  # of the dominant effects' squared error
SMALLEST = 0.2  # scale of the dirt; the largest is that of `dirt`
NEAR = 1.15  # ratio to the drawn share from which a scale is good enough
TRIALS = 6  # of scales
OWN = 0.07  # least squared error that leaving out one dominant effect makes, of what leaving out all makes
CANCEL = 2.0  # most such error: effects that all but undo each other have no error to measure dirt by
OVER_DIRT = 0.7  # least such error, of what the dirt makes
SHOWS = 3.0  # least difference that leaving it out makes in predictions, over the noise
ATTEMPTS = 2  # robots for one choice of effects, before another choice
DRAWS = 4  # of sizes, until every dominant effect matters
MEASURED = 3  # runs on which prediction errors are measured
SINGLE = 0.15  # of sets that are one short run
OPEN = 0.5  # of robots that stand without a controller, how many run without one
STANDING = ("linear_axis", "double_pendulum")
KNOWN = 0.8  # of robots whose owner knows a friction, where none is hidden


@dataclass(frozen=True)
class Machine:
    """A robot with its runs, before its physics is settled.

    Attributes:
        robot: As its owner believes it to be; without gains where the loop is open.
        settings: Of the log.
        shown: Runs that a diagnosis may read.
        later: Runs to judge by.
        known: Effects that the owner knows, by "site/kind".
        hidden: Effects that the owner does not know.
        dirt: At a scale of 1.
    """

    robot: Robot
    settings: LogSettings
    shown: tuple[Scenario, ...]
    later: tuple[Scenario, ...]
    known: Mapping[str, Mapping[str, float]]
    hidden: Hidden
    dirt: Dirt

    def record(self, names: Sequence[str], scale: float) -> np.ndarray:
        """The robot with some of the hidden effects, and dirt of that scale."""
        effects = {**self.known, **{name: self.hidden.effects[name] for name in names}}
        dirt = self.dirt.fields(scale) if scale > 0.0 else {}
        parameters = self.dirt.parameters(self.robot.parameters, scale)
        return physics(self.robot.kind, parameters, Hidden(effects, self.hidden.details, dirt=dirt))

    def courses(self, truth: np.ndarray, scenarios: tuple[Scenario, ...]) -> tuple[Course, ...] | None:
        """What the robot does; None where it falls."""
        found = []
        for scenario in scenarios:
            course = drive(self.robot, truth, scenario, self.settings)
            if course.fell:
                return None
            found.append(course)
        return tuple(found)


@dataclass(frozen=True)
class Errors:
    """Squared errors of 0.5 s predictions, in units of the squared motion, summed over joints.

    Attributes:
        dirt: Of the robot with its dominant effects and without dirt.
        dominant: By which predictions with and without all dominant effects differ.
        own: By which they differ with and without one of them, by name.
        contrast: Root mean square of that difference over the noise, by effect and signal.
    """

    dirt: float
    dominant: float
    own: Mapping[str, float]
    contrast: Mapping[str, Mapping[str, float]]

    @property
    def share(self) -> float:
        """Error of the dirt over that of the dominant effects."""
        return self.dirt / max(self.dominant, 1e-300)


def draw_dirty(rng: np.random.Generator, tier: str, lengths: tuple[float, float] = LENGTHS) -> Case:
    """A case of a tier of `DIRTY_TIERS`; each of its recordings lasts a time between the two `lengths` [s]."""
    plant = str(rng.choice(list(PLANT_SHARES), p=list(PLANT_SHARES.values())))
    count = int(rng.integers(1, 4))
    while True:
        names = _dominant(plant, count, rng)
        for _ in range(ATTEMPTS):
            case = realise_dirty(tier, plant, names, rng, lengths)
            if case is not None:
                return case


def _dominant(plant: str, count: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Effects of different families."""
    taken: set[str] = set()
    names: list[str] = []
    for name in rng.permutation(effect_names(plant)).tolist():
        if len(names) < count and not families(name) & taken:
            names.append(name)
            taken |= families(name)
    return tuple(names)


def realise_dirty(
    tier: str, plant: str, names: tuple[str, ...], rng: np.random.Generator, lengths: tuple[float, float] = LENGTHS
) -> Case | None:
    """A robot with those dominant effects and dirt; None where it falls or where the shares cannot be had.

    Args:
        tier: Key of `DIRTY_TIERS`; with `dirt_only` the effects give the dirt its size, and are left out.
        plant: Kind of plant.
        names: Dominant effects, "site/kind".
        rng: Random numbers.
        lengths: Shortest and longest time that a recording lasts [s].
    """
    machine = _machine(tier, plant, names, rng, lengths)
    if machine is None:
        return None
    there = names if tier == "dirty" else ()
    found = _scaled(machine, there, float(rng.uniform(*SHARE)))
    if found is None:
        return None
    scale, errors = found
    truth = machine.record(there, scale)
    blemishes, own = draw_blemishes(rng), np.random.default_rng(rng.integers(2**63))
    logs = []
    for scenarios in (machine.shown, machine.later):
        courses = machine.courses(truth, scenarios)
        if courses is None:
            return None
        logs.append(tuple(_log(machine, *run, blemishes, own) for run in zip(courses, scenarios, strict=True)))
    effects = {name: machine.hidden.effects[name] for name in there}
    return Case(
        tier=tier,
        robot=machine.robot,
        known=machine.known,
        uncertainty={},
        parameters=machine.dirt.parameters(machine.robot.parameters, scale),
        hidden=Hidden(effects, machine.hidden.details, dirt=machine.dirt.fields(scale)),
        settings=machine.settings,
        visible=logs[0],
        unseen=logs[1],
        excitations=tuple(scenario.excitation for scenario in (*machine.shown, *machine.later)),
        contrast=errors.contrast if there else {},
        dirt=account(machine, there, blemishes, scale, errors),
    )


def _log(machine: Machine, course: Course, scenario: Scenario, blemishes: Blemishes, rng: np.random.Generator) -> Run:
    run = logged(machine.robot, course, scenario, machine.settings)
    return blemished(run, machine.robot.kind, blemishes, rng)


def account(
    machine: Machine, there: tuple[str, ...], blemishes: Blemishes, scale: float, errors: Errors
) -> dict[str, Any]:
    """What a robot's dirt is, in what JSON can hold.

    `own_shares` is what leaving out one dominant effect makes of what leaving out all makes; of a robot with dirt only
    `imagined` has the same of the effects by which the dirt was measured.
    """
    nominal, true = machine.robot.parameters, machine.dirt.parameters(machine.robot.parameters, scale)
    faults = [
        *machine.dirt.names,
        *blemishes.names,
        *(["coarse encoder"] if max(machine.settings.resolution) > 2e-4 else []),
        *(["open loop"] if not machine.robot.gains.any() else []),
        *(["single run"] if len(machine.shown) == 1 else []),
    ]
    return {
        "names": faults,
        "share": errors.share,
        ("own_shares" if there else "imagined"): dict(errors.own),
        "scale": scale,
        "wrong_parameters": {name: value for name, value in true.items() if value != nominal[name]},
        "fields": {
            name: {str(joint): float(size) for joint, size in value.items()}
            if isinstance(value, Mapping)
            else float(value)
            for name, value in machine.dirt.fields(scale).items()
        },
    }


def _machine(
    tier: str, plant: str, names: tuple[str, ...], rng: np.random.Generator, lengths: tuple[float, float]
) -> Machine | None:
    """A robot, its runs, and sizes of its effects and of its dirt; None where even the nominal one falls."""
    rows = log_uniform(rng, 40.0, 1000.0)  # per second
    robot = draw_robot(plant, rng)
    robot = replace(robot, rate=float(np.round(max(rows, log_uniform(rng, 200.0, 1000.0)))))
    settings = _settings(plant, robot.rate / rows, rng)
    excitations = _visible(rng)
    scenarios = []
    for name in (*excitations, *UNSEEN):
        scenario = draw_scenario(robot, settings, name, rng, lengths)
        scenarios.append(replace(scenario, waves=draw_waves(scenario, rng)))
    nominal = physics(plant, robot.parameters, Hidden())
    if plant in STANDING and rng.random() < OPEN:
        opened = [_opened(robot, nominal, scenario, settings) for scenario in scenarios]
        scenarios = [scenario for scenario in opened if scenario is not None]
        if len(scenarios) < len(opened):
            return None
        robot = replace(robot, gains=np.zeros_like(robot.gains))
    shown, later = tuple(scenarios[: len(excitations)]), tuple(scenarios[len(excitations) :])
    machine = Machine(robot, settings, shown, later, {}, Hidden(), Dirt())
    courses = machine.courses(nominal, shown)
    if courses is None:
        return None
    runs = tuple(logged(robot, *run, settings) for run in zip(courses, shown, strict=True))
    draw = Draw(robot, consequences(robot, runs), rng, weak=False)
    machine = _balanced(replace(machine, known=_known(plant, names, draw)), names, draw)
    if machine is None:
        return None
    there = machine.hidden.effects if tier == "dirty" else {}
    return replace(machine, dirt=draw_dirt({**machine.known, **there}, names, draw))


def _balanced(machine: Machine, names: tuple[str, ...], draw: Draw) -> Machine | None:
    """The machine with sizes of effects of which each matters on a run; None where none are found."""
    effects = {name: draw_values(name, draw) for name in names}
    for _ in range(DRAWS):
        details = {name: draw_details(name, values, draw) for name, values in effects.items()}
        machine = replace(machine, hidden=Hidden(effects, details))
        errors = prediction_errors(replace(machine, shown=machine.shown[-1:]), names, 0.0)
        if errors is None:
            again = names
        elif _all_matter(errors):
            return machine
        else:
            order = sorted(names, key=errors.own.__getitem__)
            again = (order[0], order[-1])
        effects = {**effects, **{name: draw_values(name, draw) for name in again}}
    return None


def _settings(plant: str, every: float, rng: np.random.Generator) -> LogSettings:
    """An ordinary log of any speed, with coarse encoders and measured rates more often than a good one has."""
    settings = draw_log_settings(plant, rng, poor=False)
    resolution = settings.resolution
    if rng.random() < 0.4:
        angle, way = rng.uniform(3e-4, 2e-3), rng.choice([2e-4, 5e-4, 1e-3])
        resolution = (float(angle if plant == "double_pendulum" else way), float(angle))
    rates = MOVING[plant] if rng.random() < 0.35 else settings.rates
    return replace(settings, every=max(1, round(every)), resolution=resolution, rates=rates)


def _visible(rng: np.random.Generator) -> tuple[str, ...]:
    """One run, or two to five."""
    moved = [name for name in VISIBLE if name not in ("release", "slow")]
    if rng.random() < SINGLE:
        return (str(rng.choice(moved)),)
    first = str(rng.choice(moved))
    others = rng.permutation([name for name in VISIBLE if name != first])[: rng.integers(1, 5)].tolist()
    return tuple(name for name in VISIBLE if name in (first, *others))


def _opened(robot: Robot, nominal: np.ndarray, scenario: Scenario, settings: LogSettings) -> Scenario | None:
    """The same run without a controller: the commands are those that the owner's model asks for; None if it falls."""
    quiet = replace(scenario, noise=np.zeros_like(scenario.noise), rate_noise=np.zeros_like(scenario.rate_noise))
    course = drive(robot, nominal, quiet, replace(settings, resolution=(0.0, 0.0)))
    return None if course.fell else replace(scenario, extra=course.commands)


def _known(plant: str, names: tuple[str, ...], draw: Draw) -> dict[str, dict[str, float]]:
    """Friction that the owner knows, at a joint where none is hidden."""
    if draw.rng.random() >= KNOWN:
        return {}
    joint, law = str(draw.rng.choice(PLANTS[plant].joints)), str(draw.rng.choice(["coulomb", "coulomb", "viscous"]))
    about = {f"{joint}: dry friction", f"{joint}: damping"}
    if any(families(name) & about for name in names):
        return {}
    return {f"{joint}/{law}": draw_values(f"{joint}/{law}", draw)}


def _scaled(machine: Machine, there: tuple[str, ...], share: float) -> tuple[float, Errors] | None:
    """The scale at which dirt makes a share of the error; None where there is none.

    The error grows about as the square of the scale, so a few steps do.
    """
    scale = 1.0
    low, high = SMALLEST, LARGEST
    for _ in range(TRIALS):
        errors = prediction_errors(machine, there, scale)
        if errors is None or errors.dominant <= 0.0 or errors.dirt <= 0.0:
            return None
        if there:
            share = min(share, min(errors.own.values()) / OVER_DIRT)
        if 1.0 / NEAR < errors.share / share < NEAR and SHARE[0] <= errors.share <= SHARE[1]:
            return (scale, errors) if _all_matter(errors) else None
        if not _all_matter(errors):
            return None
        if (scale == high and errors.share < share) or (scale == low and errors.share > share):
            return None
        scale = float(np.clip(scale * np.sqrt(share / errors.share), low, high))
    return None


def _all_matter(errors: Errors) -> bool:
    """Whether each dominant effect makes a part of the error, undoes no other, and shows."""
    return all(OWN <= share <= CANCEL for share in errors.own.values()) and all(
        max(signals.values()) >= SHOWS for signals in errors.contrast.values()
    )


def prediction_errors(machine: Machine, there: tuple[str, ...], scale: float) -> Errors | None:
    """Errors of predictions with parts of the physics, on visible runs; None where the robot falls.

    Args:
        machine: The robot.
        there: Hidden effects that it really has; the others are only imagined.
        scale: Of its dirt.
    """
    kind, names = machine.robot.kind, tuple(machine.hidden.effects)
    truth = machine.record(there, scale)
    measured = machine.shown[-MEASURED:]
    courses = machine.courses(truth, measured)
    if courses is None:
        return None
    runs = tuple(zip(courses, measured, strict=True))
    way = np.mean([motion(truth, *run) for run in runs], axis=0)
    joints = list(MOVING[kind])

    def predicted(some: tuple[str, ...]):
        model = machine.record(some, 0.0)
        return [foretell(model, truth, *run) for run in runs]

    def squares(ones, others) -> np.ndarray:
        return np.mean([one.difference(other) for one, other in zip(ones, others, strict=True)], axis=0)[joints]

    clean = predicted(there)
    whole = clean if there == names else predicted(names)
    bare = predicted(())
    real = [shown(truth, *run) for run in runs]
    size = np.maximum(way[joints], 1e-12)
    noise = np.array(list(noise_of(kind, machine.settings).values()))
    without = {name: squares(whole, predicted(tuple(other for other in names if other != name))) for name in names}
    dominant = float(np.sum(squares(whole, bare) / size))
    columns = PLANTS[kind].coordinates
    return Errors(
        float(np.sum(squares(clean, real) / size)),
        dominant,
        {name: float(np.sum(square / size)) / max(dominant, 1e-300) for name, square in without.items()},
        {name: dict(zip(columns, (np.sqrt(square) / noise).tolist(), strict=True)) for name, square in without.items()},
    )


def write_open_cases(folder: Path, cases: int, seed: int, lengths: tuple[float, float]) -> None:
    """Draw cases and write them with their answers in the open."""
    tiers = stratified(cases, 0, tuple(DIRTY_TIERS), np.random.default_rng(seed))
    for number, tier in enumerate(tiers, start=1):
        place = folder / f"case{number:04d}"
        files = case_files(draw_dirty(np.random.default_rng([seed, number]), tier, lengths))
        write_files(place / "visible", files.visible)
        write_files(place / "unseen", files.unseen)
        write_files(place, {"answer.json": json.dumps(files.truth, indent=2)})
        effects = ", ".join(effect["name"] for effect in files.truth["effects"]) or "nothing"
        print(f"{place}: {files.truth['plant']}: {effects}; {files.truth['dirt']['names']}", flush=True)


def main() -> None:
    """Draw cases as the command line says."""
    parser = argparse.ArgumentParser(description="Draw dirty robots with their answers in the open.")
    parser.add_argument("--cases", type=int, default=20, help="how many")
    parser.add_argument("--seed", type=int, required=True, help="of the draws")
    parser.add_argument("--out", type=Path, required=True, help="folder that takes one folder for each case")
    parser.add_argument("--lengths", type=float, nargs=2, default=LENGTHS, help="of a recording [s]")
    given = parser.parse_args()
    write_open_cases(given.out, given.cases, given.seed, tuple(given.lengths))


if __name__ == "__main__":
    main()
