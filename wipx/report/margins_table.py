"""Stability margins and recovered loads of controllers as a table."""

from collections.abc import Mapping

import numpy as np

from wipx.core.margins import Margins, Recovery, RecoveryRegion
from wipx.report.numbers import MISSING, compact, significant
from wipx.report.tables import markdown

HEAD = (
    "controller",
    "gain, factors",
    "phase [deg]",
    "further delay [ms]",
    "recovers from, % of loads",
    "up to a balance at [rad]",
    "stands off by at most [m]",
)


def margins_table(margins: Mapping[str, Margins], region: RecoveryRegion) -> str:
    """One row for each controller, and what the columns mean, as Markdown.

    Args:
        margins: By the controller's name.
        region: Of the same controllers.
    """
    rows = [_row(name, margins[name], recovery, region) for name, recovery in region.controllers.items()]
    return f"{markdown(HEAD, rows, tuple(range(1, len(HEAD))))}\n{_meaning(margins, region)}\n"


def _row(name: str, margins: Margins, recovery: Recovery, region: RecoveryRegion) -> tuple[str, ...]:
    delay = significant(1e3 * margins.delay) if np.isfinite(margins.delay) else "any"
    farthest = recovery.standing[recovery.recovered].max(initial=0.0)
    return (
        f"{name} (inner loop)" if margins.inner else name,
        f"{significant(margins.gain_low, 2)} to {significant(margins.gain_high, 2)}",
        significant(float(np.rad2deg(margins.phase))),
        delay,
        str(round(100 * recovery.share)),
        _reach(recovery, region),
        significant(float(farthest)) if recovery.recovered.any() else MISSING,
    )


def _reach(recovery: Recovery, region: RecoveryRegion) -> str:
    """Largest pitch of balance, to either side, up to which the robot recovered under every load of the grid."""
    recovered = recovery.recovered.all(axis=0)
    sizes = np.abs(region.pitches)
    lost = sizes[~recovered].min(initial=np.inf)
    within = sizes[recovered & (sizes < lost)]
    return f"+-{compact(float(within.max()))}" if len(within) else MISSING


def _meaning(margins: Mapping[str, Margins], region: RecoveryRegion) -> str:
    """What the columns say, and what they leave out."""
    masses, pitches = ([compact(float(value)) for value in values] for values in (region.masses, region.pitches))
    sentences = [
        "Margins are those at the command, on the completed model, of a controller that knows the state; its filter, "
        "limits, dry friction, dead zone and backlash are left out."
    ]
    inner = [name for name, found in margins.items() if found.inner]
    if inner:
        sentences.append(
            f"Those of {' and '.join(inner)} are of the inner loop, about a fixed balance; they leave its estimate out."
        )
    sentences.append(
        f"Loads of {', '.join(masses)} kg, {compact(region.height)} m above the wheel axis, balance at "
        f"{', '.join(pitches)} rad; the robot is released upright on a rail of +-{compact(region.rail)} m. It has "
        f"recovered if it is still on the rail and calm after {compact(region.duration)} s; it then stands off by its "
        "mean distance from x = 0."
    )
    return " ".join(sentences)
