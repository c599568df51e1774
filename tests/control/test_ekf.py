"""The state estimate: consistent where its model is right, through delays, holes and uneven steps.

The robots here are integrated by Euler and Maruyama's method on equations that share no code with the filter.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import chi2
from sim.robots import inner_forces, mass_matrix, robot

from wipx.control.ekf import EASE_SLIDING, EASE_TURNING, Ekf, FilterNoise
from wipx.control.lqr import Lqr
from wipx.core.errors import InputError
from wipx.core.model import Model

RATE, FINE = 650.0, 3e-4  # [Hz] of the loop; [s] of the integrator
DELAY = 3e-3  # [s] two ticks of the loop
NOISE = FilterNoise(force=0.3, torque=0.03)
FALSE_ALARM = 1e-5  # of one test with a fresh seed


def rough(kind: str) -> Model:
    """A robot with friction on every joint and a command delay."""
    effects = {"actuator/delay": {"tau": DELAY}}
    model = robot(kind)
    for site in model.plant.joints:
        effects[f"{site}/viscous"] = {"sigma": 0.02}
        effects[f"{site}/coulomb"] = {"F_c": 0.01 if model.plant.is_angular(site) else 0.8}
    return robot(kind, effects)


@dataclass(frozen=True)
class Estimated:
    """What a run left: NIS and channels of every reading, and the last error in standard deviations, squared."""

    nis: float
    channels: int
    nees: float
    states: int


def run(model: Model, ticks: int, rng: np.random.Generator) -> Estimated:
    """A robot that is driven by its own estimate, with noise as the filter expects it and readings that get lost."""
    plant = model.plant
    n = len(plant.joints)
    turning = np.array([plant.is_angular(site) for site in plant.joints])
    density = np.where(turning, NOISE.torque, NOISE.force)
    sensors = np.concatenate(
        [np.where(turning, NOISE.angle, NOISE.position), np.where(turning, NOISE.angular_rate, NOISE.velocity)]
    )
    loop = Lqr(coordinates=(20.0, 100.0)).loop(model)
    loop.estimator = ekf = Ekf(model, NOISE)
    q, v, t = np.zeros(n), np.zeros(n), 0.0
    commands: list[tuple[float, np.ndarray]] = []
    loop.reset(t, np.concatenate([q, v]) + sensors * rng.normal(size=2 * n))
    # The robot is at rest where its sensors show it, within their noise.
    v += sensors[n:] * rng.normal(size=n)
    nis, channels = 0.0, 0
    for _ in range(ticks):
        until = t + (1.0 + 0.3 * rng.uniform(-1.0, 1.0)) / RATE
        pieces = int(np.ceil((until - t) / FINE))
        h = (until - t) / pieces
        for piece in range(pieces):
            middle = t + (piece + 0.5) * h
            force = np.zeros(n)
            active = [u for sent, u in commands if sent + DELAY <= middle]
            force[[plant.joints.index(site) for site in plant.actuated]] = active[-1] if active else 0.0
            q, v = moved(model, q, v, force, h, density * rng.normal(size=n) * np.sqrt(h))
        t = until
        shown = np.concatenate([q, v]) + sensors * rng.normal(size=2 * n)
        shown[rng.uniform(size=2 * n) < 0.3] = np.nan
        commands.append((t, loop.step(t, shown, np.zeros(2 * n))))
        nis += ekf.nis
        channels += int(np.isfinite(shown).sum())
    error = np.concatenate([q, v]) - ekf.state
    return Estimated(nis, channels, float(error @ np.linalg.solve(ekf.covariance, error)), 2 * n)


def moved(model: Model, q, v, force, h: float, impulse):
    """Coordinates and rates after a step of Euler and Maruyama, with friction that builds up over a small speed."""
    pull = inner_forces(model, q, v) + force
    for j, site in enumerate(model.plant.joints):
        ease = EASE_TURNING if model.plant.is_angular(site) else EASE_SLIDING
        pull[j] -= model.effects[f"{site}/viscous"]["sigma"] * v[j]
        pull[j] -= model.effects[f"{site}/coulomb"]["F_c"] * np.tanh(v[j] / ease)
    after = v + np.linalg.solve(mass_matrix(model, q), h * pull + impulse)
    return q + 0.5 * h * (v + after), after


@pytest.mark.parametrize(
    "kind", [*(pytest.param(kind, marks=pytest.mark.slow) for kind in ("wip", "cartpole")), "pendulum", "linear_axis"]
)
def test_innovations_and_errors_are_as_large_as_the_filter_says(kind: str, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    runs = [run(rough(kind), 80, rng) for _ in range(20)]
    for total, freedom in (
        (sum(r.nis for r in runs), sum(r.channels for r in runs)),
        (sum(r.nees for r in runs), sum(r.states for r in runs)),
    ):
        assert chi2.ppf(FALSE_ALARM, freedom) < total < chi2.isf(FALSE_ALARM, freedom)


def test_a_double_pendulum_is_followed_without_its_rates(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    model = robot("double_pendulum")
    ekf = Ekf(model, FilterNoise(angle=1e-4, torque=1e-4))
    q, v, t = np.array([0.4, -0.3]), np.zeros(2), 0.0
    ekf.reset(0.0, np.concatenate([q, v]))
    for _ in range(300):
        for _ in range(10):
            acceleration = np.linalg.solve(mass_matrix(model, q), inner_forces(model, q, v))
            v = v + 2e-4 * acceleration
            q = q + 2e-4 * v
        t += 2e-3
        ekf.observe(t, np.concatenate([q + 1e-4 * rng.normal(size=2), [np.nan, np.nan]]))
    assert np.max(np.abs(v)) > 0.5
    np.testing.assert_allclose(ekf.state[2:], v, atol=0.02)  # integrator of first order, and four deviations


def test_a_hole_in_the_readings_is_bridged_by_the_model():
    model = robot("pendulum")
    p = model.parameters
    turning = p["body_mass"] * p["com_height"] ** 2 + p["body_inertia"]
    growth = np.sqrt(p["body_mass"] * p["gravity"] * p["com_height"] / turning)
    ekf = Ekf(model)
    ekf.reset(0.0, np.array([0.01, 0.0]))
    before = ekf.covariance
    state = ekf.observe(0.1, np.full(2, np.nan))
    np.testing.assert_allclose(
        state, 0.01 * np.array([np.cosh(0.1 * growth), growth * np.sinh(0.1 * growth)]), rtol=1e-3
    )
    assert np.all(np.diag(ekf.covariance) > np.diag(before))
    assert np.isnan(ekf.innovations).all()
    assert ekf.nis == 0.0


def test_a_command_is_predicted_when_it_arrives():
    mass = 1.0
    axis = robot("linear_axis", {"actuator/delay": {"tau": 0.004}}, {"body_mass": 0.0, "wheel_mass": mass})
    ekf = Ekf(axis)
    nothing = np.full(2, np.nan)
    ekf.send(0.0, np.array([2.0]))
    assert ekf.observe(0.003, nothing)[1] == 0.0
    assert ekf.observe(0.005, nothing)[1] == pytest.approx(2.0 * 0.001 / mass)
    ekf.send(0.005, np.array([0.0]))
    assert ekf.observe(0.020, nothing)[1] == pytest.approx(2.0 * 0.005 / mass)


def test_known_errors_of_the_sensors_are_taken_off():
    wip = robot("wip", {"sensor_theta/bias": {"b": 0.02}, "sensor_x/scale": {"e": 0.1}})
    ekf = Ekf(wip)
    ekf.reset(0.0, np.array([1.1, 0.02, 0.0, 0.0]))
    np.testing.assert_allclose(ekf.state, [1.0, 0.0, 0.0, 0.0], atol=1e-12)
    ekf.observe(0.0, np.array([1.1, 0.02, 0.0, 0.0]))
    assert ekf.nis == pytest.approx(0.0, abs=1e-12)


def test_the_covariance_stays_one_over_long_runs():
    # Round-off makes a covariance asymmetric, and an asymmetry grows with the unstable plant.
    ekf = Ekf(robot("wip"))
    for k in range(6500):
        ekf.observe((k + 1) / RATE, np.zeros(4))
    np.testing.assert_allclose(ekf.covariance, ekf.covariance.T, rtol=0.0, atol=1e-18)
    assert np.min(np.linalg.eigvalsh(ekf.covariance)) > 0.0


def test_an_unknown_noise_is_refused_in_one_line():
    with pytest.raises(InputError, match=r"controller\.noise: unknown noise 'angel'; did you mean angle\?"):
        Lqr(noise={"angel": 1e-3})
    with pytest.raises(InputError, match=r"noise\.angle is 0"):
        Lqr(noise={"angle": 0.0})
