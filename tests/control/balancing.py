"""A robot of about the size of the paper's, loads on it, and closed loops that the tests of the controllers share."""

from dataclasses import dataclass

import numpy as np
from sim.robots import robot

from wipx.control.loop import Loop
from wipx.control.recovery import Releases
from wipx.core.model import Model
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

RATE = 650.0
SMOOTH = {"translation/viscous": {"sigma": 1.0}, "actuator/delay": {"tau": 0.003}}


def heavy_robot(effects=None) -> Model:
    """A wip of 5 kg, by default with what a linear model can hold: viscous friction and a delay."""
    return robot("wip", SMOOTH if effects is None else effects, {"body_mass": 5.0, "body_inertia": 0.15})


def loaded(model: Model, pitch: float, mass: float = 1.2) -> Model:
    """The robot with a load that moves its balance to a pitch [rad]."""
    return Releases().load(model, mass, pitch).on(model)


@dataclass(frozen=True)
class Run:
    """A release: times (K,), measured states (K, 4), commands (K,)."""

    t: np.ndarray
    states: np.ndarray
    commands: np.ndarray


def release(loop: Loop, robot: Model, duration: float, start=(0.0, 0.0, 0.0, 0.0)) -> Run:
    """Let a robot go under a loop; measured states are exact."""
    t, states, commands = [], [], []

    def controller(now: float, measured: np.ndarray) -> np.ndarray:
        if not t:
            loop.reset(now, measured)
        t.append(now)
        states.append(measured.copy())
        commands.append(loop.step(now, measured, np.zeros(4)))
        return commands[-1]

    inputs = Inputs.regular(duration, loop.rate, 1)
    AnalyticSimulator(threads=1).drive(robot, inputs, np.array(start), controller)
    return Run(np.array(t), np.array(states), np.array(commands)[:, 0])


@dataclass(frozen=True)
class Found:
    """What an estimator answers, arrays (1,)."""

    pitch: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass
class KnownPitch:
    """An estimator that knows the answer, and keeps what it was asked."""

    pitch: float
    half_width: float = 0.01
    length: int = 80
    period: float = 0.015
    asked: list[np.ndarray] | None = None

    def estimate(self, windows: np.ndarray) -> Found:
        self.asked = [*(self.asked or []), windows]
        pitch = np.array([self.pitch])
        return Found(pitch, pitch - self.half_width, pitch + self.half_width)
