"""Masses and tilts of a robot from a model file: where fits start is near the truth, whatever its direction."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from identify.stiff_arm import motion, stiff_arm

from wipx.diagnosis.candidates.screening import Candidate, candidates_of_effect
from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.rules import USUAL
from wipx.identify.parameter_space import scales_of
from wipx.sim.analytic import AnalyticSimulator

pytest.importorskip("mujoco")
CLEAR = 10.0  # nats; chance gains two or three


def first_guess(folder: Path, hidden: str, values: Mapping[str, float], seed: int) -> Candidate:
    nominal, rng = stiff_arm(folder, kd=0.5), np.random.default_rng(seed)
    recordings = tuple(motion(nominal.with_effects({hidden: values}), rng)[0] for _ in range(2))
    setting = Setting(nominal, {}, scales_of(nominal, recordings))
    context = Context.of(recordings, setting, AnalyticSimulator(threads=1), USUAL)
    fit = context.by_row.first_fit(Hypothesis.of(setting, (), {}), context.first_levels)
    return max(candidates_of_effect(context.by_row, setting, fit, hidden), key=lambda candidate: candidate.gain)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_payload_is_looked_for_at_any_place(sign: float, tmp_path: Path, fresh_seed: int):
    hidden = {"mass": 0.05, "x": sign * 0.06, "y": 0.0, "z": -0.12}
    found = first_guess(tmp_path, "link_lower/payload", hidden, fresh_seed)
    guessed = {name.rpartition(".")[2]: value for name, value in found.values.items()}
    assert found.gain > CLEAR
    for axis in ("x", "z"):
        moment = guessed["mass"] * guessed[axis]
        assert moment == pytest.approx(hidden["mass"] * hidden[axis], abs=0.3 * 0.05 * 0.12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tilt_is_looked_for_in_any_direction(sign: float, tmp_path: Path, fresh_seed: int):
    found = first_guess(tmp_path, "environment/base_tilt", {"roll": 0.0, "pitch": sign * 0.01}, fresh_seed)
    assert found.gain > CLEAR
    assert found.values["environment/base_tilt.pitch"] == pytest.approx(sign * 0.01, abs=2e-3)
