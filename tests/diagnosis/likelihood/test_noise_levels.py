"""The search over noise levels: where it ends does not depend on where it starts."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from identify.stiff_arm import motion, stiff_arm

from wipx.diagnosis.decision.context import Context
from wipx.diagnosis.likelihood.hypothesis import Hypothesis, Setting
from wipx.diagnosis.rules import USUAL
from wipx.identify.parameter_space import scales_of
from wipx.sim.analytic import AnalyticSimulator

pytest.importorskip("mujoco")
FACTORS = (1e-2, 1.0, 30.0)  # of the usual first guess of the forces on a joint
ALIKE = 10.0  # nats, of which a level that is off by a factor of ten loses hundreds


def test_noise_levels_of_joints_are_found_from_anywhere(tmp_path: Path, fresh_seed: int):
    arm, rng = stiff_arm(tmp_path, kd=0.5), np.random.default_rng(fresh_seed)
    recordings = tuple(motion(arm, rng)[0] for _ in range(2))
    setting = Setting(arm, {}, scales_of(arm, recordings))
    context = Context.of(recordings, setting, AnalyticSimulator(threads=1), USUAL)
    fitter, first = context.by_row, context.first_levels
    right = Hypothesis.of(setting, (), {})
    starts = [replace(first, force=first.force * factors) for factors in product(FACTORS, repeat=len(first.force))]
    reached = [fitter.fit(right, fitter.levels_of(fitter.fit(right, start))).log_likelihood for start in starts]
    assert max(reached) - min(reached) < ALIKE
