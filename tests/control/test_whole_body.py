"""A humanoid on wheels: where it balances, that the regulator of its whole body holds it, and what it carries."""

from pathlib import Path

import numpy as np
import pytest

from wipx.control.hand_payload import HandPayload
from wipx.control.linearise import linearise_about
from wipx.control.posture_balance import balance
from wipx.control.whole_body import WholeBodyLqr
from wipx.core.errors import InputError
from wipx.core.model import ModelBatch
from wipx.core.posture import posture
from wipx.recordings.robot_file import read_robot
from wipx.sim.inputs import Inputs
from wipx.sim.mujoco import MujocoSimulator

ROBOT = Path(__file__).parents[2] / "wipx" / "robots" / "humanoid" / "robot.yaml"
POSTURE = {
    "knee": -0.9,
    "hip": 0.6,
    "left_shoulder": -0.4,
    "left_elbow": -1.2,
    "right_shoulder": -0.4,
    "right_elbow": -1.2,
}
HAND = HandPayload("right_forearm", (0.0, 0.0, -0.27))
PITCH = 1


@pytest.fixture(scope="module")
def humanoid():
    return read_robot(ROBOT).model


def accelerations(model, positions, commands, lean=0.0):
    """Of all joints from rest by MuJoCo, whose equations are not those of the statics."""
    start = np.concatenate([positions, np.zeros(len(positions))])
    start[PITCH] += lean
    inputs = Inputs.regular(1e-3, 1e3, len(commands))
    inputs = Inputs(inputs.t, inputs.commands + commands[None, :, None], inputs.first, inputs.last)
    run = MujocoSimulator(1e-3).replay(ModelBatch(model), inputs, start[:, None, None])
    return (run.rates[1] - run.rates[0])[:, 0, 0] / 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("mass", [0.0, 1.5])
def test_nothing_accelerates_at_the_balance(humanoid, mass: float):
    model = HAND.loaded(humanoid, mass)
    found = balance(model, POSTURE)
    np.testing.assert_allclose(accelerations(model, found.positions, found.commands), 0.0, atol=1e-6)
    assert np.abs(accelerations(model, found.positions, found.commands, lean=0.01)).max() > 0.05


def test_the_centre_of_mass_is_above_the_axle_and_the_wheels_carry_no_force(humanoid):
    found, tree = balance(humanoid, POSTURE), humanoid.plant.tree
    at = posture(tree, found.positions)
    across = sum(link.mass * at.point(i, link.com)[0] for i, link in enumerate(tree.links))
    assert across == pytest.approx(0.0, abs=1e-9)
    assert found.commands[0] == pytest.approx(0.0, abs=1e-9)


def test_a_small_payload_moves_the_balance_by_its_moment_over_that_of_the_robot(humanoid):
    mass = 1e-3
    moved = balance(HAND.loaded(humanoid, mass), POSTURE).positions[PITCH]
    empty = balance(humanoid, POSTURE)
    tree = humanoid.plant.tree
    at = posture(tree, empty.positions)
    hand = tree.joints.index("right_elbow")
    ahead = at.point(hand, tree.links[hand].body_rotation @ np.array(HAND.place) + tree.links[hand].body_place)[0]
    axle = at.origins[0][2]
    height = sum(link.mass * (at.point(i, link.com)[2] - axle) for i, link in enumerate(tree.links))
    # Second order of a payload of 1 g.
    assert moved - empty.positions[PITCH] == pytest.approx(-mass * ahead / height, rel=1e-3)


def test_the_regulator_stabilises_the_whole_body(humanoid):
    found = balance(humanoid, POSTURE)
    linear = linearise_about(humanoid, found.positions)
    assert np.linalg.eigvals(linear.a).real.max() > 1.0
    closed = linear.a - linear.b @ WholeBodyLqr().gains(humanoid, found)
    assert np.linalg.eigvals(closed).real.max() < -0.3


def test_the_linear_model_is_the_slope_of_simulated_accelerations(humanoid):
    found = balance(humanoid, POSTURE)
    linear = linearise_about(humanoid, found.positions)
    joints = len(found.positions)
    lean = 1e-4
    ahead, behind = (accelerations(humanoid, found.positions, found.commands, s * lean) for s in (1.0, -1.0))
    # Differences over 1 ms of a motion whose fastest rate is about 10 1/s.
    np.testing.assert_allclose((ahead - behind) / (2.0 * lean), linear.a[joints:, PITCH], rtol=0.02, atol=0.05)


def test_the_payload_follows_from_positions_alone(humanoid, fresh_seed: int):
    rng = np.random.default_rng(fresh_seed)
    mass, rows, period = 1.2, 500, 2e-3
    loaded = HAND.loaded(humanoid, mass)
    about = balance(loaded, POSTURE)
    gains = WholeBodyLqr().gains(loaded, about)
    start = np.concatenate([about.positions, np.zeros(len(about.positions))])
    start[PITCH] += 0.02
    still = np.concatenate([about.positions, np.zeros(len(about.positions))])
    run = MujocoSimulator().drive(
        loaded,
        Inputs.regular(rows * period, 1.0 / period, len(about.commands)),
        start,
        lambda _, y: about.commands - gains @ (y - still),
    )
    seen = run.coordinates[:, :, 0, 0] + 1e-4 * rng.normal(size=run.coordinates[:, :, 0, 0].shape)
    found = HAND.estimate(humanoid, seen, period)
    assert found.mass == pytest.approx(mass, abs=0.1)
    assert 0.0 < found.deviation < 0.2


def test_a_posture_must_name_driven_joints(humanoid):
    with pytest.raises(InputError, match="driven joint"):
        balance(humanoid, {"pitch": 0.1})


def test_a_payload_must_hang_on_a_body(humanoid):
    with pytest.raises(InputError, match="right_forearm"):
        HandPayload("tail", (0.0, 0.0, 0.0)).loaded(humanoid, 1.0)
