"""Results as an identification would leave them, made up from sines and noise."""

from dataclasses import replace

import numpy as np

from wipx.core.results import Estimate, FitErrors, IdentificationResult, SearchHistory, Trace

UNITS = {"x": "m", "theta": "rad", "u": "N"}
DOUBLE_PENDULUM_UNITS = {"theta1": "rad", "theta2": "rad", "u1": "N m", "u2": "N m"}


def trace(name: str, *, held_out: bool, units: dict[str, str] = UNITS, rows: int = 1000, rate: float = 100.0) -> Trace:
    """A trace whose predictions drift away from the recording in every window of 0.5 s."""
    rng = np.random.default_rng(sum(map(ord, name)))
    t = np.arange(rows) / rate
    since_restart = t % 0.5
    signals = [column for column in units if not column.startswith("u")]
    true = {
        column: (0.3 if units[column] == "m" else 0.08) * np.sin(2.0 * np.pi * (0.31 + 0.4 * i) * t + i)
        for i, column in enumerate(signals)
    }
    recorded = {column: values + rng.normal(0.0, 0.0008, rows) for column, values in true.items()}
    wander = np.cos(0.7 * t) * since_restart**2
    return Trace(
        name=name,
        held_out=held_out,
        t=t,
        command={u: 4.0 * np.sign(np.sin(2.2 * t + i)) for i, u in enumerate(c for c in units if c.startswith("u"))},
        recorded=recorded,
        nominal={column: values + 0.19 * wander for column, values in true.items()},
        completed={column: values + 0.018 * wander for column, values in true.items()},
        starts=np.arange(0.0, t[-1], 0.5),
    )


def result(units: dict[str, str] = UNITS) -> IdentificationResult:
    """Three recordings, one of them held out, with every kind of remark among the estimates."""
    signals = [column for column in units if not column.startswith("u")]

    def errors(windows: int, size: float) -> FitErrors:
        sizes = {column: size * (1.0 + 0.6 * i) for i, column in enumerate(signals)}
        return FitErrors(
            horizon=0.5,
            windows=windows,
            nominal={c: 0.021 * s for c, s in sizes.items()},
            completed={c: 0.0021 * s for c, s in sizes.items()},
            noise_floor={c: 0.0008 * s for c, s in sizes.items()},
        )

    evaluations = np.array([1, 12, 60, 140, 300, 620, 1100, 1800])
    return IdentificationResult(
        title="Balancing robot, gravel floor",
        plant="wip" if "x" in units else "double_pendulum",
        source="recordings/balance",
        split="every third recording held out",
        objective="prediction error over windows of 0.5 s, Huber loss, weighted by sensor noise",
        units=units,
        nominal=(("body_mass", 2.6, "kg"), ("com_height", 0.35, "m"), ("wheel_inertia", 0.0023, "kg m^2")),
        effects=(
            ("translation/coulomb", "-F_c s(v), sticking at v = 0", "Olsson et al. 1998, Eur. J. Control 4(3)"),
            ("actuator/delay", "F(t) = u(t - tau)", "contract, section 3"),
        ),
        estimates=(
            Estimate("translation/coulomb.F_c", "N", 0.0, 3.1042, 2.93, 3.29, False, "Coulomb level"),
            Estimate("actuator/delay.tau", "s", 0.0, 0.00412, 0.00395, 0.0043, False, "transport delay"),
            Estimate("pitch/viscous.sigma", "N m s/rad", 0.02, 0.024, 0.011, 0.037, False, "viscous coefficient"),
            Estimate("actuator/backlash.gap", "m", 0.0, 0.02, 0.018, 0.02, True, "gap at the wheel's rim"),
            Estimate("body_inertia", "kg m^2", 0.11, 0.1293, -np.inf, np.inf, False, "of the body about its CoM"),
        ),
        fit=errors(80, 0.95),
        held_out=errors(40, 1.0),
        history=SearchHistory(
            "CMA-ES", evaluations, 0.021 * evaluations, np.array([np.inf, 40, 9, 5, 1.6, 1.1, 1.02, 1.01]), "converged"
        ),
        traces=(
            trace("r1.csv", held_out=False, units=units),
            trace("r2.csv", held_out=False, units=units),
            trace("r3.csv", held_out=True, units=units),
        ),
        notes=("actuator/backlash.gap stopped at its upper bound; widen it or drop the effect.",),
    )


def without_held_out() -> IdentificationResult:
    """As `result`, with nothing held out."""
    whole = result()
    return replace(whole, held_out=None, traces=tuple(replace(t, held_out=False) for t in whole.traces))


def with_trace(shown: Trace) -> IdentificationResult:
    """As `result`, with one trace only."""
    return replace(result(), traces=(shown,))
