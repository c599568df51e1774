"""Tables of controllers: improvement over the baseline, failures, and the way from the reality gap to control."""

import numpy as np
import pytest
from report.control_results import result

from wipx.report.control_table import (
    CONTROLLERS_HEAD,
    METHODS_HEAD,
    PAYLOADS_HEAD,
    Improvement,
    controller_rows,
    estimate_error,
    improvement,
    method_rows,
    payload_rows,
    tables,
)

BASELINE, OURS = result("lqr", heavy_stops=True), result("lqr_equilibrium", (0.5, 0.3), off=0.01)


def test_improvement_is_that_of_mean_errors_and_ranges_over_pairs_of_trials():
    found = Improvement.of([np.array([1.0, 2.0]), np.array([4.0])], [np.array([0.5, 1.0]), np.array([1.0])])
    assert found.mean == pytest.approx(0.5 * (50.0 + 75.0))
    assert (found.low, found.high) == pytest.approx((50.0, 75.0))
    worse = Improvement.of([np.array([1.0])], [np.array([1.5])])
    assert worse.mean == pytest.approx(-50.0)


def test_one_row_for_each_payload_and_one_for_all_beside_the_papers_figures():
    rows = payload_rows(BASELINE, OURS)
    assert [row[1] for row in rows] == ["-0.03", "-0.16", "all"]
    assert all(len(row) == len(PAYLOADS_HEAD) for row in rows)
    light, heavy, both = rows
    assert light[4] == "64 [50, 75]"
    assert heavy[9] == "2, 0 of 2"
    assert both[-1] == "38, 23"
    assert light[-1] == heavy[-1] == "-"


def test_the_papers_pitch_error_is_measured_from_what_a_controller_aims_at():
    # The baseline stands near its balance but aims at zero; ours aims at its balance.
    paper, true = (improvement(BASELINE, OURS, error, ["b5"]).mean for error in ("rmse_target", "rmse_pitch"))
    assert true == pytest.approx(100.0 * (1.0 - 0.04 / 0.11))
    before, after = (
        [abs(-0.16 + 0.1 * e - aim) for e in errors] for errors, aim in (((1.0, 1.2), 0.0), ((0.5, 0.3), -0.15))
    )
    assert paper == pytest.approx(100.0 * (1.0 - np.mean(after) / np.mean(before)))


def test_the_baseline_is_not_compared_with_itself():
    rows = controller_rows(BASELINE, [BASELINE, OURS])
    assert all(len(row) == len(CONTROLLERS_HEAD) for row in rows)
    assert rows[0][2:4] == ("2 of 4", "2 of 4")
    assert rows[0][6] == "-"
    assert rows[1][2:5] == ("0 of 4", "4 of 4", "2.0 [2.0, 2.0]")


def test_methods_show_gap_estimate_and_control_in_one_row():
    results = [
        result("lqr_equilibrium", (error, error), method=method, seed=seed, off=off)
        for method, error, off in (("pure_sim", 0.9, 0.03), ("ours", 0.4, 0.004))
        for seed in (0, 1)
    ]
    rows = method_rows(results)
    assert [row[0] for row in rows] == ["pure_sim", "ours"]
    assert all(len(row) == len(METHODS_HEAD) for row in rows)
    assert rows[0][3] == "0.0300 +- 0"
    assert estimate_error(results[0]) == pytest.approx(0.03)
    assert np.isnan(estimate_error(BASELINE))


def test_tables_are_markdown_and_latex():
    markdown, latex = tables(METHODS_HEAD, method_rows([OURS]))
    assert markdown.startswith("| simulation |")
    assert r"\begin{tabular}" in latex
