"""How well the loops of several trials kept time, from the files that `wipx.hardware.trial_logs` leaves."""

from collections.abc import Sequence
from typing import Any


def worst(loops: Sequence[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """Largest value over all trials of every percentile of error and ages, by their names [s]."""
    names = ("period_error", "imu_age", "motor_age")
    return {
        name: {share: max(loop[name][share] for loop in loops if name in loop) for share in loops[0][name]}
        for name in names
        if loops and name in loops[0]
    }


def missed(loops: Sequence[dict[str, Any]]) -> tuple[int, int]:
    """Steps that were skipped, and replies of the motor that were lost."""
    return sum(loop["steps_skipped"] for loop in loops), sum(loop["lost_replies"]["count"] for loop in loops)
