"""Numbers are written as an engineer would write them."""

import math

import pytest

from wipx.report.numbers import compact, scale_for, significant, with_interval


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.1, "2.10"),
        (9.996, "10.0"),
        (-0.03456, "-0.0346"),
        (1234.0, "1230"),
        (0.0, "0"),
        (2.345e-6, "2.35e-6"),
        (4.2e7, "4.20e7"),
        (math.nan, "-"),
        (math.inf, "inf"),
    ],
)
def test_significant_keeps_three_digits(value, text):
    assert significant(value) == text


def test_compact_drops_trailing_zeros_only_behind_the_point():
    assert compact(2.6) == "2.6"
    assert compact(650.0) == "650"
    assert compact(0.0023) == "0.0023"
    assert compact(3e-7) == "3e-7"


def test_interval_decides_the_digits():
    wide, narrow = with_interval(3.1042, 2.93, 3.29), with_interval(3.1042, 3.1035, 3.1049)
    assert (wide.value, wide.ends) == ("3.10", "[2.93, 3.29]")
    assert (narrow.value, narrow.ends) == ("3.1042", "[3.1035, 3.1049]")


def test_interval_of_a_tiny_number_shares_one_exponent():
    shown = with_interval(2.3e-6, 2.1e-6, 2.5e-6)
    assert (shown.value, shown.ends) == ("2.30e-6", "[2.10e-6, 2.50e-6]")


def test_interval_around_zero_has_no_negative_zero():
    shown = with_interval(0.05, -0.0001, 0.2)
    assert (shown.value, shown.ends) == ("0.05", "[0.00, 0.20]")


def test_an_interval_far_wider_than_the_value_does_not_hide_it():
    shown = with_interval(-0.001, -0.2, 0.2)
    assert (shown.value, shown.ends) == ("-0.0010", "[-0.20, 0.20]")


def test_interval_of_no_width_keeps_the_value():
    assert with_interval(3.0, 3.0, 3.0).value == "3.0000"


def test_interval_without_ends_is_said_to_be_unbounded_or_missing():
    assert with_interval(3.1042, -math.inf, math.inf).ends == "[-inf, inf]"
    assert with_interval(3.1042, math.nan, math.nan).ends == "-"


def test_prefix_suits_errors_of_very_different_size():
    assert scale_for([1.2, 0.002], "m").unit == "mm"
    assert scale_for([0.3, 0.4], "rad").unit == "rad"
    assert scale_for([2e-5], "m").unit == "\N{MICRO SIGN}m"


def test_units_that_take_no_prefix_stay():
    assert scale_for([1e-3], "kg m^2").unit == "kg m^2"
    assert scale_for([0.0, math.nan], "m").unit == "m"
