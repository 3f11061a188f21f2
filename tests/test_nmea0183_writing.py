"""Written sentences, compared with literal text and read back."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steerway.core.testing import Leg
from steerway.formats.testing import gga, hdt, nmea0183, rmb, rmc, rot, sealed, vtg

NOON = 1_719_835_200.0  # 2024-07-01 12:00 UTC
PLACE = (math.radians(63.44), math.radians(-10.25))


def test_sentences_as_the_standard_has_them():
    assert rmc(NOON + 0.2, *PLACE, 1852.0 / 3600.0, math.pi / 2.0) == sealed(
        "SWRMC,120000.200,A,6326.4000000,N,01015.0000000,W,1.000,90.00,010724,,,A"
    )
    assert gga(NOON, *PLACE, talker="GP").startswith("$GPGGA,120000.000,6326.4000000,N,01015.0000000,W,1,08,1.0,0.0,M")
    assert vtg(1.0, -math.pi / 2.0) == sealed("SWVTG,270.00,T,,M,1.944,N,3.600,K,A")
    assert rot(math.radians(1.0)) == sealed("SWROT,60.00,A")  # degrees a minute, + to starboard
    assert rot(math.radians(-0.5)) == sealed("SWROT,-30.00,A")
    assert hdt(math.radians(359.999)) == sealed("SWHDT,0.00,T")
    # An independent checksum: many receiver manuals contain this sentence.
    assert sealed("GPGLL,5057.970,N,00146.110,E,142451,A").strip() == "$GPGLL,5057.970,N,00146.110,E,142451,A*27"


def test_a_leg_as_the_standard_has_it():
    leg = Leg(-370.4, 0.0, 0.1, 1852.0, 0.2, 1852.0 / 3600.0, *PLACE, "A", "B")
    assert rmb(leg) == sealed("SWRMB,A,0.20,R,A,B,6326.4000000,N,01015.0000000,W,1.000,5.73,1.00,V,A")
    assert rmb(leg._replace(distance=1e7)).split(",")[10] == "999.900"
    assert rmb(leg._replace(bearing=math.nan)).split(",")[1] == "V"


def test_nothing_rolls_over_to_sixty_or_three_hundred_and_sixty():
    almost = math.radians(60.0 - 1e-12)
    assert ",6000.0000000,N,01000.0000000,W," in rmc(NOON - 1e-5, almost, math.radians(-10.0 + 1e-12))
    assert rmc(NOON - 1e-5, *PLACE).split(",")[1] == "120000.000"
    assert rmc(NOON - 1e-5, *PLACE, 1.0, -1e-9).split(",")[8] == "0.00"
    assert ",18000.0000000," in rmc(NOON, 0.0, math.pi)


def test_what_is_not_known_is_not_said():
    assert rmc(NOON, *PLACE) == sealed("SWRMC,120000.000,A,6326.4000000,N,01015.0000000,W,,,010724,,,A")
    assert rmc(NOON, math.nan, math.nan) == rmc(NOON, *PLACE, valid=False)
    assert ",V,,,,," in rmc(NOON, *PLACE, 1.0, 1.0, valid=False)
    assert vtg(1.0, 1.0, valid=False) == sealed("SWVTG,,T,,M,,N,,K,N")
    assert vtg(0.0) == sealed("SWVTG,,T,,M,0.000,N,0.000,K,A")
    assert rot() == sealed("SWROT,,V") and rot(0.1, valid=False) == sealed("SWROT,,V")
    refused = nmea0183.read((rmc(NOON, *PLACE, valid=False) + gga(NOON, *PLACE, valid=False)).encode())
    assert not any(fixes.has_position.any() for fixes in refused.sources.values())


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-89.9, 89.9),
    st.floats(-179.99, 179.99),
    st.floats(0.0, 30.0),
    st.floats(-math.pi, math.pi),
    st.floats(-1.0, 1.0),
    st.floats(0.0, 1e8),
)
def test_what_is_written_is_read_back(latitude_deg, longitude_deg, sog, cog, rate, after):
    latitude, longitude, time = math.radians(latitude_deg), math.radians(longitude_deg), round(NOON + after, 3)
    log = rmc(time, latitude, longitude, sog, cog) + gga(time, latitude, longitude) + hdt(cog) + rot(rate)
    (fixes,) = nmea0183.read(log.encode()).sources.values()
    assert len(fixes) == 1
    assert fixes.time[0] == pytest.approx(time, abs=1e-6)
    assert fixes.latitude[0] == pytest.approx(latitude, abs=1.6e-11)  # half a ten-millionth of a minute
    assert fixes.longitude[0] == pytest.approx(longitude, abs=1.6e-11)
    assert fixes.sog[0] == pytest.approx(sog, abs=3e-4)
    assert math.cos(fixes.cog[0] - cog) == pytest.approx(1.0, abs=1e-7)
    assert math.cos(fixes.heading[0] - cog) == pytest.approx(1.0, abs=1e-7)
    assert fixes.yaw_rate[0] == pytest.approx(rate, abs=2e-6)
