"""By how much measurements come after their commands.

A joint's acceleration follows a constant, its position, its gravity, its speed, dry friction and the command of a while
ago, of a torque drive as of a position drive. All of them pass the same smoothing, which shifts nothing and makes noisy
positions differentiable (state-variable filters: Young, Automatica 17, 1981). The shift is the one at which the command
explains most of what the rest leaves. It holds the delays of bus, drive and log together, and about the time constant
of a drive that smooths. Feedback through the controller can pull it by some milliseconds.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import correlate

from wipx.core.log_preview import ShiftEstimate
from wipx.importing.mapping import is_command

EARLIEST, LATEST = 0.1, 0.4  # [s] before and after the command that are looked at
LONGEST = 50_000  # rows that are looked at
FEWEST = 500  # rows
WIDTHS = (1.0, 2.0, 4.0, 8.0, 16.0)  # rows; standard deviation of the smoothing, the sharpest that is clear counts
CLEAR = 0.95  # correlation that is clear
LEAST = 0.8  # correlation under which nothing is said
LEFT = 1e-9  # share of a command's power that the rest must leave: less is rounding
SLOW = 0.05  # standard deviations of the speed under which dry friction changes its sign smoothly
Column = Callable[[str], np.ndarray]


def estimate_shifts(names: Sequence[str], t: np.ndarray, column: Column) -> tuple[ShiftEstimate, ...]:
    """Shifts of all commands whose measurement follows them clearly enough.

    Args:
        names: Columns of the recording.
        t: Times of its rows, strictly increasing, shape (rows,) [s].
        column: Gives a column, shape (rows,) [SI].
    """
    if len(t) < FEWEST:
        return ()
    t = t[:LONGEST]
    step = float(np.median(np.diff(t)))
    even = t[0] + step * np.arange(int((t[-1] - t[0]) / step))

    def evenly(name: str) -> np.ndarray:
        return np.interp(even, t, column(name)[: len(t)])

    found = (_shift_of(command, names, evenly, step) for command in filter(is_command, names))
    return tuple(estimate for estimate in found if estimate is not None)


def _shift_of(command: str, names: Sequence[str], column: Column, step: float) -> ShiftEstimate | None:
    """The shift of one command; None where nothing follows it clearly."""
    measured, position = f"{command}_measured", _position_of(command, names)
    u = column(command)
    if measured in names:
        lag, correlation = _sharpest(u, step, lambda width: _force(column(measured), width))
        if correlation >= LEAST:
            return ShiftEstimate(command, measured, "force", lag * step, correlation)
    if position is None:
        return None
    q = column(position)
    rate = f"{position}_dot"
    v = column(rate) * step if rate in names else None
    lag, correlation = _sharpest(u, step, lambda width: _motion(q, v, width))
    if correlation < LEAST:
        return None
    # A command is held from its row on: its middle comes half a row later.
    return ShiftEstimate(command, position if v is None else rate, "acceleration", (lag - 0.5) * step, correlation)


def _position_of(command: str, names: Sequence[str]) -> str | None:
    """The column that a command moves: `elbow` for `u_elbow`, `theta1` for `u1`, `x` or `theta` for `u`."""
    joint = command[2:] if command.startswith("u_") else f"theta{command[1:]}"
    candidates = ["x", "theta"] if command == "u" else [joint]
    return next((name for name in candidates if name in names), None)


def _force(measured: np.ndarray, width: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """A reported force, and what beside the command it may hold."""
    return gaussian_filter1d(measured, width), [np.ones_like(measured)]


def _motion(q: np.ndarray, v: np.ndarray | None, width: float) -> tuple[np.ndarray, list[np.ndarray]]:
    """A joint's acceleration, and what beside the command it follows; all per row in place of per second.

    Args:
        q: Position, shape (rows,).
        v: Measured rate, shape (rows,); None where it is not measured.
        width: Of the smoothing [rows].
    """
    position = gaussian_filter1d(q, width)
    if v is None:
        speed, acceleration = (gaussian_filter1d(q, width, order=order) for order in (1, 2))
        raw = gaussian_filter1d(q, 2.0, order=1)
    else:
        speed, acceleration = gaussian_filter1d(v, width), gaussian_filter1d(v, width, order=1)
        raw = gaussian_filter1d(v, 2.0)
    friction = gaussian_filter1d(np.tanh(raw / (SLOW * float(np.std(speed)) + 1e-300)), width)
    return acceleration, [np.ones_like(q), position, np.sin(position), np.cos(position), speed, friction]


def _sharpest(
    u: np.ndarray, step: float, response: Callable[[float], tuple[np.ndarray, list[np.ndarray]]]
) -> tuple[float, float]:
    """Lag in rows and correlation with the sharpest smoothing that is clear, else with the clearest."""
    best = (0.0, 0.0)
    for width in WIDTHS:
        followed, beside = response(width)
        lag, correlation = _lag(gaussian_filter1d(u, width), followed, beside, step, margin=round(4.0 * width))
        if correlation >= CLEAR:
            return lag, correlation
        best = max(best, (lag, correlation), key=lambda pair: pair[1])
    return best


def _lag(
    u: np.ndarray, followed: np.ndarray, beside: list[np.ndarray], step: float, margin: int
) -> tuple[float, float]:
    """Lag of u in rows at which it explains most of what `beside` leaves of `followed`, and the partial correlation."""
    before, after = round(EARLIEST / step), round(LATEST / step)
    rows = np.arange(after + margin, len(u) - before - margin)
    if len(rows) < FEWEST // 2 or not np.isfinite([u, followed, *beside]).all():
        return 0.0, 0.0
    table = np.column_stack([column[rows] for column in beside])
    basis, _ = np.linalg.qr(table / (np.linalg.norm(table, axis=0) + 1e-300))
    rest = followed[rows] - basis @ (basis.T @ followed[rows])
    size = float(np.linalg.norm(rest))
    if size <= 1e-9 * float(np.linalg.norm(followed[rows])) or float(np.ptp(u)) == 0.0:
        return 0.0, 0.0
    lags = np.arange(-before, after + 1)
    near = u[margin : len(u) - margin]

    def at_lags(signal: np.ndarray) -> np.ndarray:
        """Products of a signal with the command at all lags, shape (lags,)."""
        return correlate(near, signal, mode="valid", method="fft")[::-1]

    # What the rest explains of a command is its part along the basis.
    power = correlate(near**2, np.ones(len(rows)), mode="valid", method="fft")[::-1]
    left = power - np.sum([at_lags(column) ** 2 for column in basis.T], axis=0)
    told = left > LEFT * np.max(power)
    correlations = np.where(told, np.abs(at_lags(rest)) / (np.sqrt(np.where(told, left, 1.0)) * size), 0.0)
    best = int(np.argmax(correlations))
    if best in (0, len(lags) - 1):  # it rises beyond what is looked at: no shift, but another cause
        return 0.0, 0.0
    return float(lags[best]) + _vertex(correlations**2, best), float(correlations[best])


def _vertex(values: np.ndarray, best: int) -> float:
    """Where a parabola through the greatest value and its neighbours has its top, counted from that value.

    Args:
        values: Shape (n,).
        best: Neither the first nor the last.
    """
    left, middle, right = values[best - 1 : best + 2]
    curvature = left - 2.0 * middle + right
    return float(0.5 * (left - right) / curvature) if curvature < 0.0 else 0.0
