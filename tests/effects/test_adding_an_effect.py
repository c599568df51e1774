"""A law that stands in one place is simulated, diagnosed, drawn, named and exported like all others."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis.recorded import SIMULATOR, recorded
from identify.emulated_robot import nominal_model
from sim.robots import move, robot, row_forces, unit_axis

from wipx.core.diagnosis import Diagnosis
from wipx.core.effect import JOINT_SITES, Effect, Steady
from wipx.core.errors import InputError
from wipx.core.parameters import Parameter
from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.effects.catalogue import kinds, registered, vocabulary
from wipx.effects.words import effect_in_words
from wipx.recordings.model_file import read_model, write_model
from wipx.report.diagnosis_summary import summary

RATCHET = Effect(
    kind="ratchet",
    words="ratchet on {place}",
    sites=JOINT_SITES,
    parameters=(Parameter("F_r", "level while v > 0", "force", 0.0, 0.0, 1.0, 0.02, grid=(0.02, 0.1)),),
    law="-F_r for v > 0, any force in [-F_r, 0] at v = 0",
    source="made up for this test",
    rows={"LEVEL_PLUS": lambda p, body: p["F_r"]},
    parts=("FRICTION",),
    steady=Steady("rate", lambda rate, p, body: np.where(rate > 0.0, -p["F_r"], 0.0)),
    linear_in=("F_r",),
    excludes=("coulomb", "asymmetric_coulomb", "stribeck", "presliding"),
)
NAME, LEVEL = "translation/ratchet", 0.5


@pytest.fixture(scope="module", autouse=True)
def law() -> Iterator[None]:
    with registered(RATCHET):
        yield


@pytest.fixture(scope="module")
def answer() -> Diagnosis:
    recordings = recorded("linear_axis", {NAME: {"F_r": LEVEL}}, 11)
    return diagnose(recordings, KnownRobot(nominal_model("linear_axis"), {}), SIMULATOR)


@pytest.mark.parametrize(("speed", "force"), [(0.7, -LEVEL), (-0.7, 0.0)])
def test_it_is_simulated(speed: float, force: float):
    t = np.linspace(0.0, 0.1, 51)
    motion = move(unit_axis({NAME: {"F_r": LEVEL}}), (0.0, speed), t, np.zeros(50))
    np.testing.assert_allclose(row_forces(motion), force, atol=1e-11)  # round-off of differences of speeds


def test_it_acts_on_the_joint_that_it_is_at():
    t = np.linspace(0.0, 0.4, 201)
    falling = (1.0, 0.0)  # to positive angles
    free = move(robot("pendulum"), falling, t, np.zeros(200))
    held = move(robot("pendulum", {"pitch/ratchet": {"F_r": 100.0}}), falling, t, np.zeros(200))
    assert free.q[-1, 0] > 1.1
    np.testing.assert_allclose(held.q[:, 0], 1.0, atol=1e-12)


def test_it_is_diagnosed(answer: Diagnosis):
    (effect,) = answer.effects
    assert effect.name == NAME
    assert effect.value("F_r") == pytest.approx(LEVEL, rel=0.02)


def test_it_is_drawn(answer: Diagnosis):
    curve = answer.effects[0].curve
    assert curve is not None
    np.testing.assert_allclose(curve.law[curve.at > 0.0], -answer.effects[0].value("F_r"))
    np.testing.assert_allclose(curve.law[curve.at < 0.0], 0.0)


def test_it_is_named(answer: Diagnosis):
    assert effect_in_words(NAME, "linear_axis") == "ratchet on the axis's rail"
    assert "Ratchet on the axis's rail" in summary(answer)


def test_it_is_exported(answer: Diagnosis, tmp_path: Path):
    path = tmp_path / "model.yaml"
    write_model(answer.model, path)
    assert read_model(path).effects == answer.model.effects


def test_it_is_known_as_long_as_it_is_registered():
    with registered(replace(RATCHET, kind="pawl")):
        assert "joint2/pawl" in vocabulary(robot("double_pendulum").plant)
    assert "pawl" not in kinds()
    with pytest.raises(InputError, match="one of that kind already"), registered(RATCHET):
        pass
