"""Binary logs: UBX beside pyubx2, and ArduPilot, MAVLink, PX4 and FIT, encoded here by hand."""

import io
import math
import re
import struct
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pyubx2 import GET, UBXMessage, UBXReader, calc_checksum

import steerway
from steerway.core import InputError
from steerway.formats.testing import ubx
from tests.messages import pvt
from tests.reference_outputs.cases import logs

N, SPEED, COURSE = 60, 2.0, 60.0
LAT, LON = 54.0, 10.0
START = 1_780_000_000.0  # Unix s, in 2026
WEEK, SECONDS = divmod(START + 18.0 - 315964800.0, 604800.0)


def track():
    """(second, latitude, longitude in degrees) of a boat at 2 m/s on a course of 60°."""
    north, east = (SPEED * f(math.radians(COURSE)) for f in (math.cos, math.sin))
    for k in range(N):
        yield k, LAT + north * k / 111300.0, LON + east * k / (111500.0 * math.cos(math.radians(LAT)))


def is_the_track(data, source):
    fixes, (seconds, *places) = steerway.read(data), np.array(list(track())).T
    assert fixes.source == source
    np.testing.assert_allclose(fixes.time, START + seconds, rtol=0, atol=0.01)
    np.testing.assert_allclose(np.degrees((fixes.latitude, fixes.longitude)), places, rtol=0, atol=1e-7)
    return fixes


def fmt(kind, length, name, codes, columns):
    body = struct.pack("<BB4s16s64s", kind, length, name.encode(), codes.encode(), columns.encode())
    return b"\xa3\x95\x80" + body


GPS = "QBBIHBcLLeffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,U"


def dataflash_log(damage=b"", status=6):
    layout = struct.Struct("<QBBIHBhiiiffB")
    yield fmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    yield fmt(130, 3 + layout.size, "GPS", *GPS)
    yield fmt(131, 3 + 12, "MSGX", "QI", "TimeUS,X")
    for k, lat, lon in track():
        week_ms, e7 = round(1e3 * (SECONDS + k)), (round(1e7 * lat), round(1e7 * lon))
        row = 1000 * k, 0, status, week_ms, int(WEEK), 12, 80, *e7, 100, SPEED, COURSE, 1
        yield b"\xa3\x95\x82" + layout.pack(*row)
        yield b"\xa3\x95\x83" + struct.pack("<QI", k, k) + (damage if k == 20 else b"")


@pytest.mark.parametrize(("status", "std"), [(3, 1.5), (4, 0.7), (5, 0.3), (6, 0.02)])
def test_a_binary_data_flash_log(status, std):
    fixes = is_the_track(b"".join(dataflash_log(status=status)), "GPS 0")
    np.testing.assert_allclose(fixes.position_std, std)
    np.testing.assert_allclose(fixes.sog, SPEED)


def test_damage_in_a_data_flash_log_is_passed_over():
    fixes = is_the_track(b"".join(dataflash_log(b"\x00\xa3junk\xa3\x95\x07")), "GPS 0")
    assert any("message damaged" in note for note in fixes.notes)
    assert len(steerway.read(b"".join(dataflash_log())[:-40])) == N - 1
    short = fmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") + fmt(130, 11, "GPS", "Q", "TimeUS")
    with pytest.raises(InputError, match="GPS messages have no Status"):
        steerway.read(short)


def tlog(stamped=False):
    ardupilotmega = pytest.importorskip("pymavlink.dialects.v20.ardupilotmega", reason="pymavlink: extra mavlink")
    link = ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
    for k, lat, lon in track():
        own = round(1e6 * (START + k if stamped else 100.0 + k))
        clock = link.system_time_encode(round(1e6 * (START + k)), 100_000 + 1000 * k)
        fix = 0, 80, 80, round(100 * SPEED), round(100 * COURSE), 12
        raw = link.gps_raw_int_encode(own, 6, round(1e7 * lat), round(1e7 * lon), *fix)
        for message in (link.heartbeat_encode(11, 3, 0, 0, 0), clock, raw, raw):
            yield struct.pack(">Q", round(1e6 * (START + k + 0.2))) + message.pack(link)


@pytest.mark.parametrize("stamped", [False, True])
def test_a_telemetry_log(stamped):
    fixes = is_the_track(b"".join(tlog(stamped)), "GPS_RAW_INT")
    np.testing.assert_allclose(fixes.position_std, 0.02)
    np.testing.assert_allclose(fixes.cog, math.radians(COURSE))
    parts = list(tlog(stamped))
    parts[42] = b"\xff\xfe" + parts[42][:-3] + b"???"
    fixes = is_the_track(b"".join(parts), "GPS_RAW_INT")
    assert any("byte between messages" in note or "damaged" in note for note in fixes.notes)


def ulog_message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


REST = "float eph;float vel_m_s;float cog_rad;uint8_t fix_type;"
OLDER = "int32_t lat;int32_t lon;"
NEWER = "double latitude_deg;double longitude_deg;"


def ulog(axes=OLDER):
    fields = f"sensor_gps:uint64_t timestamp;uint64_t time_utc_usec;{axes}{REST}"
    yield b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + ulog_message("B", bytes(40))
    yield ulog_message("F", fields.encode())
    yield ulog_message("A", struct.pack("<BH", 0, 7) + b"sensor_gps")
    double = axes == NEWER
    layout = struct.Struct("<QQddfffB" if double else "<QQiifffB")
    for k, lat, lon in track():
        place = (lat, lon) if double else (round(1e7 * lat), round(1e7 * lon))
        row = 1_000_000 * k, round(1e6 * (START + k)), *place, 1.0, SPEED, math.radians(COURSE), 3
        yield ulog_message("D", struct.pack("<H", 7) + layout.pack(*row))


@pytest.mark.parametrize("axes", [OLDER, NEWER])
def test_a_log_of_px4(axes):
    pytest.importorskip("pyulog", reason="pyulog: extra logs")
    fixes = is_the_track(b"".join(ulog(axes)), "sensor_gps 0")
    np.testing.assert_allclose(fixes.position_std, 0.5**0.5)
    with pytest.raises(InputError, match=r"ULog file is damaged|no position"):
        steerway.read(b"ULog\x01\x12\x35\x01" + bytes(8) + ulog_message("F", b"\xff\xfe nothing") * 3)


def fit():
    definition = struct.pack("<BBBHB", 0x40, 0, 0, 20, 5)
    for number, size, kind in ((253, 4, 0x86), (0, 4, 0x85), (1, 4, 0x85), (6, 2, 0x84), (31, 1, 0x02)):
        definition += bytes((number, size, kind))
    rows = b""
    for k, lat, lon in track():
        semicircles = (round(each * 2**31 / 180.0) for each in (lat, lon))
        rows += struct.pack("<BIiiHB", 0, round(START + k - 631065600.0), *semicircles, round(1000 * SPEED), 3)
    body = definition + rows
    head = struct.pack("<BBHI4s", 14, 0x10, 2132, len(body), b".FIT") + bytes(2)
    return head + body + bytes(2)


def test_a_log_of_a_watch():
    pytest.importorskip("fitdecode", reason="fitdecode: extra logs")
    fixes = is_the_track(fit(), "FIT")
    np.testing.assert_allclose(fixes.sog, SPEED)
    np.testing.assert_allclose(fixes.position_std, 3.0 / math.sqrt(2.0))
    cut = steerway.read(fit()[:-100])
    assert N - 10 < len(cut) < N and any("damaged" in note for note in cut.notes)


def test_the_message_says_what_to_install(monkeypatch):
    for package, data in {"fitdecode": fit(), "pyulog": b"".join(ulog())}.items():
        missing = rf"needs the package {package}, expected pip install '.\[logs\]'"
        with monkeypatch.context() as patch, pytest.raises(InputError, match=missing):
            patch.setitem(sys.modules, package, None)
            steerway.read(data)


NOON = 1500465600.0  # 2017-07-19 12:00:00


def nav(name, **fields):
    return UBXMessage("NAV", name, GET, **fields).serialize()


def test_nav_pvt_in_si_and_radians():
    recording = ubx.read(pvt(1.2) + pvt(2, nano=-400000))
    fixes = recording.sources["UBX"]
    assert_allclose(fixes.time, [NOON + 1.2, NOON + 2 - 0.0004], atol=1e-6, rtol=0)
    assert_allclose(np.degrees(fixes.latitude), [-34.9, -34.9], rtol=1e-14)
    assert_allclose(np.degrees(fixes.longitude), [138.6, 138.6], rtol=1e-14)
    assert_allclose(fixes.position_std, 1.414 / np.sqrt(2), rtol=1e-12)
    assert_allclose(fixes.sog, 1.5)
    assert_allclose(fixes.cog, np.radians(90.25))
    assert recording.counts == {"NAV-PVT": 2}


def test_what_the_receiver_does_not_vouch_for_is_counted():
    for reason, changes in {
        "no fix": ({"gnssFixOk": 0}, {"fixType": 0}, {"invalidLlh": 1}),
        "no valid time": ({"validDate": 0}, {"validTime": 0}, {"month": 13}),
    }.items():
        recording = ubx.read(b"".join(pvt(1, **each) for each in changes))
        assert (recording.sources, recording.skipped) == ({}, {reason: 3})
    assert ubx.read(pvt(1, fixType=5) + pvt(2, fixType=5)).notes[0].startswith("2 positions are the surveyed")


def test_high_precision_refines_the_place():
    place = {"iTOW": 302401000, "lat": -34.9000001, "_HPlat": -23e-9, "lon": 138.6000002, "_HPlon": 41e-9, "hAcc": 20.0}
    fixes = ubx.read(pvt(1) + nav("NAV-HPPOSLLH", **place)).sources["UBX"]
    assert_allclose(np.degrees((fixes.latitude[0], fixes.longitude[0])), (-34.900000123, 138.600000241), rtol=1e-14)
    coarse = ubx.read(pvt(1) + nav("NAV-HPPOSLLH", **place, invalidLlh=1)).sources["UBX"]
    assert_allclose(np.degrees((coarse.latitude[0], coarse.longitude[0])), (-34.9, 138.6), rtol=1e-14)
    assert_allclose(fixes.position_std, 0.02 / np.sqrt(2), rtol=1e-6)
    assert_allclose(fixes.sog, 1.5)


def test_an_older_receiver_says_it_in_parts():
    log = b""
    for second in (1, 2):
        tow = 302400000 + 1000 * second
        log += nav("NAV-POSLLH", iTOW=tow, lat=1.5, lon=2.5, hAcc=2000)
        log += nav("NAV-STATUS", iTOW=tow, gpsFix=3, gpsFixOk=int(second == 2), wknSet=1)
        log += nav("NAV-VELNED", iTOW=tow, gSpeed=150, heading=45.5)
        clock = {"year": 2017, "month": 7, "day": 19, "hour": 12, "min": 0, "sec": second, "nano": 0}
        log += nav("NAV-TIMEUTC", iTOW=tow, validUTC=1, **clock)
    recording = ubx.read(log)
    fixes = recording.sources["UBX"]
    assert recording.skipped == {"no fix": 1}
    assert fixes.time[0] == NOON + 2
    assert_allclose((fixes.sog[0], np.degrees(fixes.cog[0])), (1.5, 45.5))
    assert_allclose((*np.degrees((fixes.latitude[0], fixes.longitude[0])), fixes.position_std[0]), (1.5, 2.5, 2**0.5))


def test_nothing_valid_is_lost_around_damage():
    broken = bytearray(pvt(2))
    broken[30] ^= 0x10
    log = b"# a comment\n" + pvt(1) + pvt(9)[:40] + b"$GNGGA,junk*00\r\n\xd3\x00\x04abcd" + bytes(broken)
    log += b"\xb5\x62\x01\x07\xff\xff" + pvt(3) + pvt(4)[:-1]
    recording = ubx.read(log)
    assert_allclose(recording.sources["UBX"].time - NOON, [1.0, 3.0])
    assert recording.skipped == {"UBX frame damaged": 4}
    for place, value in ((4, 120), (5, 255)):  # a damaged length swallows nothing
        broken = bytearray(pvt(1))
        broken[place] = value
        assert ubx.read(bytes(broken) + pvt(2)).counts == {"NAV-PVT": 1}


def test_the_shorter_message_of_older_firmware():
    payload = pvt(1)[6:-2][:84]
    body = b"\x01\x07" + len(payload).to_bytes(2, "little") + payload
    assert len(ubx.read(b"\xb5\x62" + body + calc_checksum(body)).sources["UBX"]) == 1


@pytest.mark.parametrize("name", [each for each in logs.LOGS if re.search("navisys|pygnss|ublox-[gnz]", each)])
def test_every_fix_of_the_recorded_logs_is_kept(shared_data, name):
    data = (shared_data / "data" / name).read_bytes()
    assert ubx.recognises(data[:65536])
    valid = [
        message
        for _, message in UBXReader(io.BytesIO(data), quitonerror=0)
        if getattr(message, "identity", "") == "NAV-PVT" and message.gnssFixOk and message.fixType
    ]
    fixes = ubx.read(data).sources["UBX"]
    assert len(fixes) == len(valid) > 0
    assert_allclose(np.degrees(fixes.latitude), [message.lat for message in valid], atol=1e-6)
    assert_allclose(fixes.sog, [message.gSpeed / 1000 for message in valid])
    assert fixes.time[0] % 60 == pytest.approx(valid[0].second + valid[0].nano * 1e-9, abs=1e-6)


@pytest.mark.parametrize("size", [1, 5, 64, 1000])
def test_a_stream_in_pieces_is_the_log(size):
    rng = np.random.default_rng(size)
    status = {"gpsFix": 3, "gpsFixOk": 1}
    frames = [pvt(k, lat=-34.9 + 1e-5 * k) + nav("NAV-STATUS", iTOW=302400000 + 1000 * k, **status) for k in range(50)]
    noise = [rng.bytes(rng.integers(0, 40)) + b"\xb5\x62\x01\x07"[: rng.integers(0, 5)] for _ in frames]
    for k in range(0, 50, 9):
        frames[k] = frames[k][: rng.integers(1, 90)]
    log = b"".join(a + b for a, b in zip(frames, noise, strict=True))
    whole, reader, times = ubx.read(log), ubx.UbxReader(), []
    for start in range(0, len(log), size):
        reader.feed(log[start : start + size])
        times += [each for fixes in reader.take(False).sources.values() for each in fixes.time]
    reader.finish()
    times += [each for fixes in reader.take().sources.values() for each in fixes.time]
    assert times == whole.sources["UBX"].time.tolist() and len(times) >= 44
    assert dict(reader.counts) == whole.counts and reader.take().skipped == whole.skipped
