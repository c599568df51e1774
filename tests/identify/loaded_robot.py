"""Releases of a robot with known loads on its body, with the friction of the paper; for tests of the paper's objective.

Eight loads, several trials of each: held at a pitch, released at rest under the regulator of the unloaded robot.
"""

from dataclasses import dataclass

import numpy as np
from emulated_robot import nominal_model

from wipx.control.lqr import Lqr
from wipx.core.load import Load
from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.effects.catalogue import effect_of
from wipx.identify.closed_loop import ClosedLoopProblem
from wipx.identify.objectives import FitData, PaperTrajectories
from wipx.identify.parameter_space import parameter_space, scales_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

RATE, DURATION = 650.0, 1.25  # [Hz, s] paper: controller of 600 to 700 Hz, trajectories of 1.2 s
NOISE = np.array([5e-4, 1e-3])  # [m, rad]
PLACEMENT = 2e-3  # [rad] scatter of the pitch from which a trial is released
NOMINAL = nominal_model("wip")
FEEDBACK = Lqr().feedback(NOMINAL)
SIMULATOR = AnalyticSimulator(step=2e-3, threads=1)  # one step per row of the controller
FRICTION = ("translation/lagged_stribeck", "pitch/lagged_stribeck")
PAPER = {"F_s": 0.15, "F_c": 0.12, "v_s": 0.2, "sigma": 0.02, "epsilon": 0.01, "alpha": 0.7}  # paper, Fig. 3
TUNED = {"F_s": (0.0, 0.5), "F_c": (0.0, 0.5), "v_s": (0.03, 1.0), "sigma": (0.0, 0.2), "epsilon": (0.0, 0.03)}
FORCE = 10.0  # [N] of the wheels per N m of the pivot: what the paper's numbers amount to on this robot
LOADS = tuple(Load(mass, height, side) for mass in (0.8, 1.6) for height in (0.25, 0.45) for side in (-0.1, 0.05))
OBJECTIVE = PaperTrajectories(classes=r"(.+)_\d", at_rest=True)


@dataclass(frozen=True)
class Releases:
    """What was recorded.

    Attributes:
        recordings: Trials, class by class.
        loads: On the body in each of them.
    """

    recordings: tuple[Recording, ...]
    loads: tuple[Load, ...]

    def problem(self, *, friction: tuple[str, ...] = FRICTION, tuned: bool = False) -> ClosedLoopProblem:
        """The paper's objective over all parameters of the friction of some joints.

        Args:
            friction: Which.
            tuned: Whether the search intervals are those that `TUNED` gives; the paper's were tuned by hand.
        """
        neutral = NOMINAL.with_effects({name: effect_of(name, NOMINAL.plant).neutral for name in friction})
        scales = scales_of(neutral, self.recordings)
        bounds = {
            f"{name}.{symbol}": (low * _unit(name, symbol), high * _unit(name, symbol))
            for name in friction
            for symbol, (low, high) in TUNED.items()
        }
        space = parameter_space(neutral, friction, {}, {}, bounds if tuned else {}, scales)
        speeds = tuple(scales[joint].velocity for joint in NOMINAL.plant.joints)
        feedback = (FEEDBACK, RATE)
        data = FitData(self.recordings, NOMINAL, SIMULATOR, NOISE, speeds, feedback, self.loads)
        return OBJECTIVE.problem(data, space)


def _unit(effect: str, symbol: str) -> float:
    """What a force of the paper amounts to at a joint of this robot."""
    return FORCE if effect.startswith("translation") and symbol in ("F_s", "F_c", "sigma") else 1.0


def paper_robot(rng: np.random.Generator | None = None) -> Model:
    """The unloaded robot with the paper's friction; with a generator each number is up to twice or half as large."""
    effects = {}
    for name in FRICTION:
        values = {symbol: value * _unit(name, symbol) for symbol, value in PAPER.items()}
        if rng is not None:
            values = {s: v * 2.0 ** rng.uniform(-1.0, 1.0) for s, v in values.items()} | {
                "alpha": rng.uniform(0.3, 1.0)
            }
        effects[name] = values
    return NOMINAL.with_effects(effects)


def release(
    truth: Model,
    rng: np.random.Generator,
    trials: int = 5,
    *,
    loads: tuple[Load, ...] = LOADS,
    noisy: bool = True,
) -> Releases:
    """Release the robot with every load, upright but for the scatter of its placement."""
    recordings = []
    for number, load in enumerate(loads):
        inputs = Inputs.regular(DURATION, RATE, 1, trials)
        initial = np.zeros((4, 1, trials))
        initial[1] = PLACEMENT * rng.normal(size=trials)
        rows = len(inputs.t) - 1
        noise = NOISE[:, None, None] * rng.normal(size=(rows, 2, 1, trials)) * noisy
        run = SIMULATOR.close_loop(ModelBatch(load.on(truth)), inputs, initial, FEEDBACK, np.zeros((rows, 4, trials)))
        shown = run.coordinates[:-1] + noise
        recordings += [
            Recording(
                f"load{number}_{r}.csv",
                {
                    "t": inputs.t[:-1, r],
                    "x": shown[:, 0, 0, r],
                    "theta": shown[:, 1, 0, r],
                    "u": run.commands[:, 0, 0, r],
                },
            )
            for r in range(trials)
        ]
    return Releases(tuple(recordings), tuple(load for load in loads for _ in range(trials)))
