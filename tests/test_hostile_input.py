"""Inputs made to waste time or memory: less than 1 MB is read or refused within 5 s, an archive within --max-size."""

import gzip
import io
import sqlite3
import sys
import time
import tracemalloc
import zipfile

import numpy as np
import polars as pl
import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from steerway.core import InputError
from steerway.formats.testing import MAX_SIZE, ais_tables, gga, read, rmc, survey, table
from tests.messages import line, position, pvt

LIMIT = 5.0  # s of processor time
SIZE = 999_000
TABLE = b"time_s,lat_deg,lon_deg\n"
ENTITIES = b'<!DOCTYPE gpx [<!ENTITY a "aaaaaaaaaa">' + b"".join(
    b'<!ENTITY %c "%s">' % (letter, b"&%c;" % (letter - 1) * 10) for letter in b"bcdefghijkl"
)
WORST = {
    "commas": b",",
    "columns": b"A,",
    "a table of empty lines": TABLE + b"\n" * SIZE,
    "a table of quotes": TABLE + b'"\n' * SIZE,
    "heads of UBX frames": b"\xb5\x62\x01\x07\x5c\x00",
    "UBX": pvt(3),
    "NMEA 0183": (gga(1.7e9, 0.9, 0.2) + rmc(1.7e9, 0.9, 0.2)).encode(),
    "canboat text": line(1.0, 129025, 52, position(1, -1)).encode(),
    "damaged track points": b"<gpx>" + b"<trkpt " * SIZE,
    "track points in text without end": b"<gpx>" + b"<trkpt><![CDATA[ " * SIZE,
    "nested elements": b"<gpx>" + b"<a>" * SIZE,
    "entities that contain entities": b'<?xml version="1.0"?>' + ENTITIES + b"]><gpx><trk><name>&l;</name></trk></gpx>",
}


def repeated(unit: bytes, size: int) -> bytes:
    return (unit * (size // len(unit) + 1))[:size]


@pytest.mark.parametrize("data", WORST.values(), ids=WORST)
def test_less_than_a_megabyte_is_read_within_five_seconds(data):
    began = time.process_time()
    try:
        survey(repeated(data, SIZE))
    except InputError:
        pass
    assert time.process_time() - began < LIMIT


@pytest.mark.parametrize("unit", [b"\0", WORST["NMEA 0183"]], ids=["zeros", "NMEA 0183"])
def test_an_archive_that_unpacks_to_a_thousand_times_its_size_is_refused(unit):
    packed = gzip.compress(repeated(unit, 30_000_000))
    tracemalloc.start()
    began = time.process_time()
    with pytest.raises(
        InputError, match=r"^bytes: unpacks to more than 1.6e\+07 bytes, expected less \(or a larger --max-size\)$"
    ):
        survey(packed)
    assert time.process_time() - began < 1.0
    assert tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()


def mcap(compression, size=30):
    """A chunk of so many million zeros."""
    file = io.BytesIO()
    writer = Writer(file, compression=compression, chunk_size=1 << 30)
    writer.start("", "test")
    channel = writer.register_channel("/zeros", "", 0)
    for k in range(size):
        writer.add_message(channel, k, bytes(1_000_000), k)
    writer.finish()
    return file.getvalue()


def test_packed_tables_and_chunks_of_mcap_that_unpack_to_far_more_are_refused(tmp_path):
    zeros, zipped, path = TABLE.replace(b"time", b"mmsi,time") + bytes(30_000_000), io.BytesIO(), tmp_path / "day"
    with zipfile.ZipFile(zipped, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("day.csv", zeros)
    for data in (zipped.getvalue(), gzip.compress(zeros), zstandard.compress(zeros)):
        path.write_bytes(data)
        with (
            pytest.raises(InputError, match=r"unpacks to more than 1.6e\+07 bytes, expected a table \("),
            ais_tables.reports(path, tmp_path),
        ):
            pass
    assert [each.name for each in tmp_path.iterdir()] == ["day"]
    for compression in (CompressionType.ZSTD, CompressionType.LZ4):
        with pytest.raises(InputError, match=r"^bytes: MCAP unpacks to more than 1.6e\+07 bytes, expected a recording"):
            survey(mcap(compression))


def test_an_archive_is_unpacked_to_the_size_that_is_allowed():
    log = b"".join(b"%d,%.7f,10\n" % (k, 54 + 1e-6 * k) for k in range(20_000))
    packed = gzip.compress(TABLE + log)
    assert MAX_SIZE == 1e9
    assert len(read(packed, max_size=len(TABLE + log))) == 20_000
    with pytest.raises(
        InputError, match=r"unpacks to more than 100000 bytes, expected less \(or a larger --max-size\)"
    ):
        read(packed, max_size=100_000)
    # Concatenated archives are one log; the rows before the damage in the last one are kept.
    first, second = gzip.compress(TABLE + log[:100_000], 9), gzip.compress(log[100_000:])
    assert len(read(first + second)) == 20_000
    assert 4_000 < len(read(first + second[: len(second) // 2])) < 20_000


def endless(data: str) -> str:
    """A query for messages that never ends."""
    rows = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n)"
    return f"VIEW messages AS {rows} SELECT 1 AS topic_id, k AS timestamp, {data} AS data FROM n"


def bag(messages: str) -> bytes:
    """A ROS 2 bag whose messages are what this statement creates."""
    base = sqlite3.connect(":memory:")
    base.execute("CREATE TABLE topics AS SELECT 1 AS id, '/fix' AS name, 'sensor_msgs/msg/NavSatFix' AS type")
    base.execute(f"CREATE {messages}")
    base.commit()
    return base.serialize()


def test_a_bag_whose_messages_are_a_query_without_end_is_refused_and_damaged_ones_are_counted():
    began = time.process_time()
    for data in ("x'00'", "zeroblob(1000000000)"):
        with pytest.raises(InputError, match="not a ROS 2 bag"):
            survey(bag(endless(data)))
    assert time.process_time() - began < LIMIT
    rows = "(x''), (x'0001'), (7), ('text'), (NULL)"
    (log,) = survey(
        bag(f"TABLE messages AS SELECT 1 AS topic_id, 0 AS timestamp, column1 AS data FROM (VALUES {rows})")
    )
    assert log.recording.skipped == {"message damaged": 5}


def parquet(rows: int, compression="zstd", **changes) -> bytes:
    file, seconds = io.BytesIO(), np.arange(rows, dtype=float)
    columns = {"time_s": seconds, "lat_deg": 54.0 + 1e-6 * seconds, "lon_deg": 10.0, **changes}
    pl.DataFrame(columns).write_parquet(file, compression=compression)
    return file.getvalue()


def test_a_damaged_parquet_file_and_one_of_more_rows_than_it_can_hold_are_refused_in_one_sentence(capfd):
    """Damaged counts in the headers of pages make polars panic, which would print."""
    with pytest.raises(InputError, match=r"declares 1000000 rows, expected at most 8 a byte"):
        survey(parquet(1_000_000, time_s=np.zeros(1_000_000), lat_deg=0.0))
    whole, seen = parquet(2), set()
    for place in (*range(4, 250, 2), *range(len(whole) - 600, len(whole), 7)):
        for value in (1, 127):
            damaged = whole[:place] + bytes([value]) + whole[place + 1 :]
            try:
                table.read(damaged)
            except InputError as error:
                assert "\n" not in str(error)
                seen.add(str(error))
    assert any("expected one that polars reads" in each for each in seen)
    print("a warning", file=sys.stderr)
    assert capfd.readouterr() == ("", "a warning\n")
