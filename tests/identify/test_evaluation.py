"""Judging models: what is asked again is answered as the first time, and never for another question."""

from dataclasses import replace

import numpy as np
import pytest
from identify.emulated_robot import Robot, nominal_model

from wipx.identify.evaluation import Judge
from wipx.identify.noise import sensor_noise
from wipx.sim.analytic import AnalyticSimulator

SIMULATOR = AnalyticSimulator(threads=1)


def test_a_judge_answers_each_question_as_a_new_one_does(fresh_seed: int):
    nominal = nominal_model("pendulum")
    recordings = Robot(nominal, 3.0).record(np.random.default_rng(fresh_seed), 2)
    rough = nominal.with_effects({"pitch/coulomb": {"F_c": 0.2}})
    rougher = nominal.with_effects({"pitch/coulomb": {"F_c": 0.3}})
    judge = Judge(SIMULATOR, sensor_noise(recordings, nominal.plant), 0.5)
    trusting = replace(judge, bandwidths={"theta": 3.0})
    for each, model, some in [
        (judge, rough, recordings),
        (judge, rougher, recordings),
        (judge, rough, recordings[:1]),
        (trusting, rough, recordings),
        (judge, rough, recordings),
    ]:
        new = Judge(SIMULATOR, judge.noise, 0.5, each.bandwidths)
        errors, _ = each.compare(nominal, model, some, held_out=True)
        assert errors == new.compare(nominal, model, some, held_out=True)[0]
        assert each.tuned(model, some).bandwidths == new.tuned(model, some).bandwidths


def test_a_judge_does_not_compute_an_answer_twice(monkeypatch: pytest.MonkeyPatch, fresh_seed: int):
    nominal = nominal_model("pendulum")
    recordings = Robot(nominal, 2.0).record(np.random.default_rng(fresh_seed), 1)
    judge = Judge(SIMULATOR, sensor_noise(recordings, nominal.plant), 0.5)
    first = judge.compare(nominal, nominal, recordings, held_out=True)
    monkeypatch.setattr(AnalyticSimulator, "replay", None)
    assert judge.compare(nominal, nominal, recordings, held_out=True) is first
