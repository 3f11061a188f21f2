"""`read` and `survey`: kinds of input, errors, and the choice of sources, which a live link makes alike."""

import gzip
import io
import math
import re

import numpy as np
import pytest

import steerway
from steerway.core import InputError
from steerway.formats.testing import SentenceReader, ais, gpx, nmea0183, nmea2000, read, survey, table, ubx
from steerway.formats.testing import rmc as written_rmc
from steerway.live.testing import SourceChoice, rows_of
from tests.messages import WHOLE, pvt
from tests.sentences import KNOT, START, gga, place, rmc, sealed, sortie, track


def rough_rmc(k, lat, lon, talker="GP"):
    return sealed(f"{talker}RMC,{120000 + k % 60},A,{place(lat, lon, 2)},1.0,2.0,010724,,,A")


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "sortie.nmea"
    path.write_bytes(sortie(60))
    return path


def test_every_way_in_says_the_same(log, tmp_path, monkeypatch):
    packed = tmp_path / "sortie.gz"
    packed.write_bytes(gzip.compress(sortie(30)) + gzip.compress(sortie(60)[len(sortie(30)) :]))
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(sortie(60))))
    ways = log, str(log), packed, sortie(60), io.BytesIO(sortie(60)), "-"
    first, *others = (read(way).to_frame() for way in ways)
    assert len(first) == 60 and all(each.equals(first) for each in others)


def test_logs_that_follow_one_another_are_one_record():
    first, second = sortie(30), sortie(30, start=START + 30.0, lat=54.1)
    fixes = read(second, first)
    assert fixes.source == "GP"
    np.testing.assert_allclose(fixes.time, START + np.arange(60), atol=1e-6)
    assert read(first, first + second).to_frame().equals(fixes.to_frame())


def test_logs_of_the_same_hours_are_two_devices(tmp_path):
    fine, coarse = tmp_path / "fine.nmea", tmp_path / "coarse.nmea"
    fine.write_bytes(b"".join(rmc(*fix) for fix in zip(*track(30), strict=True)))
    coarse.write_bytes(
        b"".join(rough_rmc(k, lat + 1e-3, lon) for k, (_, lat, lon) in enumerate(zip(*track(30), strict=True)))
    )
    fixes = read(coarse, fine)
    assert fixes.source == "GP in fine.nmea"
    assert any("coarse.nmea" in note for note in fixes.notes)
    assert len(read(coarse, fine, source="GP in coarse.nmea")) == 30


def epochs(*parts):
    """A log of the lines of several receivers, epoch by epoch."""
    return b"".join(map(b"".join, zip(*parts, strict=True)))


def test_the_best_source_by_rate_resolution_and_continuity():
    fixes = list(zip(*track(60), strict=True))
    coarse = [gga(t, a + 1e-3, o, talker="II") for t, a, o in fixes]
    fine = [rmc(t, a, o, talker="GN") for t, a, o in fixes]
    rough = [rough_rmc(k, a, o, "II") for k, (_, a, o) in enumerate(fixes)]
    assert read(epochs(rough, fine)).source == "GN"
    rare = [line * (k % 5 == 0) for k, line in enumerate(fine)]
    assert read(epochs(rare, coarse)).source == "II"
    brief = [line * (k < 10) for k, line in enumerate(fine)]
    assert read(epochs(brief, coarse)).source == "II"
    # Even fixes are better than frequent ones.
    time, lat, lon = track(120, step=0.5)
    late = np.sort(time + np.random.default_rng(3).uniform(0.0, 0.4, len(time)))
    uneven, even = (
        [f"{t:.3f} ".encode() + rmc(t, a, o, talker=talker) for t, a, o in zip(times, lat, lon, strict=True)]
        for times, talker in ((late, "II"), (time, "GN"))
    )
    assert read(epochs(uneven, [line * (k % 2 == 0) for k, line in enumerate(even)])).source == "GN"


def test_the_wanted_source():
    fixes = list(zip(*track(20), strict=True))
    both = epochs([rmc(*fix, talker="GN") for fix in fixes], [rmc(t, a + 1e-3, o, talker="II") for t, a, o in fixes])
    assert read(both, source="ii").source == "II"
    with pytest.raises(InputError, match="'XX' is not in the log; the sources with positions are 'GN', 'II'"):
        read(both, source="XX")
    with pytest.raises(InputError, match="'HC' has no position"):
        read(sortie(5), source="HC")


def test_instruments_stand_in_rows_of_their_own_between_fixes_and_are_not_mixed():
    position = b"".join(gga(START + k, 54.0, 10.0 + k * 1e-3) for k in range(10))
    lines = [f"{START + k / 5:.3f} ".encode() + sealed("HEHDT,90.0,T") for k in range(-20, 70)]
    other = [f"{START + k + 0.05:.3f} ".encode() + sealed("HCHDT,80.0,T") for k in range(10)]
    dated = f"{START:.3f} ".encode() + position
    fixes = read(dated, b"".join(lines), b"".join(other))
    assert fixes.has_position.sum() == 10 and len(fixes) == 10 + 46 - 10
    headings = fixes.heading[np.isfinite(fixes.heading)]
    assert len(headings) == 46
    np.testing.assert_allclose(headings, np.pi / 2)
    assert (np.diff(fixes.time) > 0).all()
    stamp = f"{START:.3f} ".encode()  # of two at one time the first joins the fix, as a speed of any talker does
    both = [stamp + sealed(f"HEHDT,{k}.0,T") for k in (90, 91)]
    (fix,) = (
        read(stamp + gga(START, 54.0, 10.0) + b"".join(both) + sealed("IIVTG,90.0,T,,M,4.0,N,,K,A"))
        .to_frame()
        .rows(named=True)
    )
    assert (fix["heading_deg"], fix["sog_mps"]) == pytest.approx((90.0, 4.0 * KNOT))


def test_start_stop_notes_and_progress():
    seen = []
    damaged = sortie(60) + b"$GPGGA,120000.00,5400.0,N*00\r\n"
    fixes = read(damaged, start=START + 10, stop=START + 20, progress=lambda *parts: seen.append(parts))
    np.testing.assert_allclose(fixes.time, START + np.arange(10, 20), atol=1e-6)
    assert any("1 × checksum wrong" in note for note in fixes.notes)
    assert any("variation in their own sentence" in note for note in fixes.notes)
    assert seen[-1][0] == seen[-1][1] and seen == sorted(seen)
    with pytest.raises(InputError, match="is between"):
        read(sortie(60), start=START + 100)


@pytest.mark.parametrize(
    "data, message",
    [
        ("missing.nmea", "missing.nmea: cannot be read (no such file)"),
        ("", "cannot be read (a directory)"),
        (b"", "is empty"),
        (b" \r\n", "is empty"),
        (b"a,b,c\n1,2,3\n" * 40, "unrecognized format, expected one of NMEA 0183"),
        (b"a,b,c\n1,2,3\n" * 40, "a table needs columns time_s, lat_deg and lon_deg"),
        (b"time,lat,lon\n1,99,2\n", "no position in it; found 1 × rows (1 × latitude or longitude out of range)"),
        (sealed("HEHDT,90.0,T"), "no position in it; found 1 × HEHDT"),
        (b"\x1f\x8b\x08 no archive", "the gzip archive is damaged from the beginning"),
        (7, "expected a path"),
    ],
)
def test_what_it_refuses(tmp_path, data, message):
    for call in (read, survey):
        if call is survey and "no position" in message:
            continue
        with pytest.raises(InputError, match=re.escape(message)):
            call(tmp_path / data if isinstance(data, str) else data)
    with pytest.raises(InputError, match="no log is given"):
        read()


HEADS = {
    nmea0183: [
        b"# a comment\n" + gga(START, 54.0, 10.0),
        b"# Date: 2017-07-19\n# Location: lat lon\n" + gga(START, 54.0, 10.0),
        b"2014-08-01T00:00:00Z $IIMWV,337,T,00.2,N,A*10\r\n",
    ],
    ais: [b"!AIVDM,1,1,,A,13mb9U0P00PRk8fT5nw>4?wj2006,0*5D\r\n"],
    gpx: [WHOLE[:200]],
    nmea2000: [b"2014-08-15T19:00:00.042Z,3,129029,160,255,43,87,a9\n"],
    table: [b"\xef\xbb\xbfTime;Lat;Lon\r\n", b"PAR1....", b"t,lat,lon\n", b"time,x,y\n"],
    ubx: [b"# comment\n$GPTXT\r\n" + pvt(1) + pvt(2)[:50]],
    None: [b"", b"\xb5\x62\x01\x07" + bytes(100), b"<svg></svg>"],
}
"""The formats, and beginnings of logs in each."""


@pytest.mark.parametrize(("format", "head"), [(format, head) for format, heads in HEADS.items() for head in heads])
def test_a_log_is_recognised_by_its_format_alone(format, head):
    assert [each for each in HEADS if each and each.recognises(head)] == ([format] if format else [])


def test_survey(log):
    (found,) = survey(log)
    assert found.name == str(log) and found.recording.format == "NMEA 0183"
    gnss, compass = found.sources["GP"], found.sources["HC"]
    assert (gnss.fixes, gnss.gaps, gnss.says) == (60, 0, ("position_std", "sog", "cog"))
    np.testing.assert_allclose([gnss.rate, gnss.resolution], [1.0, 0.0185], rtol=0.01)
    assert (compass.fixes, compass.says, compass.score) == (0, ("heading",), 0.0)
    time, lat, lon = track(60)
    kept = [k for k in range(60) if not 20 <= k < 30]
    (gappy,) = survey(b"".join(gga(time[k], lat[k], lon[k]) for k in kept))
    assert gappy.sources["GP"].gaps == 1
    np.testing.assert_allclose(gappy.sources["GP"].longest_gap, 11.0)


def test_several_recorded_receivers(shared_data):
    folder = shared_data / "data" / "palmer_seapath_truth"
    fixes = read(*(folder / f"NBP1406_{name}-2014-08-01" for name in ("seap", "gp02", "PCOD", "gyr1", "adcp")))
    assert fixes.source == "GP in NBP1406_seap-2014-08-01"
    assert np.isfinite(fixes.heading).sum() >= 714


SECONDS = 90


def bus(seconds=SECONDS):
    """RMC at 1 Hz, a rare compass (HC) from the start, and one at 1 Hz (HE) that begins later."""
    lines = []
    for k in range(seconds):
        lines.append((k, rmc(START + k, 54.0 + 1e-5 * k, 10.0)))
        if k % 2 == 0:
            lines.append((k + 0.2, sealed("HCHDT,20.0,T")))
        if k >= 3:
            lines.append((k + 0.4, sealed("HEHDT,1.0,T")))
    return lines


def read_and_heard(lines, column="heading"):
    """(Fixes of the log of these lines, source of the last heading, or other column, that a live link uses)."""
    lines = sorted(lines, key=lambda each: each[0])
    reader, choice, used = nmea0183.SentenceReader(), SourceChoice(), ""
    for second, line in lines:
        reader.feed(line, received=START + second)
        for row in rows_of(reader.take().sources):
            if row.has_position:
                choice.uses_position(row, row.time)
            if np.isfinite(getattr(row, column)) and choice.uses_aid(column, row, row.time):
                used = row.source
    assert len(reader.recording().sources.get("GP", ())) < 10, "what was taken is not kept"
    return steerway.read(b"".join(line for _, line in lines)), used


def test_the_compass_that_reports_more_often_is_used_and_the_receivers_own_unless_it_is_rare():
    """Rare: at less than half of its fixes, the other one at each."""
    fixes, heard = read_and_heard(bus())
    assert "heading from HE" in fixes.notes and heard == "HE" and fixes.source == "GP"
    np.testing.assert_allclose(np.degrees(fixes.heading[np.isfinite(fixes.heading)]), 1.0)
    fixes, heard = read_and_heard(bus() + [(k + 0.1, sealed("GPHDT,5.0,T")) for k in range(SECONDS)])
    assert not any("heading from" in note for note in fixes.notes) and heard == "GP"
    lines = [each for each in bus(200) if b"HC" not in each[1]]
    fixes, heard = read_and_heard(lines + [(k + 0.1, sealed("GPHDT,5.0,T")) for k in range(0, 200, 5)])
    assert "heading from HE" in fixes.notes and heard == "HE"


def test_a_receiver_without_sog_gets_none_from_another_receiver():
    """Two antennas move differently. Neither a log nor a live link takes SOG from the other one."""
    places = [(START + k, 54.0 + 1e-5 * k, 10.0) for k in range(SECONDS)]
    lines = [(0, rmc(*places[0], talker="GP", status="V")), *((k, gga(*place)) for k, place in enumerate(places))]
    lines += [(k + 0.3, rmc(*place, talker="GN")) for k, place in enumerate(places) if k % 2 == 0]
    fixes, heard = read_and_heard(lines, "sog")
    assert fixes.source == "GP" and np.isnan(fixes.sog).all() and heard == ""


PLACE = math.radians(54.0), math.radians(10.0)


def rows(others, seconds=3, per_second=10, settles=False):
    """Rows of a receiver at 1 Hz and of `others(k)`, sentences that arrive `per_second` times a second; the reader."""
    reader, found, now = SentenceReader(), [], 500.0

    def take(settled):
        if reader.holds(settled):
            found.extend(rows_of(reader.take(settled).sources))

    for second in range(seconds):
        reader.feed(written_rmc(START + second, *PLACE, 1.0, 0.5).encode(), now=now)
        take(False)
        for k in range(per_second):
            now += 0.5 / per_second
            reader.feed(b"".join(others(per_second * second + k)), now=now)
            take(settles)
            now += 0.5 / per_second
    take(True)
    return found, reader


def values(found, name):
    return [(row.time - START, getattr(row, name)) for row in found if math.isfinite(getattr(row, name))]


@pytest.mark.parametrize(("formatter", "settles"), [("HDG", False), ("HDM", True), ("HDT", False)])
def test_a_compass_keeps_its_rate_whatever_the_receivers_is(formatter, settles):
    forms = {"HDG": "HCHDG,{},,,3.0,E", "HDM": "HCHDM,{},M", "HDT": "HEHDT,{},T"}
    found, reader = rows(lambda k: [sealed(forms[formatter].format(k))], settles=settles)
    headings = values(found, "heading")
    assert len(headings) == 30 and not reader.skipped
    times = [time for time, _ in headings]
    assert times == sorted(times) and 2.8 < times[-1] - times[0] < 3.0
    turned = math.degrees(headings[-1][1] - headings[0][1])
    assert turned == pytest.approx(29.0, abs=0.01)
    variation = {"HDG": 3.0, "HDM": 4.2, "HDT": 0.0}[formatter]  # HDM's by the World Magnetic Model
    assert math.degrees(headings[0][1]) == pytest.approx(variation, abs=0.3)
    assert len(values(found, "latitude")) == 3


def test_a_compass_goes_on_where_the_receiver_falls_silent():
    reader, now = SentenceReader(), 500.0
    reader.feed(written_rmc(START, *PLACE, 1.0, 0.5).encode(), now=now)
    for k in range(100):
        reader.feed(sealed(f"HEHDT,{k},T"), now=now + 0.1 * k)
    headings = values(rows_of(reader.take().sources), "heading")
    assert len(headings) > 95 and headings[-1][0] == pytest.approx(9.8, abs=0.05)
