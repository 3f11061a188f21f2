"""The ellipsoid against golden numbers, and the tangent plane as its own inverse."""

import itertools
import math

import numpy as np
import pytest

from steerway.core import displacement, radii
from steerway.core.testing import displaced
from tests.golden import assert_golden, golden

HEIGHT = 7.0  # of the golden tangent planes above the ellipsoid; a boat's is 0


def test_radii_match_the_golden_rows(shared_data):
    for row in golden(shared_data, "wgs84"):
        assert_golden(radii(row["mu"]), (row["Rm"], row["Rn"]))


def test_the_printed_meridian_radius_is_too_short(shared_data):
    """P0 (34), with √ in the denominator, is R_M √(1 − e² sin² μ): 0.27 % at 63.4°."""
    table = golden(shared_data, "wgs84")
    meridian = np.array([radii(latitude)[0] for latitude in table["mu"]])
    assert_golden(meridian * np.sqrt(1.0 - 0.00669437999014 * np.sin(table["mu"]) ** 2), table["Rm_eq34"])
    latitude = math.radians(63.4)
    assert 1.0 - math.sqrt(1.0 - 0.00669437999014 * math.sin(latitude) ** 2) == pytest.approx(0.0027, abs=5e-5)


def test_displaced_matches_the_golden_rows(shared_data):
    for row in golden(shared_data, "wgs84"):
        meridian, prime_vertical = radii(row["mu"])
        north, east = 1234.5 / (1.0 + HEIGHT / meridian), -987.6 / (1.0 + HEIGHT / prime_vertical)
        assert_golden(displaced(row["mu"], row["l"], north, east), (row["flat2llh_mu"], row["flat2llh_l"]))


def test_displacement_matches_the_golden_rows(shared_data):
    for row in golden(shared_data, "wgs84"):
        meridian, prime_vertical = radii(row["mu"])
        north, east = displacement(row["mu"] - 0.002, row["l"] + 0.001, row["mu"], row["l"])
        scaled = north * (1.0 + HEIGHT / meridian), east * (1.0 + HEIGHT / prime_vertical)
        assert_golden(scaled, (row["llh2flat_xn"], row["llh2flat_yn"]))


def test_displacement_undoes_displaced_across_the_antimeridian():
    for here in itertools.product(np.radians([-80.0, -33.0, 0.0, 63.4, 85.0]), np.radians([-180.0, 0.0, 179.9999])):
        for north, east in [(30.0, 40.0), (-30.0, 40.0), (30.0, -40.0)]:
            latitude, longitude = displaced(*here, north, east)
            assert -math.pi <= longitude < math.pi
            np.testing.assert_allclose(displacement(latitude, longitude, *here), (north, east), atol=2e-8)


def test_a_minute_of_latitude_is_a_nautical_mile():
    north, _ = displacement(math.radians(45.0 + 1.0 / 60.0), 0.0, math.radians(45.0), 0.0)
    assert north == pytest.approx(1852.0, abs=1.0)
