"""What is drawn has fewer points than what was recorded, and hides nothing."""

from dataclasses import replace

import numpy as np
from report.synthetic import trace

from wipx.report.traces import break_at_restarts, decimate, improvement, prediction_error, restart_rows


def test_decimation_keeps_extremes_of_recordings_and_commands():
    whole = trace("long.csv", held_out=True, rows=40_000, rate=650.0)
    spiked = whole.recorded["x"].copy()
    spiked[12_345] = 9.0
    whole = replace(whole, recorded={**whole.recorded, "x": spiked})
    shown = decimate(whole, 4000)
    assert len(shown.t) <= 4300  # the limit and two rows for each of the 123 restarts
    assert shown.recorded["x"].max() == 9.0
    assert shown.recorded["theta"].min() == whole.recorded["theta"].min()
    assert np.all(np.diff(shown.t) > 0.0)


def test_short_traces_are_drawn_whole():
    whole = trace("short.csv", held_out=False)
    assert decimate(whole, 4000) is whole


def test_decimation_survives_holes_of_missing_samples():
    whole = trace("holes.csv", held_out=False, rows=20_000)
    holed = whole.recorded["x"].copy()
    holed[2000:9000] = np.nan
    shown = decimate(replace(whole, recorded={**whole.recorded, "x": holed}), 1000)
    assert np.isnan(shown.recorded["x"]).any()
    assert np.nanmax(shown.recorded["x"]) == np.nanmax(holed)


def test_predictions_break_at_every_restart_and_recordings_do_not():
    whole = trace("r.csv", held_out=False)
    shown = break_at_restarts(whole)
    restarts = len(whole.starts) - 1  # the first start begins the trace
    assert np.isnan(shown.completed["x"]).sum() == restarts
    assert np.isnan(shown.recorded["x"]).sum() == 0
    for start in whole.starts[1:]:
        first, second = np.flatnonzero(np.abs(shown.t - start) < 1e-9)
        assert np.isnan(shown.nominal["theta"][first])
        assert not np.isnan(shown.nominal["theta"][second])


def test_restarts_outside_the_trace_are_ignored():
    whole = replace(trace("r.csv", held_out=False), starts=np.array([-1.0, 0.0, 2.0, 99.0]))
    assert restart_rows(whole).tolist() == [200]


def test_errors_leave_out_rows_without_prediction_or_sample():
    whole = trace("r.csv", held_out=False, rows=4)
    recorded, predicted = np.array([0.0, np.nan, 0.0, 0.0]), np.array([np.nan, 1.0, 3.0, 4.0])
    whole = replace(whole, recorded={"x": recorded}, nominal={"x": predicted})
    assert np.isclose(prediction_error(whole, whole.nominal)["x"], np.sqrt(12.5))


def test_improvement_is_positive_where_the_completed_model_predicts_better():
    better = trace("r.csv", held_out=False)
    assert improvement(better) > 0.0
    assert improvement(replace(better, nominal=better.completed, completed=better.nominal)) < 0.0
