"""Magnetic variation against published test values of the World Magnetic Model."""

import numpy as np

from steerway.core.testing import model_of, variation

YEAR = 365.2425 * 86400.0


def test_published_values():
    """NOAA's and BGS's test values for WMM2020 and WMM2025 at height 0."""
    for year, declinations in ((2020.0, [-1.28, 0.16, 69.36]), (2025.0, [1.28, -0.16, 68.78])):
        found = variation(np.radians([80.0, 0.0, -80.0]), np.radians([0.0, 120.0, 240.0]), (year - 1970.0) * YEAR)
        np.testing.assert_allclose(np.degrees(found), declinations, atol=0.02)


def test_the_model_of_its_time():
    years = {1990.0: 2010, 2012.0: 2010, 2019.9: 2015, 2020.1: 2020, 2040.0: 2025}
    assert {year: model_of((year - 1970.0) * YEAR) for year in years} == years
    assert model_of(np.nan) == 2025


def test_unknown_place_is_unknown_and_far_dates_do_not_raise():
    found = variation([np.nan, 0.9, 0.9], [0.1, 0.1, 0.1], [1.7e9, np.nan, -1e9])
    assert np.isnan(found[0]) and np.isfinite(found[1:]).all()
