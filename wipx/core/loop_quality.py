"""How well the loop of a trial kept time: steps, ages of samples, and what was missed."""

from dataclasses import dataclass

import numpy as np

PERCENTILES = (50, 99, 100)


@dataclass(frozen=True)
class Overrun:
    """Steps that were skipped because the one before ended late.

    Attributes:
        t: When the late step ended, since the first command [s].
        step: Number of commands that had been sent; the gap is before the command of that number, counted from 0.
        skipped: Steps.
    """

    t: float
    step: int
    skipped: int


@dataclass(frozen=True)
class LoopQuality:
    """What the clock saw of one trial.

    Attributes:
        period: Of the loop, as asked for [s].
        period_errors: Time between two commands minus the period, shape (commands - 1,) [s].
        imu_ages: Time from a measurement of the IMU to the command that used it, shape (commands,) [s]. A delay that
            all messages share (filtering, transport) is not in it.
        motor_ages: Time from the motor's latest answer to the next command, shape (commands - 1,) [s].
        overruns: In the order of time.
        lost_replies: When commands were sent that the motor did not answer in time, since the first command [s].
        damaged_messages: Of the IMU, refused for their checksum.
    """

    period: float
    period_errors: np.ndarray
    imu_ages: np.ndarray
    motor_ages: np.ndarray
    overruns: tuple[Overrun, ...] = ()
    lost_replies: tuple[float, ...] = ()
    damaged_messages: int = 0

    @property
    def skipped(self) -> int:
        """Steps that were skipped."""
        return sum(overrun.skipped for overrun in self.overruns)

    def summary(self) -> dict[str, dict[str, float]]:
        """Percentiles of size of error and ages, by their name [s]."""
        listed = {
            "period_error": np.abs(self.period_errors),
            "imu_age": self.imu_ages,
            "motor_age": self.motor_ages,
        }
        return {
            name: {f"p{p}": float(np.percentile(values, p)) for p in PERCENTILES}
            for name, values in listed.items()
            if len(values)
        }


def quality_data(quality: LoopQuality) -> dict[str, object]:
    """Everything but the single steps, as plain data."""
    return {
        "period": quality.period,
        "steps": len(quality.period_errors) + 1,
        **quality.summary(),
        "steps_skipped": quality.skipped,
        "overruns": [vars(overrun) for overrun in quality.overruns],
        "lost_replies": {"count": len(quality.lost_replies), "t": list(quality.lost_replies)},
        "damaged_messages": quality.damaged_messages,
    }


def quality_words(summary: dict[str, dict[str, float]]) -> str:
    """Percentiles in one line [ms]."""
    parts = []
    for name, values in summary.items():
        shown = " / ".join(f"{1e3 * value:.3g}" for value in values.values())
        parts.append(f"{name.replace('_', ' ').replace('imu', 'IMU')} {shown} ms")
    shares = " / ".join(f"{p}" for p in PERCENTILES)
    return f"{', '.join(parts)} ({shares} %)"
