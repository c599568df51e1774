"""Effects at other sites that may do what one of a fit does."""

from pathlib import Path

import numpy as np
import pytest
from diagnosis.recorded import Bench
from diagnosis.recorded_arm import arm, recorded

from wipx.core.model import Model, ModelBatch
from wipx.core.recording import Recording
from wipx.diagnosis.candidates.stand_ins import stand_ins
from wipx.diagnosis.selection.criteria import evidence
from wipx.diagnosis.selection.fit_store import FitStore
from wipx.diagnosis.selection.robot_search import RobotSearch, parts_of
from wipx.recordings.robot_file import robot_from_mapping
from wipx.sim.analytic import AnalyticSimulator
from wipx.sim.inputs import Inputs

CART = """<mujoco><worldbody><body name="cart"><inertial pos="0 0 0.1" mass="0.5" diaginertia="0.01 0.01 0.01"/>
<joint name="slide" type="slide" axis="1 0 0" damping="0.3"/></body></worldbody></mujoco>"""
PENDULUM = """<mujoco><worldbody><body name="rod"><inertial pos="0 0 -0.2" mass="0.5" diaginertia="0.01 0.01 0.001"/>
<joint name="pivot" axis="0 1 0" damping="0.02"/></body></worldbody></mujoco>"""
SAME_MOTION = {
    "mass": (CART, {"link_cart/payload": {"mass": 0.1, "x": 0.02, "y": 0.0, "z": 0.1}}, "slide/rotor_inertia"),
    "rotor": (CART, {"slide/rotor_inertia": {"J": 0.1}}, "link_cart/payload"),
    "lean": (PENDULUM, {"environment/base_tilt": {"roll": 0.0, "pitch": 0.04}}, "sensor_pivot/bias"),
    "bias": (PENDULUM, {"sensor_pivot/bias": {"b": 0.04}}, "environment/base_tilt"),
}


def robot(mjcf: str, folder: Path) -> Model:
    """A robot of one joint."""
    (folder / "robot.xml").write_text(mjcf, encoding="utf-8")
    return robot_from_mapping({"plant": "robot", "model": "robot.xml"}, "robot.yaml", folder).model


def shaken(model: Model, seed: int) -> Recording:
    """Ten seconds of one joint under slow and fast waves."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 10.0, 0.004)
    wave = np.sin(2.0 * np.pi * np.array([0.4, 0.9, 1.7])[:, None] * t + rng.uniform(0.0, 6.3, (3, 1))).sum(axis=0)
    run = AnalyticSimulator().replay(ModelBatch(model), Inputs.of([t], [0.3 * wave[:, None]], [0]), np.zeros((2, 1, 1)))
    joint = model.plant.joints[0]
    q = run.coordinates[:, 0, 0, 0] + 2e-5 * rng.normal(size=len(t))
    return Recording("r1.csv", {"t": t, joint: q, f"u_{joint}": 0.3 * wave})


@pytest.mark.parametrize("case", SAME_MOTION)
def test_what_moves_a_robot_alike_is_proposed_and_fits_as_well(case: str, tmp_path: Path, fresh_seed: int):
    mjcf, hidden, other = SAME_MOTION[case]
    model = robot(mjcf, tmp_path)
    bench = Bench(model, (shaken(model.with_effects(hidden), fresh_seed),), {})
    effect, nominal = next(iter(hidden)), bench.fit()
    search = RobotSearch.of(FitStore.of(bench.fitter, bench.setting, nominal), nominal)
    fit = bench.fit(effect)
    ((part, own),) = search.split(fit, with_stand_ins=True)
    assert other in part.store.elsewhere[effect]
    rival = next(found for found in part.store.replacements(own, effect) if found.effects == (other,))
    assert abs(evidence(rival, own)) < 3.0
    ((alone, own),) = search.split(fit)
    assert all(found.effects != (other,) for found in alone.store.replacements(own, effect))


def test_what_moves_an_arm_otherwise_is_not_proposed(tmp_path: Path, fresh_seed: int):
    """Friction of one joint and a load that gravity pulls."""
    model = arm(tmp_path)
    hidden = {"elbow/coulomb": {"F_c": 0.04}, "link_lower/payload": {"mass": 0.1, "x": 0.01, "y": 0.02, "z": -0.25}}
    bench = Bench(model, (recorded(model.with_effects(hidden), fresh_seed),), {})
    found = stand_ins(bench.fitter, bench.setting, bench.fit(*hidden), parts_of(model.plant))
    assert found == {"elbow/coulomb": (), "link_lower/payload": ()}
