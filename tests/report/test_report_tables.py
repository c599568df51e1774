"""The outcome in words and tables says what the result holds."""

from dataclasses import replace

import numpy as np
from report import synthetic

from wipx.core.results import FitErrors
from wipx.report.outcome import headline, judged_errors, remark, signal_errors
from wipx.report.tables import markdown, summary


def test_headline_gives_errors_on_held_out_recordings_with_units():
    assert headline(synthetic.result()) == (
        "Prediction error over 0.5 s on held-out recordings: x 21.0 -> 2.10 mm, theta 33.6 -> 3.36 mrad"
        " (sensor-noise floor 0.800 mm, 1.28 mrad)"
    )


def test_headline_admits_that_nothing_was_held_out():
    assert "none were held out" in headline(synthetic.without_held_out())


def test_signals_keep_one_unit_in_fit_and_held_out():
    rows = signal_errors(synthetic.result())
    assert [row.recordings for row in rows] == ["held-out", "held-out", "fit", "fit"]
    assert {(row.signal, row.scale.unit) for row in rows} == {("x", "mm"), ("theta", "mrad")}


def test_a_worse_or_failing_model_is_called_so():
    failed = FitErrors(0.5, 3, {"x": 0.01, "theta": np.inf}, {"x": 0.03, "theta": np.nan}, {})
    x, theta = judged_errors(replace(synthetic.result(), held_out=failed))
    assert (x.change, x.worse, x.above_floor) == ("3.0 times larger", True, "")
    assert (theta.change, theta.worse) == ("completed model fails to predict", True)


def test_remarks_name_bounds_doubt_and_missing_intervals():
    remarks = [remark(estimate) for estimate in synthetic.result().estimates]
    assert remarks[:2] == ["", ""]
    assert "not significant" in remarks[2]
    assert "at a bound" in remarks[3]
    assert "do not determine" in remarks[4]


def test_a_table_keeps_hostile_text_inside_its_cell():
    lines = markdown(("name", "value"), [("a | b <script>\nc", "1")], numbers=(1,)).splitlines()
    assert lines == ["| name | value |", "| --- | ---: |", "| a \\| b &lt;script&gt; c | 1 |"]


def test_summary_is_aligned_and_complete():
    text = summary(synthetic.result())
    head, first = (line for line in text.splitlines() if line.startswith(("recordings", "held-out    x")))
    assert head.index("completed") + len("completed") == first.index("2.10") + len("2.10")
    assert "translation/coulomb.F_c" in text
    assert "[2.93, 3.29]" in text
    assert "note: actuator/backlash.gap" in text
    assert text.endswith("drop the effect.")


def test_summary_without_estimates_has_no_empty_table():
    assert "95 % interval" not in summary(replace(synthetic.result(), estimates=()))
