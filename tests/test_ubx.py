"""UBX: messages made by pyubx2, alone and among other bytes, and recorded logs compared with pyubx2's reader."""

import io
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pyubx2 import GET, UBXMessage, UBXReader, calc_checksum

from steerway.formats.testing import ubx
from tests.messages import pvt
from tests.reference_outputs.cases import logs

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
    assert_allclose(fixes.cog, np.pi / 2)
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
    place = {"iTOW": 302401000, "lat": -34.9000001, "lon": 138.6000002, "hAcc": 20.0}
    fixes = ubx.read(pvt(1) + nav("NAV-HPPOSLLH", **place)).sources["UBX"]
    assert_allclose(np.degrees((fixes.latitude[0], fixes.longitude[0])), (-34.9000001, 138.6000002), rtol=1e-14)
    coarse = ubx.read(pvt(1) + nav("NAV-HPPOSLLH", **place, invalidLlh=1)).sources["UBX"]
    assert_allclose(np.degrees((coarse.latitude[0], coarse.longitude[0])), (-34.9, 138.6), rtol=1e-14)
    assert_allclose(fixes.position_std, 0.02 / np.sqrt(2), rtol=1e-6)
    assert_allclose(fixes.sog, 1.5)


def test_an_older_receiver_says_it_in_parts():
    log = b""
    for second in (1, 2):
        tow = 302400000 + 1000 * second
        log += nav("NAV-POSLLH", iTOW=tow, lat=1.5, lon=2.5, hAcc=2000)
        log += nav("NAV-STATUS", iTOW=tow, gpsFix=3, gpsFixOk=int(second == 2))
        log += nav("NAV-VELNED", iTOW=tow, gSpeed=150, heading=45.0)
        clock = {"year": 2017, "month": 7, "day": 19, "hour": 12, "min": 0, "sec": second, "nano": 0}
        log += nav("NAV-TIMEUTC", iTOW=tow, validUTC=1, **clock)
    recording = ubx.read(log)
    fixes = recording.sources["UBX"]
    assert recording.skipped == {"no fix": 1}
    assert fixes.time[0] == NOON + 2
    assert_allclose((fixes.sog[0], np.degrees(fixes.cog[0])), (1.5, 45.0))
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
