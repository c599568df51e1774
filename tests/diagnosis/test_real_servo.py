"""A real servo that is logged for two seconds at a time: no law holds, and single rows do not show it."""

from dataclasses import replace

import pytest
from recordings.test_datasets import source_of

from wipx.diagnosis.pipeline import KnownRobot, diagnose
from wipx.diagnosis.rules import USUAL
from wipx.sim.analytic import AnalyticSimulator


@pytest.mark.slow
def test_what_errs_far_more_than_noise_is_not_consistent():
    source = replace(source_of("bam_xl330"), files=["xl330_*_lift_and_drop.csv"])
    robot = source.describe()
    answer = diagnose(source.load(), KnownRobot(robot.model, robot.uncertainty), AnalyticSimulator())
    assert answer.fit.times_the_floor > USUAL.trust.far_off
    assert answer.verdict == "unexplained"
    assert answer.fit.completed["theta"] < answer.fit.nominal["theta"]
