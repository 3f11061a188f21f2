"""Every reader against noise: whatever the bytes, nothing but InputError comes out, and recognition never fails."""

import functools
import io

import numpy as np
import polars as pl
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from steerway.core import InputError
from steerway.formats.testing import ais, gpx, nmea2000, table, ubx
from tests.ais_sentences import sentences, tagged
from tests.canboat_lines import frames, gnss, line, position
from tests.gpx_documents import WHOLE
from tests.ubx_frames import pvt


@functools.cache
def samples():
    """A sound log of each format, cut into its messages."""
    rng = np.random.default_rng(1)
    canboat = [line(second, 129025, 52, position(second, -second)).encode() for second in range(1, 9)]
    canboat += [line(9.0, 129029, 3, frame).encode() for frame in frames(gnss(1.0, 2.0))]
    reports = [tagged(1565222400 + each, *sentences(mmsi=each + 1, second=each)) for each in range(8)]
    rows = [b"time,lat,lon,sog\n"] + [b"%d,%.3f,1,2\n" % (each, rng.uniform()) for each in range(8)]
    parquet = io.BytesIO()
    pl.DataFrame({"time_s": [1.0, 2.0], "lat_deg": [1.0, 2.0], "lon_deg": [1.0, 2.0]}).write_parquet(parquet)
    points = [b"<trkpt" + part for part in WHOLE.split(b"<trkpt")]
    points[0] = points[0][6:]
    return {
        "ubx": (ubx, [pvt(second) for second in range(1, 9)]),
        "nmea2000": (nmea2000, canboat),
        "ais": (ais, reports),
        "csv": (table, rows),
        "parquet": (table, [parquet.getvalue()]),
        "gpx": (gpx, points),
    }


def swallow(module, data):
    """Read; what is wrong with the data may only come out as InputError."""
    assert module.recognises(data[:65536]) in (True, False)
    try:
        recording = module.read(data)
    except InputError as error:
        assert "\n" not in str(error)
        return None
    for fixes in recording.sources.values():
        assert np.isfinite(fixes.time).all()
        assert len(fixes) > 0
        with np.errstate(invalid="ignore"):
            assert not (np.abs(fixes.latitude) > np.pi / 2).any()
            assert not ((fixes.longitude < -np.pi) | (fixes.longitude >= np.pi)).any()
    assert all(count > 0 for count in recording.skipped.values())
    return recording


NAMES = sorted(samples())
quick = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))


@pytest.mark.parametrize("name", NAMES)
@quick
@given(data=st.data())
def test_noise_alone(name, data):
    module, _ = samples()[name]
    starts = {"parquet": b"PAR1", "gpx": b"<gpx>", "csv": b"time,lat,lon\n", "ubx": b"\xb5\x62\x01\x07\x5c\x00"}
    noise = data.draw(st.binary(max_size=400) | st.text(max_size=200).map(lambda text: text.encode("utf-8", "replace")))
    swallow(module, noise)
    swallow(module, starts.get(name, b"") + noise)


@quick
@given(data=st.data())
def test_parquet_cut_short(data):
    """Cut; altered bytes are in `test_hostile_input`, in a process of their own."""
    module, (whole,) = samples()["parquet"]
    swallow(module, whole[: data.draw(st.integers(0, len(whole)))])


@pytest.mark.parametrize("name", [name for name in NAMES if name != "parquet"])
@quick
@given(data=st.data())
def test_flipped_cut_and_spliced(name, data):
    module, messages = samples()[name]
    log = bytearray(b"".join(messages))
    for at in data.draw(st.lists(st.integers(0, len(log) - 1), max_size=5)):
        log[at] = data.draw(st.integers(0, 255))
    log = bytes(log)
    first, last = sorted(data.draw(st.tuples(st.integers(0, len(log)), st.integers(0, len(log)))))
    swallow(module, log[first:last])
    swallow(module, log[:last] + log[first:])


@pytest.mark.parametrize("name", ["ubx", "nmea2000", "ais", "csv", "gpx"])
@quick
@given(data=st.data())
def test_nothing_valid_is_lost_around_a_spoilt_message(name, data):
    module, messages = samples()[name]
    count = 8 if name != "gpx" else 7
    whole = swallow(module, b"".join(messages))
    victim = data.draw(st.integers(1, count - 1))
    kept = data.draw(st.integers(0, len(messages[victim]) - 1))
    tail = b"" if name == "ubx" else b"\n"
    noise = bytes(data.draw(st.lists(st.sampled_from(b"\x00\x07\x80\xff$*,.0129Aa>"), max_size=12)))
    spoilt = [*messages[:victim], messages[victim][:kept] + noise + tail, *messages[victim + 1 :]]
    recording = swallow(module, b"".join(spoilt))
    places = {place for fixes in whole.sources.values() for place in fixes.latitude[fixes.has_position].tolist()}
    left = {place for fixes in recording.sources.values() for place in fixes.latitude[fixes.has_position].tolist()}
    times = [fixes.time for fixes in whole.sources.values()]
    assert len(places) > 1 or len(np.concatenate(times)) > 1
    lost = sum(len(fixes) for fixes in whole.sources.values()) - sum(len(f) for f in recording.sources.values())
    assert lost <= 1
    assert len(places - left) <= 1
