"""Magnetic variation against published test values of the World Magnetic Model."""

import numpy as np
import pytest

from steerway.core.testing import model_of, variation

YEAR = 365.2425 * 86400.0


# NOAA's and BGS's test values for WMM2020 and WMM2025 at height 0: decimal year, latitude, longitude, declination.
@pytest.mark.parametrize(
    "year, lat, lon, declination_deg",
    [
        (2020.0, 80.0, 0.0, -1.28),
        (2020.0, 0.0, 120.0, 0.16),
        (2020.0, -80.0, 240.0, 69.36),
        (2025.0, 80.0, 0.0, 1.28),
        (2025.0, 0.0, 120.0, -0.16),
        (2025.0, -80.0, 240.0, 68.78),
    ],
)
def test_published_values(year, lat, lon, declination_deg):
    found = np.degrees(variation(np.radians(lat), np.radians(lon), (year - 1970.0) * YEAR))
    np.testing.assert_allclose(found, declination_deg, atol=0.02)


def test_the_model_of_its_time():
    assert [model_of((year - 1970.0) * YEAR) for year in (1990.0, 2012.0, 2019.9, 2020.1, 2040.0)] == [
        2010,
        2010,
        2015,
        2020,
        2025,
    ]
    assert model_of(np.nan) == 2025


def test_unknown_place_is_unknown_and_far_dates_do_not_raise():
    found = variation([np.nan, 0.9, 0.9], [0.1, 0.1, 0.1], [1.7e9, np.nan, -1e9])
    assert np.isnan(found[0]) and np.isfinite(found[1:]).all()
