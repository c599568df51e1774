"""The shift between a command and what follows it."""

import numpy as np
import pytest

from wipx.importing.shifts import estimate_shifts

STEP = 0.004


def pendulum(rng: np.random.Generator, kind: str, delay: float, noise: float) -> dict[str, np.ndarray]:
    """A pendulum with Coulomb and viscous friction under a delayed torque, 20 s."""
    rows, parts = 5000, 8
    t = np.arange(rows) * STEP
    commands = {
        "chirp": 2.0 * np.sin(2.0 * np.pi * (0.3 * t + 0.15 * t**2)),
        "steps": np.repeat(rng.normal(size=rows // 50), 50),
        "target": 0.8 * np.sin(2.0 * np.pi * 0.7 * t) + 0.3 * np.sin(2.0 * np.pi * 1.9 * t),
    }
    u, late = commands[kind], round(delay / STEP * parts)
    applied = np.concatenate([np.zeros(late), np.repeat(u, parts)])
    angle, rate, angles = 0.0, 0.0, np.zeros(rows)
    for k in range(rows):
        angles[k] = angle
        for j in range(parts):
            torque = applied[k * parts + j]
            torque = 400.0 * (torque - angle) - 20.0 * rate if kind == "target" else 3.0 * torque
            rate += STEP / parts * (torque - 9.81 * np.sin(angle) - 0.2 * np.tanh(rate / 0.01) - 0.3 * rate)
            angle += STEP / parts * rate
    return {"t": t, "theta": angles + noise * rng.normal(size=rows), "u": u}


@pytest.mark.parametrize("kind", ["chirp", "steps", "target"])
@pytest.mark.parametrize("delay", [0.0, 0.012, 0.03])
def test_a_delay_is_found_to_a_third_of_a_row(fresh_seed: int, kind: str, delay: float):
    columns = pendulum(np.random.default_rng(fresh_seed), kind, delay, 1e-4)
    (shift,) = estimate_shifts(("theta", "u"), columns["t"], lambda name: columns[name])
    assert shift.shift == pytest.approx(delay, abs=STEP / 3.0)
    assert shift.correlation > 0.9


def test_nothing_is_said_of_a_command_that_nothing_follows(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    columns = pendulum(rng, "steps", 0.0, 1e-4)
    columns["u"] = np.repeat(rng.normal(size=100), 50)
    assert estimate_shifts(("theta", "u"), columns["t"], lambda name: columns[name]) == ()
    columns["u"] = np.zeros(5000)
    assert estimate_shifts(("theta", "u"), columns["t"], lambda name: columns[name]) == ()


def test_a_reported_force_is_preferred(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    columns = pendulum(rng, "steps", 0.012, 1e-4)
    columns["u_measured"] = np.roll(columns["u"], 2) + 0.02 * rng.normal(size=5000)
    (shift,) = estimate_shifts(("theta", "u", "u_measured"), columns["t"], lambda name: columns[name])
    assert (shift.measurement, shift.how) == ("u_measured", "force")
    assert shift.shift == pytest.approx(2.0 * STEP, abs=STEP / 3.0)
