"""`task=friction_figure`: the paper's joint model beside Coulomb and viscous friction (Fig. 3)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wipx.core.errors import InputError, check_positive, unknown_name
from wipx.tasks.files.results import FIGURES, write_csv, written_together
from wipx.tasks.shared.job import Job

SYMBOLS = ("F_s", "F_c", "v_s", "sigma", "epsilon", "alpha")


@dataclass(frozen=True)
class FrictionFigure:
    """Draw the friction of Eq. 5 while the joint's velocity swings.

    Attributes:
        zeta: Its six numbers by symbol, as of the effect `lagged_stribeck`.
        speed: Largest velocity [rad/s].
        frequency: Of the swing [Hz]; the lag of Eq. 5 shows as a shift in time.
        rate: Samples per second [Hz].
    """

    zeta: Mapping[str, float]
    speed: float = 1.0
    frequency: float = 2.0
    rate: float = 20000.0

    def __post_init__(self) -> None:
        check_positive(speed=self.speed, frequency=self.frequency, rate=self.rate)
        for symbol in self.zeta:
            if symbol not in SYMBOLS:
                raise unknown_name("symbol", symbol, SYMBOLS, "task.zeta")
        missing = [symbol for symbol in SYMBOLS if symbol not in self.zeta]
        if missing:
            raise InputError(f"task.zeta: {missing[0]} is missing; give task.zeta.{missing[0]}=VALUE")

    def run(self, job: Job) -> None:
        """Compute, draw, write."""
        from wipx.effects.lagged_stribeck import lag_of, resistance
        from wipx.report.friction_figure import FrictionSweep, draw_friction

        z = self.zeta
        t = np.arange(round(1.5 * self.rate / self.frequency)) / self.rate
        velocity = self.speed * np.sin(2.0 * np.pi * self.frequency * t)
        steady = np.array([resistance(v, z["F_s"], z["F_c"], z["v_s"], z["sigma"], z["epsilon"]) for v in velocity])
        kept = np.exp(-1.0 / (self.rate * max(lag_of(z["alpha"]), 1e-12)))
        friction = np.empty_like(steady)
        friction[0] = steady[0]
        for k in range(1, len(t)):
            friction[k] = steady[k] + kept * (friction[k - 1] - steady[k])
        swing = t >= 0.5 / self.frequency  # from the first reversal on
        baseline = z["F_c"] * np.sign(velocity) + z["sigma"] * velocity
        sweep = FrictionSweep(t[swing], velocity[swing], friction[swing], baseline[swing], 5.0 * z["epsilon"])
        numbers = ", ".join(f"{symbol} = {z[symbol]:g}" for symbol in SYMBOLS)
        with written_together(job.out) as folder:
            columns = {"t": sweep.t, "velocity": sweep.velocity, "eq5": sweep.friction, "baseline": sweep.baseline}
            write_csv(folder / "friction.csv", columns)
            for suffix in FIGURES:
                draw_friction(sweep, f"Joint model of the paper's Eq. 5: {numbers}", folder / f"friction{suffix}")
        print(f"picture: {job.out / 'friction.png'}")
