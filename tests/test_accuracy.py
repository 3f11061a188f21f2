"""What a receiver says of the accuracy of its fixes: as every format says it, and how far it counts."""

import json
import math
import struct
from dataclasses import replace

import numpy as np
import pytest

from steerway import FiveStateFilter, Profile, estimate
from steerway.core.testing import iso
from steerway.estimation.testing import variance_scales_of
from steerway.formats.testing import deviation, gpx, nmea0183, nmea2000, table
from steerway.live.testing import GpsdDecoder, Navigator, SignalKDecoder, rows_of
from tests.messages import POINT, document, gnss, line
from tests.scenes import angle_error, turning
from tests.sentences import START, clock, only, place, rmc, sealed

ONE = Profile(speed_noise=1e-3, course_rate_noise=2e-3, course_rate_decay=0.3, position_std=0.5)
TWO = Profile(
    speed_noise=1e-4, course_rate_noise=1e-5, course_rate_decay=1.0, position_std=0.5,
    turn_time=20.0, straight_time=60.0, turn_speed_noise=1e-3, turn_course_rate_noise=3e-3, turn_course_rate_decay=0.1,
)  # fmt: skip
GOOD, BAD = 0.5, 5.0


def doubted(given):
    return variance_scales_of(np.zeros(2), np.asarray(given, float))


def troubled(seed):
    """A scene, fixes of it whose noise is tenfold for a third of the time, as the receiver says, and when it is.

    It says thrice what it should as a rule, and in trouble exaggerates that further, as real ones do.
    """
    scene = turning(1.5, 0.5, 300.0, seed=seed)
    bad = (scene.time - scene.time[0]) % 120.0 > 80.0
    std = np.where(bad, BAD, GOOD)
    noise = np.random.default_rng([seed, 7]).standard_normal((2, len(std))) * std
    fixes = replace(scene, north=scene.north + noise[0], east=scene.east + noise[1]).fixes(0.0, 0)
    return scene, replace(fixes, position_std=3.0 * std * np.where(bad, 2.0, 1.0)), bad


def test_what_is_usual_or_better_or_wavers_is_believed_alike():
    wavering = 2.5 * np.exp(np.random.default_rng(0).uniform(-0.3, 0.3, 5000))
    assert np.all(doubted(wavering) == 1.0)
    assert np.all(doubted([2.5] * 100 + [0.1] * 100) == 1.0)


def test_what_is_beyond_twice_the_rule_counts_by_its_square():
    for unit in (0.01, 1.0, 300.0):
        found = doubted(unit * np.array([1.0] * 50 + [1.9, 3.0, 20.0, 1.0]))
        np.testing.assert_allclose(found[-4:], [1.0, 2.25, 100.0, 1.0], rtol=5e-3)


def test_what_was_not_said_counts_for_nothing():
    given = np.array([1.0, 5.0] * 30)
    with_gaps = np.insert(given, [3, 20, 40, 59], [np.nan, 0.0, -1.0, np.inf])
    known = np.isfinite(with_gaps) & (with_gaps > 0.0)
    found = doubted(with_gaps)
    assert np.all(found[~known] == 1.0)
    np.testing.assert_array_equal(found[known], doubted(given))


def test_trouble_makes_no_rule_and_a_start_in_trouble_is_forgotten():
    found = doubted(([0.3] * 1000 + [30.0] * 300) * 4)
    assert np.all(found[-300:] > 0.5 * 50.0**2)
    assert doubted([6.0] * 100 + [0.5] * 4000 + [5.0])[-1] > 12.0


@pytest.mark.parametrize("profile", [ONE, TWO], ids=["one mode", "two modes"])
def test_a_receiver_that_says_when_it_is_bad_is_followed_through(profile):
    """Over four runs with σ 0.5 and 5 m, tuned for 0.5 m: without it SOG in trouble is twice as far off."""
    errors, nis = {True: [], False: []}, []
    for seed in range(4):
        scene, fixes, bad = troubled(seed)
        for heeded in errors:
            motion = FiveStateFilter(profile).filter(fixes if heeded else replace(fixes, position_std=None))
            errors[heeded].append((motion.sog - scene.sog)[bad])
            if heeded:
                nis.append(motion.nis[bad])
                assert np.median(angle_error(motion.cog, scene.cog)[bad]) < math.radians(15.0)
    rms = {heeded: math.sqrt(np.nanmean(np.square(each))) for heeded, each in errors.items()}
    assert rms[True] < 0.12 and 2.0 * rms[True] < rms[False]
    assert np.mean(nis) == pytest.approx(2.0, abs=0.25)


def received(fixes, source="GP"):
    return list(rows_of({source: fixes}))


def sailed_by(navigator, rows):
    return [given for row in rows for given in navigator.add(row)]


def test_live_without_it_and_of_another_receiver():
    _, fixes, _ = troubled(6)
    silent = replace(fixes, position_std=None)
    deaf = sailed_by(Navigator(ONE, accuracy=False), received(fixes))
    without = sailed_by(Navigator(ONE), received(silent))
    np.testing.assert_array_equal([row.sog for row in deaf], [row.sog for row in without])
    proud = replace(fixes.rows(slice(0, 300)), position_std=np.full(300, 0.1))
    humble = replace(fixes.rows(slice(300, 400)), position_std=np.full(100, 10.0))
    rows = received(proud) + [row._replace(time=row.time + 10.0) for row in received(humble, source="UBX")]
    weighted, unweighted = (sailed_by(Navigator(ONE, accuracy=heed), rows) for heed in (True, False))
    assert len(weighted) == 400
    np.testing.assert_array_equal([row.sog for row in weighted], [row.sog for row in unweighted])


ALONE, DIFFERENTIAL, FIXED, FLOAT = 1.5, 0.7, 0.02, 0.3


def gga(second, quality=1, hdop="1.5", talker="GP", lat=54.0):
    return sealed(f"{talker}GGA,{clock(START + second)[0]},{place(lat, 10.0)},{quality},10,{hdop},1.0,M,47.0,M,,")


def gns(second, modes, hdop="2.0"):
    return sealed(f"GNGNS,{clock(START + second)[0]},{place(54.0, 10.0)},{modes},10,{hdop},1.0,47.0,,")


def gst(second, north, east, talker="GP"):
    return sealed(f"{talker}GST,{clock(START + second)[0]},,,,,{north},{east},5.0")


def stds(*sentences):
    fixes = only(nmea0183.read(b"".join(sentences)))
    return fixes.position_std.tolist()


def test_dilution_and_quality_of_gga_and_the_best_mode_of_gns():
    said = {(1, "1.5"): 1.5 * ALONE, (2, "0.8"): DIFFERENTIAL, (4, "1.7"): 1.7 * FIXED, (5, "1.0"): FLOAT}
    said |= dict.fromkeys([(1, ""), (1, "0.0"), (1, "99.99"), (8, "1.0")], math.nan)
    for each, std in said.items():
        assert stds(gga(0, *each)) == pytest.approx([std], rel=1e-12, nan_ok=True), each
    assert all(math.isnan(deviation(*each)) for each in ((math.nan, 1), (-1.0, 1), (50.0, 1), (1.0, 0), (1.0, 9)))
    best = {"AN": ALONE, "ADN": DIFFERENTIAL, "RRNN": FIXED, "FA": FLOAT, "MM": math.nan}
    for modes, std in best.items():
        assert stds(gns(0, modes)) == pytest.approx([2.0 * std], rel=1e-12, nan_ok=True), modes


def test_deviations_overrule_dilution_from_the_first_on():
    expected = [math.sqrt(12.5)] * 2
    assert stds(gga(0), gst(0, 3.0, 4.0), rmc(START + 1, 54.0, 10.0), gst(1, 3.0, 4.0), gga(1)) == expected
    assert stds(gst(0, 3.0, 4.0), gga(0), gga(1), rmc(START + 1, 54.0, 10.0))[0] == expected[0]
    assert math.isnan(stds(gst(0, 3.0, 4.0), gga(0), gga(1))[1])
    sources = nmea0183.read(gst(0, 3.0, 4.0) + gga(0) + gga(0, talker="GN", lat=55.0)).sources
    assert sources["GN"].position_std[0] == pytest.approx(1.5 * ALONE)


def test_nmea_2000_tells_it_with_the_gnss_position_unless_it_is_not_available():
    payload = bytearray(gnss(50.0, -4.5, method=4))
    for dilution, std in ((80, FIXED), (170, 1.7 * FIXED), (0x7FFF, math.nan)):
        payload[34:36] = struct.pack("<h", dilution)
        fixes = only(nmea2000.read(line(0.5, 129029, 3, bytes(payload)).encode()))
        assert fixes.position_std[0] == pytest.approx(std, nan_ok=True)


def test_gpx_dilution_and_columns_of_tables():
    fixes = only(gpx.read(document(POINT.format(1, "<hdop>1.2</hdop>"), POINT.format(2, ""))))
    np.testing.assert_allclose(fixes.position_std, [1.2 * ALONE, np.nan])
    cells = {("position_std_m", "0.5"): 0.5, ("hAcc", "-1"): math.nan, ("HDOP", "1.2"): 1.2 * ALONE}
    cells |= dict.fromkeys([("hAcc", "2"), ("hacc_mm", "2000"), ("ehpe", "2")], math.sqrt(2.0))
    for (name, cell), std in cells.items():
        fixes = only(table.read(f"time,lat,lon,{name}\n1700000000,1,2,{cell}\n".encode()))
        assert fixes.position_std[0] == pytest.approx(std, rel=1e-12, nan_ok=True), name
    fixes = only(table.read(b"time,lat,lon,hdop,hacc\n1700000000,1,2,9,2\n"))
    assert fixes.position_std[0] == pytest.approx(math.sqrt(2.0))
    fixes = only(table.read(b"mmsi,time,lat,lon,accuracy\n367000000,1700000000,1,2,1\n"))
    assert np.isnan(fixes.position_std).all()


def test_gpsd_radius_or_its_parts():
    report = {"class": "TPV", "mode": 3, "time": iso(START), "lat": 54.0, "lon": 10.0, "epx": 3.0, "epy": 4.0}
    for output, std in ((report, 5.0 / math.sqrt(2.0)), (report | {"eph": 2.0}, math.sqrt(2.0))):
        decoder = GpsdDecoder()
        decoder.feed(json.dumps(output).encode() + b"\n")
        assert decoder.complete_on_silence()[0].position_std == pytest.approx(std)


def test_signal_k_dilution():
    values = [
        {"path": "navigation.position", "value": {"latitude": 54.0, "longitude": 10.0}},
        {"path": "navigation.gnss.horizontalDilution", "value": 1.2},
    ]
    decoder = SignalKDecoder()
    update = {"$source": "gps", "timestamp": iso(START), "values": values}
    decoder.message(json.dumps({"context": "vessels.self", "updates": [update]}))
    assert decoder.complete_on_silence()[0].position_std == pytest.approx(1.2 * ALONE)


def sailing(quality, hdop="0.9"):
    return b"".join(
        gga(k, quality, hdop, lat=54.0 + 1e-5 * k) + rmc(START + k, 54.0 + 1e-5 * k, 10.0) for k in range(60)
    )


@pytest.mark.parametrize(("quality", "slow"), [(1, ALONE), (2, DIFFERENTIAL), (4, FIXED), (5, FLOAT)])
def test_the_kind_of_fix_sets_what_of_the_position_cannot_be_seen(quality, slow):
    fixes = only(nmea0183.read(sailing(quality)))
    motion = estimate(fixes, "small-usv", causal=True)
    relative = motion.position_relative_std
    np.testing.assert_allclose(motion.position_std, np.hypot(relative, slow), rtol=1e-12)
    assert (relative[5:] < 0.3).all()
    navigator = Navigator("small-usv")
    rows = [row for each in rows_of({"GP": fixes}) for row in navigator.add(each)]
    np.testing.assert_allclose([row.position_std for row in rows], motion.position_std, rtol=1e-9)
    np.testing.assert_allclose([row.position_relative_std for row in rows], relative, rtol=1e-9)
    variance, *_ = navigator.position_covariance
    assert variance == pytest.approx(relative[-1] ** 2 + slow**2, rel=0.1)


def test_a_receiver_that_says_nothing_is_a_single_one():
    (fixes,) = table.read(
        b"time,lat,lon\n" + b"".join(b"%d,%f,2\n" % (1.7e9 + k, 1 + 1e-5 * k) for k in range(60))
    ).sources.values()
    motion = estimate(fixes, "small-usv", rate=2.0)
    np.testing.assert_allclose(motion.position_std, np.hypot(motion.position_relative_std, ALONE))
