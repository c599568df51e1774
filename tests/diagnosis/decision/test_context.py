"""Which models are trusted."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, Bench, bench, coloured, thinned
from diagnosis.recorded_arm import arm, recorded
from identify.emulated_robot import nominal_model
from scipy.signal import lfilter

from wipx.core.model import ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.hypothesis import Hypothesis
from wipx.diagnosis.likelihood.lasting_noise import NoiseSources
from wipx.diagnosis.rules import USUAL
from wipx.sim.inputs import Inputs

SPRING = "actuator_elbow/elasticity"


def test_a_model_that_predicts_far_worse_than_the_nominal_one_is_not_trusted(fresh_seed: int):
    case = bench("linear_axis", {}, fresh_seed)
    setting = replace(case.setting, uncertainty={"input_gain": 1.0})
    context = Context.of(case.recordings, setting, SIMULATOR, USUAL)
    right, wrong = (
        context.fitter.fit(Hypothesis.of(setting, (), {"input_gain": gain}), case.quiet, steps=0) for gain in (1.0, 0.3)
    )
    assert context.is_trusted(right)
    assert not context.is_worse(right)
    assert context.is_worse(wrong)
    assert not context.is_trusted(wrong)


def test_a_model_whose_misfit_looks_like_noise_that_lasts_is_not_trusted(fresh_seed: int):
    case = bench("linear_axis", {"translation/coulomb": {"F_c": 0.3}}, fresh_seed)
    context = Context.of(case.recordings, case.setting, SIMULATOR, USUAL)
    friction, levels = {"translation/coulomb.F_c": 0.3}, replace(case.quiet, force=2.0 * case.quiet.force)
    without, right = (
        context.fitter.fit(Hypothesis.of(case.setting, effects, friction), levels, steps=0)
        for effects in ((), ("translation/coulomb",))
    )
    assert without.levels.force[0] == levels.force[0]  # the noise of the sensor takes it all
    assert not context.is_quiet(without)
    assert context.unruly_joints(without) == ("translation",)
    assert not context.holds_somewhere(without)
    assert not context.is_trusted(without)
    assert context.unruly_joints(right) == ()
    assert context.holds_somewhere(right)
    assert context.is_trusted(right)


def test_a_right_model_is_trusted_though_the_noise_of_a_sensor_lasts(fresh_seed: int):
    case = bench("linear_axis", {}, fresh_seed)
    recordings = coloured(case.recordings, np.random.default_rng(fresh_seed))
    context = Context.of(recordings, case.setting, SIMULATOR, USUAL)
    fit = context.fitter.converged(context.fitter.fit(Hypothesis.of(case.setting, (), {}), context.first_levels))
    assert context.by_row.foretold(fit)[0] > USUAL.trust.foretold
    assert context.unruly_joints(fit) == ()
    assert context.is_trusted(fit)


@pytest.mark.parametrize(("loud", "quiet"), [("elbow", True), ("shoulder", False)])
def test_a_joint_whose_drive_swings_unseen_may_ask_for_forces(
    loud: str, quiet: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fresh_seed: int
):
    spring = {"drive_inertia": 0.004, "stiffness": 9.0, "damping": 0.015}
    model = arm(tmp_path)
    case = Bench(model, (recorded(model.with_effects({SPRING: spring}), fresh_seed),), {})
    context = Context.of(case.recordings, case.setting, SIMULATOR, USUAL)
    right = Hypothesis.of(case.setting, (SPRING,), {f"{SPRING}.{name}": value for name, value in spring.items()})
    force = case.quiet.force * np.where(np.array(model.plant.joints) == loud, 100.0, 1.0)
    fit = context.fitter.fit(right, replace(case.quiet, force=force), steps=0)
    monkeypatch.setattr(Context, "noise_of", lambda _, of: NoiseSources(of.levels.force, None))
    assert context.is_quiet(fit) is quiet


def shaken_pendulums(rng: np.random.Generator, unknown: tuple[float, ...]) -> list[Recording]:
    """Runs of a double pendulum under noisy commands, and under white torques of some sizes that no log has."""
    t, nominal, hanging = np.arange(0.0, 8.0, 0.004), nominal_model("double_pendulum"), np.array([np.pi, 0.0, 0.0, 0.0])
    recordings = []
    for number, size in enumerate(unknown):
        u = 0.2 * np.sin(2.0 * np.pi * np.outer(t, rng.uniform(0.5, 1.5, 2)))
        u += lfilter([0.5], [1.0, -0.5], rng.normal(0.0, 0.3, (len(t), 2)), axis=0)
        inputs = Inputs.of([t], [u + rng.normal(0.0, 1.0, (len(t), 2)) * size], [0])
        run = SIMULATOR.replay(ModelBatch(nominal), inputs, hanging[:, None, None])
        q = run.coordinates[:, :, 0, 0] + rng.normal(0.0, 1e-6, (len(t), 2))
        columns = {"t": t, "theta1": q[:, 0], "theta2": q[:, 1], "u1": u[:, 0], "u2": u[:, 1]}
        recordings.append(Recording(f"r{number}.csv", columns))
    return recordings


def otherwise_is_likelier(recordings: list[Recording]) -> bool:
    """Whether rows of some logs are likelier with means of commands if they are taken for held ones, or held if not."""
    case = Bench(nominal_model("double_pendulum"), tuple(recordings), {})
    here = Context.of(case.recordings, case.setting, SIMULATOR, USUAL)
    there, fit = here.read_otherwise(), case.fit()
    return there.is_likelier(there.by_row.first_fit(fit.hypothesis, fit.levels), here, fit)


@pytest.mark.parametrize("every", [1, 2])
def test_a_log_that_is_slower_than_the_controller_is_recognised(every: int, fresh_seed: int):
    """Single commands of one joint shake the other joint too, which noise of the sensors does not."""
    logged = shaken_pendulums(np.random.default_rng(fresh_seed), (0.0, 0.0, 0.0))
    slower = [replace(thinned(one, np.arange(0, len(one), every)), periods=1) for one in logged]
    assert otherwise_is_likelier(slower) == (every > 1)


def test_held_commands_that_were_taken_for_means_are_read_as_held_again(fresh_seed: int):
    logged = shaken_pendulums(np.random.default_rng(fresh_seed), (0.0, 0.0, 0.0))
    assert otherwise_is_likelier([replace(one, periods=2) for one in logged])


@pytest.mark.parametrize("seed", [0, 7, None])  # of the first two, all recordings together are likelier as slow logs
def test_what_shakes_one_recording_only_is_no_slow_log(seed: int | None, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed if seed is None else seed)
    assert not otherwise_is_likelier(shaken_pendulums(rng, (0.3, 0.0, 0.0, 0.0, 0.0)))
