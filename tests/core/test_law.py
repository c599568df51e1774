"""The polynomials that stand in for calls into the mathematics library."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wipx.core.law import clip, decay, maximum, minimum, relaxing, sign, sin_cos, turns

NUMBERS = st.floats(-1e6, 1e6)


@given(angle=st.floats(-1e3, 1e3))
def test_sine_and_cosine_are_exact_to_1e_12(angle: float):
    sine, cosine = sin_cos(angle)
    assert sine == pytest.approx(math.sin(angle), rel=0.0, abs=1e-12)  # stated in the law
    assert cosine == pytest.approx(math.cos(angle), rel=0.0, abs=1e-12)


@given(angle=st.floats(-100.0, 100.0))
def test_sine_and_cosine_lie_on_the_circle(angle: float):
    sine, cosine = sin_cos(angle)
    assert sine * sine + cosine * cosine == pytest.approx(1.0, abs=1e-12)
    assert sin_cos(-angle) == (-sine, cosine)


def test_sine_and_cosine_are_exact_at_rest():
    assert sin_cos(0.0) == (0.0, 1.0)


@given(y=st.floats(0.0, 40.0))
def test_decay_is_the_exponential_to_1e_11(y: float):
    assert decay(y) == pytest.approx(math.exp(-y), rel=1e-11)  # stated in the law


@given(y=st.floats(40.0, 1e12))
def test_decay_is_constant_and_nil_beyond_40(y: float):
    assert decay(y) == decay(40.0) < 1e-17


@given(y=st.floats(0.0, 40.0))
def test_relaxing_gives_the_exponential_and_its_mean(y: float):
    kept, mean = relaxing(y)
    assert kept == decay(y)
    exact = -math.expm1(-y) / y if y > 0.0 else 1.0
    assert mean == pytest.approx(exact, rel=1e-10)  # first term left out of the series: 0.02^5 / 720 = 4e-12


def test_relaxing_is_continuous_where_its_series_ends():
    below, above = relaxing(0.02 * (1.0 - 1e-15)), relaxing(0.02)
    assert below[1] == pytest.approx(above[1], rel=1e-11)


@given(a=NUMBERS, b=NUMBERS, low=NUMBERS)
def test_selects_are_those_of_python(a: float, b: float, low: float):
    assert minimum(a, b) == min(a, b)
    assert maximum(a, b) == max(a, b)
    high = low + 1.0
    assert clip(a, low, high) == min(max(a, low), high)
    assert sign(a) == (a > 0.0) - (a < 0.0)


@given(angle=NUMBERS)
def test_turns_leave_half_a_turn_at_most(angle: float):
    assert turns(angle) == int(turns(angle))
    assert abs(angle - turns(angle) * 2.0 * math.pi) <= math.pi * (1.0 + 1e-9)
