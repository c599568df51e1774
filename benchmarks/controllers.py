"""Controllers: time of one step in a control loop, state estimate included, beside what a real-time loop may take."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import yaml
from estimators import LENGTH, PRESETS, preset, untrained
from kernel import BODY, PAPER, RATE
from timing import print_table, processor_time

from wipx.config import build
from wipx.control.controller import Controller
from wipx.control.loop import ControlLoop
from wipx.core.load import Load
from wipx.core.model import Model
from wipx.core.plant import plant_of
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

NETWORK = "cnn1d"  # that estimates the balance
LOAD = Load(1.6, 0.45, -0.2491)  # [kg, m, m] the heaviest one of target=emulated; with it `mpc` meets its limits
DURATION = 2.0  # [s] of a release; the estimator answers after 1.2 s
RELEASES = 10  # of each controller, in turn
BAR = 3e-4  # [s] median of a step with filter, estimator and regulator; a period of the loop is 1.5 ms
ANSWER = "lqr_equilibrium, step with the answer"


@dataclass
class Steps:
    """Processor times of one controller's steps [s].

    Attributes:
        ordinary: All but those.
        answering: In which the estimator of the balance answers.
    """

    ordinary: list[float] = field(default_factory=list)
    answering: list[float] = field(default_factory=list)


def measure_controllers() -> dict[str, dict[str, float]]:
    """Median and 99th percentile of a step of every controller, printed and returned by name; all on one thread."""
    plant = plant_of("wip")
    friction = {"translation/lagged_stribeck": PAPER, "pitch/lagged_stribeck": PAPER}
    model = Model(plant, plant.complete(BODY, "benchmark"), {**friction, "actuator/delay": {"tau": 0.006}})
    estimator, _ = untrained(preset(NETWORK))
    loops = {name: design.loop(model, estimator) for name, design in _controllers().items()}
    steps = {name: Steps() for name in loops}
    for _ in range(RELEASES):
        for name, loop in loops.items():
            _release(loop, model, steps[name])
    spent = {name: one.ordinary for name, one in steps.items()}
    spent[ANSWER] = steps["lqr_equilibrium"].answering
    results = {
        name: {"median_s": float(np.median(times)), "p99_s": float(np.quantile(times, 0.99)), "steps": len(times)}
        for name, times in spent.items()
    }
    print_table(
        f"One step of a controller, extended Kalman filter included, one thread; {NETWORK} on windows of {LENGTH} "
        f"samples; bar for the median {1e3 * BAR:g} ms",
        ("controller", "median ms", "99 % ms", "steps"),
        [
            (name, f"{1e3 * one['median_s']:.3f}", f"{1e3 * one['p99_s']:.3f}", f"{one['steps']:.0f}")
            for name, one in results.items()
        ],
    )
    slow = [name for name, one in results.items() if one["median_s"] > BAR]
    print(f"over the bar: {', '.join(slow) or 'none'}")
    return results


def _controllers() -> Mapping[str, Controller]:
    """All that ship, by name."""
    files = sorted((PRESETS.parent / "controller").glob("*.yaml"))
    return {path.stem: build(yaml.safe_load(path.read_text(encoding="utf-8")), "controller") for path in files}


def _release(loop: ControlLoop, model: Model, steps: Steps) -> None:
    """Release the loaded robot under a loop and note the time of every step."""

    def controller(t: float, measured: np.ndarray) -> np.ndarray:
        commands: list[np.ndarray] = []
        if t == 0.0:
            loop.reset(t, measured)
        notes = len(loop.notes)
        spent = processor_time(lambda: commands.append(loop.step(t, measured, np.zeros(4))))
        (steps.answering if len(loop.notes) > notes else steps.ordinary).append(spent)
        return commands[0]

    inputs = Inputs.regular(DURATION, RATE, 1)
    AnalyticSimulator(threads=1).drive(LOAD.on(model), inputs, np.zeros(4), controller)


if __name__ == "__main__":
    measure_controllers()
