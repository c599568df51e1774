"""The search over noise levels: it ends at a peak, wherever it starts."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from identify.stiff_arm import motion, stiff_arm

from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.likelihood.innovations import LEVEL_STEPS, InnovationFitter
from wipx.diagnosis.likelihood.observer import NoiseLevels
from wipx.diagnosis.rules import USUAL
from wipx.identify.parameter_space import scales_of
from wipx.proof.blind.drawing import draw_files
from wipx.proof.blind_robots.write import write_files
from wipx.recordings.source import RecordingSource
from wipx.sim.analytic import AnalyticSimulator

pytest.importorskip("mujoco")
FACTORS = (1e-2, 1.0, 30.0)  # of the usual first guess of the forces on a joint
ALIKE = 10.0  # nats, of which a level that is off by a factor of ten loses hundreds
HARD = 3  # seed of a robot on which steps of all joints' levels at once end 31 nats below a peak


def test_noise_levels_of_joints_are_found_from_anywhere(tmp_path: Path, fresh_seed: int):
    arm, rng = stiff_arm(tmp_path, kd=0.5), np.random.default_rng(fresh_seed)
    recordings = tuple(motion(arm, rng)[0] for _ in range(2))
    setting = Setting(arm, {}, scales_of(arm, recordings))
    context = Context.of(recordings, setting, AnalyticSimulator(threads=1), USUAL)
    fitter, first = context.by_row, context.first_levels
    right = Hypothesis.of(setting, (), {})
    starts = [replace(first, force=first.force * factors) for factors in product(FACTORS, repeat=len(first.force))]
    fits = [fitter.fit(right, start) for start in starts]
    reached = [fitter.fit(right, fitter.levels_of(fit, afresh=True)).log_likelihood for fit in fits]
    assert max(reached) - min(reached) < ALIKE


def best_single_change(fitter: InnovationFitter, hypothesis: Hypothesis, levels: NoiseLevels) -> float:
    """What the best change of one joint's level by the search's first step gains [nats]."""
    step = np.exp(max(LEVEL_STEPS))
    joints = np.eye(len(levels.force), dtype=bool)
    changed = [
        replace(levels, force=levels.force * np.where(one, by, 1.0)) for one in joints for by in (1 / step, step)
    ]
    totals = [found.sum() for found in fitter.likelihoods(hypothesis, [levels, *changed])]
    return max(totals[1:]) - totals[0]


@pytest.mark.slow
def test_no_joint_alone_is_left_at_a_wrong_level(tmp_path: Path):
    rng = np.random.default_rng(HARD)
    write_files(tmp_path, draw_files(rng, "tree_nothing", (3.0, 3.5), 5).visible)
    source = RecordingSource(str(tmp_path))
    model, recordings = source.describe().model, source.load()[:2]
    setting = Setting(model, {}, scales_of(model, recordings))
    context = Context.of(recordings, setting, AnalyticSimulator(threads=1), USUAL)
    fitter, first = context.by_row, context.first_levels
    right = Hypothesis.of(setting, (), {})
    for _ in range(3):
        start = replace(first, force=first.force * np.exp(rng.uniform(-4.0, 4.0, len(first.force))))
        assert best_single_change(fitter, right, fitter.levels_of(fitter.fit(right, start), afresh=True)) < ALIKE
