"""`task=balance`: a robot from a model file balances with a payload in its hand that it does not know.

The regulator of the whole body about the nominal balance is compared with the same one about the balance of the loaded
robot, whose payload is estimated from the first second of motion.
"""

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from wipx.control.hand_payload import HandPayload
from wipx.control.posture_balance import balance
from wipx.control.whole_body import WholeBodyLoop, WholeBodyLqr
from wipx.core.balance_result import BalanceTrial
from wipx.core.errors import InputError, check_positive
from wipx.report.numbers import significant
from wipx.sim.simulator import Simulator
from wipx.tasks.files.results import write_csv, write_json, written_together
from wipx.tasks.shared.emulated_tree import EmulatedTree, emulated_tree
from wipx.tasks.shared.job import Job

CALM = 1.0  # [s] at the end of balancing and of the way, in which the robot is judged


@dataclass(frozen=True)
class BalanceTask:
    """Release the loaded robot, let it balance, then drive a way.

    Attributes:
        robot: Name of an example robot.
        payload: True mass in its hand [kg].
        body: Body that carries the payload.
        place: Of the payload in the body's frame [m].
        window: Time from which the payload is estimated [s].
        way: That the first joint, a slide, is driven [m].
        settle: Time before the way begins [s].
        drive: That it takes [s].
        rest: After it [s].
        near: Distance within which the robot has to stay [m].
        fallen: Deviation of any hinge from the balance at which a trial ends [rad].
        rail: Distance at which a trial ends [m].
        controller: Settings of `WholeBodyLqr`.
    """

    robot: str = "humanoid"
    payload: float = 1.0
    body: str = "right_forearm"
    place: tuple[float, ...] = (0.0, 0.0, -0.27)
    window: float = 1.0
    way: float = 1.0
    settle: float = 6.0
    drive: float = 4.0
    rest: float = 4.0
    near: float = 0.05
    fallen: float = 0.5
    rail: float = 5.0
    controller: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_positive(settle=self.settle, drive=self.drive, rest=self.rest, near=self.near, fallen=self.fallen)
        check_positive(rail=self.rail)
        if self.payload < 0.0:
            raise InputError(f"task.payload is {self.payload:g} kg, expected zero or more")
        if min(self.settle, self.rest) < CALM or self.settle < self.window:
            raise InputError(f"task.settle and task.rest: expected at least {CALM:g} s, and settle at least the window")

    def run(self, job: Job) -> None:
        """Run both controllers, judge, write course, picture and figures."""
        from wipx.report.balance_figure import draw_balance

        robot = emulated_tree(self.robot)
        settings: WholeBodyLqr = job.build(self.controller, "task.controller")
        estimator = HandPayload(self.body, self.place, self.window)
        loaded = balance(estimator.loaded(robot.nominal, self.payload), robot.posture).positions
        trials = []
        for name, asked in (("nominal balance", None), ("estimated balance", estimator)):
            loop = WholeBodyLoop(settings, robot.nominal, robot.posture, asked)
            rng = np.random.default_rng(job.seed)
            trials.append(self._trial(name, robot, estimator, loop, job.part("sim"), rng, settings.rate, loaded))
        with written_together(job.out) as folder:
            for trial in trials:
                write_csv(folder / f"{trial.name.replace(' ', '_')}.csv", trial.columns)
            draw_balance(trials, self.payload, folder / "balance.png")
            write_json(folder / "metrics.json", {"payload": self.payload, "trials": [_plain(t) for t in trials]})
        for trial in trials:
            print(_sentence(trial))
        print(f"payload {self.payload:g} kg; picture: {job.out / 'balance.png'}")

    def _trial(
        self,
        name: str,
        robot: EmulatedTree,
        hand: HandPayload,
        loop: WholeBodyLoop,
        simulator: Simulator,
        rng: np.random.Generator,
        rate: float,
        loaded: np.ndarray,
    ) -> BalanceTrial:
        """One controller; the robot is released at rest in the nominal balance."""
        t = np.arange(round((self.settle + self.drive + self.rest) * rate) + 1) / rate
        reference = np.zeros((len(t), 2 * len(loaded)))
        reference[:, 0], reference[:, len(loaded)] = self._way(t)
        driven = hand.loaded(robot.emulated, self.payload)
        columns = robot.driven(driven, loop, reference, simulator, rng, self._stopped(loop.nominal.positions))
        joint = robot.nominal.plant.joints[0]
        off = columns[joint] - reference[: len(columns[joint]), 0]
        begun, done = (round(end * rate) for end in (self.settle, t[-1]))
        calm = round(CALM * rate)
        fell = float(columns["t"][-1]) if len(off) < done else None
        free = [i for i, j in enumerate(robot.nominal.plant.joints) if j not in robot.nominal.plant.actuated]
        return BalanceTrial(
            name,
            {**columns, f"{joint}_ref": reference[: len(off), 0]},
            robot.nominal.plant.joints[free[0]],
            float(loaded[free[0]]),
            float(loop.target.positions[free[0]]),
            None if loop.found is None else loop.found.mass,
            None if loop.found is None else loop.found.deviation,
            fell,
            _largest(off[begun - calm : begun]),
            _largest(off[done - calm : done]),
            self.near,
        )

    def _way(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position and speed of the reference: the way with the least jerk."""
        s = np.clip((t - self.settle) / self.drive, 0.0, 1.0)
        return self.way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2), self.way / self.drive * 30.0 * (s * (1.0 - s)) ** 2

    def _stopped(self, balanced: np.ndarray):
        def stopped(positions: np.ndarray) -> bool:
            off = np.abs(positions - balanced)
            return not (off[0] < self.rail and off[1:].max() < self.fallen)

        return stopped


def _largest(off: np.ndarray) -> float:
    return float(np.abs(off).max()) if len(off) else float("nan")


def _plain(trial: BalanceTrial) -> dict[str, object]:
    plain = {key: value for key, value in asdict(trial).items() if key != "columns"}
    return {**plain, "balances": trial.balances, "tracks": trial.tracks}


def _sentence(trial: BalanceTrial) -> str:
    """What came of a trial, in one line."""
    if trial.fell is not None:
        return f"{trial.name}: fell or left the rail after {trial.fell:.2f} s"
    words = [
        f"{'balances' if trial.balances else 'does not balance in place'} (within {significant(trial.standing)} m)",
        f"{'tracks' if trial.tracks else 'does not track'} (ends within {significant(trial.arriving)} m)",
        f"{trial.joint} aimed at {trial.aimed:+.4f} rad, true balance {trial.true:+.4f} rad",
    ]
    if trial.mass is not None and trial.deviation is not None:
        words.append(f"payload estimated as {trial.mass:.3f} kg +- {trial.deviation:.3f} kg")
    return f"{trial.name}: " + "; ".join(words)
