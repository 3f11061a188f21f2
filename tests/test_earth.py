"""Angles, places and motion on the earth, and magnetic variation: against closed forms and published values."""

import itertools
import math

import numpy as np
import pytest

from steerway.core import displacement, radii, wrap, wrap_array
from steerway.core.testing import (
    KNOT,
    GroundMotion,
    course_per_heading,
    displaced,
    heading_for,
    in_body,
    model_of,
    over_ground,
    sinc,
    turning_rate,
    variation,
    water_speed_for,
)
from tests.golden import assert_golden, golden

HEIGHT = 7.0  # of the golden tangent planes above the ellipsoid; a boat's is 0


def test_radii_and_displacements_match_the_golden_rows(shared_data):
    table = golden(shared_data, "wgs84")
    for row in table:
        meridian, prime_vertical = radii(row["mu"])
        assert_golden((meridian, prime_vertical), (row["Rm"], row["Rn"]))
        scale = np.array([1.0 + HEIGHT / meridian, 1.0 + HEIGHT / prime_vertical])
        there = displaced(row["mu"], row["l"], *((1234.5, -987.6) / scale))
        assert_golden(there, (row["flat2llh_mu"], row["flat2llh_l"]))
        way = displacement(row["mu"] - 0.002, row["l"] + 0.001, row["mu"], row["l"])
        assert_golden(way * scale, (row["llh2flat_xn"], row["llh2flat_yn"]))
        # P0 (34), with √ in the denominator, is R_M √(1 − e² sin² μ), which is too short.
        assert_golden(meridian * math.sqrt(1.0 - 0.00669437999014 * math.sin(row["mu"]) ** 2), row["Rm_eq34"])


def test_displacement_undoes_displaced_across_the_antimeridian():
    for here in itertools.product(np.radians([-80.0, -33.0, 0.0, 63.4, 85.0]), np.radians([-180.0, 0.0, 179.9999])):
        for north, east in [(30.0, 40.0), (-30.0, 40.0), (30.0, -40.0)]:
            latitude, longitude = displaced(*here, north, east)
            assert -math.pi <= longitude < math.pi
            np.testing.assert_allclose(displacement(latitude, longitude, *here), (north, east), atol=2e-8)


def test_a_minute_of_latitude_is_a_nautical_mile():
    north, _ = displacement(math.radians(45.0 + 1.0 / 60.0), 0.0, math.radians(45.0), 0.0)
    assert north == pytest.approx(1852.0, abs=1.0) and 3600.0 * KNOT == pytest.approx(1852.0)


def test_wrap_matches_the_golden_rows(shared_data):
    table = golden(shared_data, "ssa")
    assert_golden([wrap(angle) for angle in table["rad_in"]], table["rad_out"])
    assert_golden([math.degrees(wrap(math.radians(angle))) for angle in table["deg_in"]], table["deg_out"])


def test_wrapping_keeps_the_direction_in_a_half_open_range():
    below, above = math.nextafter(math.pi, 0.0), math.nextafter(-math.pi, -4.0)
    angles = np.r_[np.linspace(-30.0, 30.0, 301), math.pi, -math.pi, 3.0 * math.pi, below, above]
    wrapped = wrap_array([angles, angles])
    assert ((wrapped >= -math.pi) & (wrapped < math.pi)).all()
    np.testing.assert_allclose(np.exp(1j * wrapped[0]), np.exp(1j * angles), atol=1e-12)
    assert wrapped[0, -5:-1].tolist() == [-math.pi, -math.pi, -math.pi, below]
    assert [wrap(angle) for angle in angles] == wrapped[0].tolist() == wrapped[1].tolist()
    assert wrap_array(wrapped).tolist() == wrapped.tolist()


@pytest.mark.parametrize("angle", [-0.049, 0.01, 0.049, 0.051, 2.0])
def test_sinc_is_its_series(angle):
    ratio = sum((-1) ** k * angle ** (2 * k) / math.factorial(2 * k + 1) for k in range(15))
    slope = sum((-1) ** k * 2 * k * angle ** (2 * k - 1) / math.factorial(2 * k + 1) for k in range(1, 15))
    assert sinc(angle) == pytest.approx((ratio, slope), rel=5e-13)


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


HEADINGS = [0.3 * k - 3.0 for k in range(21)]


def motion(heading, surge, sway, current=(0.0, 0.0), **rest):
    north, east = over_ground(surge, sway, heading)
    known = {"north": 0.0, "east": 0.0, "yaw_rate": 0.0, "course_rate": 0.0, "roll": 0.0, "pitch": 0.0} | rest
    return GroundMotion(
        heading=heading,
        north_velocity=north + current[0],
        east_velocity=east + current[1],
        surge=surge,
        sway=sway,
        **known,
    )


@pytest.mark.parametrize(("surge", "sway"), [(2.0, 0.5), (2.0, -0.5), (-1.0, 0.3), (-1.0, -0.3), (0.0, 1.0)])
def test_course_is_heading_and_crab_angle(surge, sway):
    """P1 (5)–(7): without current crab angle and sideslip are one, and right astern too."""
    for heading in HEADINGS:
        m = motion(heading, surge, sway)
        assert m.sog == pytest.approx(math.hypot(surge, sway)) == m.water_speed
        assert wrap(m.cog - heading - m.crab_angle) == pytest.approx(0.0, abs=1e-12)
        assert m.crab_angle == pytest.approx(math.atan2(sway, surge)) == m.sideslip
        assert m.along == pytest.approx(surge)


def test_a_boat_that_crabs_across_a_current_has_no_sideslip():
    """Heading 30° up against the current to make good a track due north: P1 figure 1."""
    m = motion(math.radians(-30.0), 2.0, 0.0, current=(0.0, 1.0))
    assert m.cog == pytest.approx(0.0, abs=1e-12)
    assert m.crab_angle == pytest.approx(math.radians(30.0))
    assert m.sideslip == 0.0
    assert m.sog == pytest.approx(math.sqrt(3.0))


def test_body_and_ground_are_each_others_inverse():
    for heading in HEADINGS:
        assert in_body(*over_ground(1.2, -0.4, heading), heading) == pytest.approx((1.2, -0.4))
    assert in_body(1.0, 0.0, math.pi / 2) == pytest.approx((0.0, -1.0))  # a current to the north comes from starboard


def test_course_rate_is_yaw_rate_and_the_crab_angles_rate():
    """P1 (28): r = ω_χ − β̇, by differences on a boat whose sway grows as she turns."""
    surge, rate, h = 2.0, 0.2, 1e-6

    def velocity(t):
        return over_ground(surge, 0.3 * t, 0.7 + rate * t)

    now, later = velocity(1.0), velocity(1.0 + h)
    acceleration = [(b - a) / h for a, b in zip(now, later, strict=True)]
    crab_rate = (math.atan2(0.3 * (1.0 + h), surge) - math.atan2(0.3, surge)) / h
    assert turning_rate(*now, *acceleration) == pytest.approx(rate + crab_rate, rel=1e-5)


@pytest.mark.parametrize("current", [(0.3, -0.5), (-0.6, 0.1), (0.0, 0.0)])
def test_the_heading_against_a_current_makes_the_course_good(current):
    for course in HEADINGS:
        heading, speed = heading_for(course, 1.2, *current)
        north, east = over_ground(1.2, 0.0, heading)
        made_good = north + current[0], east + current[1]
        assert made_good == pytest.approx((speed * math.cos(course), speed * math.sin(course)))
        assert water_speed_for(course, speed, *current, 0.0, 9.0) == pytest.approx(1.2)
        assert heading_for(course, 0.0, *current)[0] == course


def test_the_course_follows_the_heading_as_its_derivative_says():
    water_speed, north, east = 1.2, 0.5, -0.3

    def motion(heading):
        return math.hypot(*over(heading)), math.atan2(*reversed(over(heading)))

    def over(heading):
        return water_speed * math.cos(heading) + north, water_speed * math.sin(heading) + east

    for heading in (0.0, 1.0, -2.0, 3.0):
        (sog, course), (_, before), (_, after) = (motion(heading + each) for each in (0.0, -1e-6, 1e-6))
        slope = wrap(after - before) / 2e-6
        assert course_per_heading(water_speed, sog, course - heading) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("to_starboard", [1.0, -1.0])
def test_across_a_current_faster_than_the_boat_the_heading_is_across(to_starboard):
    heading, speed = heading_for(0.0, 1.0, 0.2, 5.0 * to_starboard)
    assert heading == pytest.approx(-math.asin(0.98) * to_starboard)
    assert speed == pytest.approx(0.2 + math.sqrt(1.0 - 0.98**2))
