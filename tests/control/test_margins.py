"""Margins are what they say: a loop is stable just within them, and not just beyond."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from balancing import KnownPitch, heavy_robot, loaded
from sim.robots import move, robot

from wipx.control.controller import LinearController
from wipx.control.equilibrium import EquilibriumLqr
from wipx.control.integral import Lqi
from wipx.control.linear_law import LinearLaw
from wipx.control.linearise import linearise, linearise_completed
from wipx.control.lqr import Lqr
from wipx.control.margins import margins
from wipx.control.pid import Pid
from wipx.control.predictive import Mpc
from wipx.control.recovery import Releases, recovery_region
from wipx.control.sampled import SampledPlant, check_stabilises
from wipx.core.errors import InputError
from wipx.core.model import Model
from wipx.report.margins_figure import draw_margins, draw_recovery
from wipx.sim.analytic import AnalyticSimulator

CONTROLLERS = {"lqr": Lqr(), "lqr_equilibrium": EquilibriumLqr(), "lqi": Lqi(), "mpc": Mpc(), "pid": Pid()}


@dataclass(frozen=True)
class Scaled:
    """A controller whose command is multiplied."""

    controller: LinearController
    factor: float

    @property
    def rate(self) -> float:
        return self.controller.rate

    def law(self, model: Model) -> LinearLaw:
        return self.controller.law(model).scaled(self.factor)


def slowest(controller: LinearController, model: Model) -> float:
    """Real part of the least damped pole [1/s]."""
    return float(SampledPlant.of(model, controller.rate).poles(controller.law(model))[0].real)


def test_a_fast_regulator_has_the_classical_margins(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    for kind in ("wip", "pendulum"):
        design = Lqr(
            coordinates=tuple(np.exp(rng.uniform(0.0, 5.0, 2))), rates=tuple(np.exp(rng.uniform(0.0, 3.0, 2))), rate=5e4
        )
        found = margins(design, robot(kind))
        # Safonov and Athans 1977: gains from a half on, 60 degrees; holding the command for 20 us takes a little.
        assert found.gain_low <= 0.5 + 1e-3
        assert found.gain_high > 100.0
        assert found.phase >= np.deg2rad(59.5)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_gain_margins_are_where_the_loop_loses_its_stability(name: str):
    model, controller = heavy_robot(), CONTROLLERS[name]
    found = margins(controller, model)
    assert 0.0 < found.gain_low < 1.0 < found.gain_high < np.inf  # the delay bounds every gain
    for inside, outside in (
        (1.01 * found.gain_low, 0.99 * found.gain_low),
        (0.99 * found.gain_high, 1.01 * found.gain_high),
    ):
        assert slowest(Scaled(controller, inside), model) < 0.0
        assert slowest(Scaled(controller, outside), model) > 0.0


@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_delay_margin_is_the_delay_that_makes_the_loop_unstable(name: str):
    model, controller = heavy_robot(), CONTROLLERS[name]
    spare = margins(controller, model).delay
    for share, stable in ((0.98, True), (1.02, False)):
        late = model.with_effects({"actuator/delay": {"tau": 0.003 + share * spare}})
        assert (slowest(controller, late) < 0.0) == stable


def test_a_delay_costs_its_phase():
    prompt, late = (margins(Lqr(), heavy_robot({"actuator/delay": {"tau": tau}})) for tau in (0.002, 0.0123))
    assert late.delay == pytest.approx(prompt.delay - 0.0103, abs=2e-4)
    assert late.phase < prompt.phase


def test_a_sampled_plant_moves_as_the_simulator_does(fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    tau, lag = rng.uniform(0.0, 0.004), rng.uniform(0.001, 0.01)
    axis = robot("linear_axis", {"actuator/delay": {"tau": tau}, "actuator/lag": {"tau": lag}})
    plant = SampledPlant.of(axis, 650.0)
    commands = rng.normal(size=40)
    commands[:5] = 0.0  # the simulator takes a lag for settled at its first command
    state = np.zeros(len(plant.f))
    for u in commands:
        state = plant.f @ state + plant.g[:, 0] * u
    motion = move(axis, (0.0, 0.0), np.arange(41) / 650.0, commands, AnalyticSimulator(1e-5))
    np.testing.assert_allclose(state[:2], [motion.q[-1, 0], motion.v[-1, 0]], rtol=1e-3, atol=1e-6)


def test_completed_slopes_are_those_of_the_friction_and_the_load():
    model = heavy_robot({"translation/viscous": {"sigma": 2.0}, "pitch/lagged_stribeck": _paper_friction(0.3)})
    mass = np.linalg.inv(_inverse_mass(model))
    np.testing.assert_allclose(mass @ linearise_completed(model).a[2:, 2:], -np.diag([2.0, 0.3]), rtol=1e-3, atol=5e-3)
    body = loaded(heavy_robot({}), 0.1)
    bare = replace(body, effects={})
    np.testing.assert_allclose(linearise_completed(body).a, linearise(bare).a, rtol=1e-4, atol=1e-3)


def _paper_friction(sigma: float) -> dict[str, float]:
    return {"F_s": 0.01, "F_c": 0.01, "v_s": 0.2, "sigma": sigma, "epsilon": 0.01, "alpha": 0.7}


def _inverse_mass(model: Model) -> np.ndarray:
    """From the slopes by the command and the body's weight."""
    p = model.parameters
    arm = p["body_mass"] * p["com_height"]
    rolling = p["body_mass"] + p["wheel_mass"] + p["wheel_inertia"] / p["wheel_radius"] ** 2
    return np.linalg.inv(np.array([[rolling, -arm], [-arm, arm * p["com_height"] + p["body_inertia"]]]))


@pytest.mark.parametrize("name", CONTROLLERS)
def test_gains_that_do_not_stabilise_the_model_are_refused_with_their_poles(name: str):
    weak = heavy_robot({"actuator/gain": {"k": 0.3}})
    controller = CONTROLLERS[name]
    with pytest.raises(InputError, match=r"do not stabilise the model: closed-loop poles at \d.* 1/s"):
        controller.loop(weak, KnownPitch(0.0))
    with pytest.raises(InputError, match="do not stabilise"):
        margins(controller, weak)


def test_several_commands_have_no_margins_but_poles():
    with pytest.raises(InputError, match="a double_pendulum has several"):
        margins(Lqr(), robot("double_pendulum"))
    model = robot("double_pendulum")
    check_stabilises(Lqr().law(model), model, 650.0)


@pytest.mark.slow
def test_the_region_of_loads_shows_what_each_controller_recovers_from(tmp_path: Path):
    model = heavy_robot()
    releases = Releases(masses=(1.2,), pitches=(-0.14, 0.05), duration=5.0, end=1.0)
    region = recovery_region(
        {"lqr": lambda _: Lqr().loop(model), "pid": lambda _: Pid().loop(model)},
        model,
        AnalyticSimulator(threads=1),
        releases,
    )
    baseline, pid = region.controllers["lqr"], region.controllers["pid"]
    assert baseline.recovered.tolist() == [[False, True]]  # theta_eq K_theta / K_x is beyond the rail
    assert pid.recovered.all()
    assert baseline.standing[0, 1] > 0.3
    assert pid.standing[0, 1] < 0.1
    assert np.isnan(baseline.standing[0, 0])
    assert baseline.farthest[0, 0] >= releases.rail
    draw_recovery(region, tmp_path / "recovery.png")
    draw_margins({name: margins(c, model) for name, c in CONTROLLERS.items()}, tmp_path / "margins.png")
    for name in ("recovery.png", "margins.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_releases_without_loads_are_refused():
    with pytest.raises(InputError, match="at least one mass"):
        Releases(masses=())
