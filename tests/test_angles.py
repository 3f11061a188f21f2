"""Angles against golden numbers, and what wrapping promises."""

import math

import numpy as np
import pytest

from steerway.core import wrap, wrap_array
from steerway.core.testing import sinc
from tests.golden import assert_golden, golden


def test_wrap_matches_the_golden_rows(shared_data):
    table = golden(shared_data, "ssa")
    assert_golden([wrap(angle) for angle in table["rad_in"]], table["rad_out"])
    assert_golden([math.degrees(wrap(math.radians(angle))) for angle in table["deg_in"]], table["deg_out"])


def test_the_range_is_half_open():
    assert wrap(math.pi) == wrap(-math.pi) == wrap(3.0 * math.pi) == -math.pi
    below = math.nextafter(math.pi, 0.0)
    assert wrap(below) == below


def test_wrapping_keeps_the_direction():
    angles = np.linspace(-30.0, 30.0, 301)
    wrapped = np.array([wrap(angle) for angle in angles])
    assert ((wrapped >= -math.pi) & (wrapped < math.pi)).all()
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-12)
    assert [wrap(angle) for angle in wrapped] == wrapped.tolist()


def test_an_array_is_wrapped_as_its_elements_are():
    angles = [0.2, -math.pi, math.pi, 4.0, -9.0, math.nextafter(-math.pi, -4.0)]
    assert wrap_array([angles, angles]).tolist() == [[wrap(each) for each in angles]] * 2


@pytest.mark.parametrize("angle", [-0.049, 0.01, 0.049, 0.051, 2.0])
def test_sinc_is_its_series(angle):
    ratio = sum((-1) ** k * angle ** (2 * k) / math.factorial(2 * k + 1) for k in range(15))
    slope = sum((-1) ** k * 2 * k * angle ** (2 * k - 1) / math.factorial(2 * k + 1) for k in range(1, 15))
    assert sinc(angle) == pytest.approx((ratio, slope), rel=5e-13)
