"""Sound inputs to mutate: generated ones, the project's examples, and parts of recorded logs if these are installed."""

import datetime
import gzip
import io
import json
import math
import os
import random
import struct
import tempfile
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
import polars as pl
import zstandard

from steerway.core.testing import REPORTED
from steerway.formats.testing import MESSAGES, Splitter, identifier_of
from tests import test_hostile_input
from tests.fuzz.mutation import absurd
from tests.messages import WHOLE, frames, gnss, line, nav_sat_fix, position, pvt, sentences, tagged
from tests.sentences import sealed, sortie
from tests.test_other_formats import LOGS, TABLES

ROOT = Path(__file__).parents[2]
_WINDOW = 1500  # bytes of a part of a recorded log
_WINDOWS = 12


@cache
def recorded() -> list[bytes]:
    """Parts of every recorded log below STEERWAY_DATA: its beginning, and others within it."""
    folder = os.environ.get("STEERWAY_DATA")
    rng, found = random.Random(0), []
    for path in sorted(Path(folder, "data").rglob("*")) if folder else ():
        if path.is_file() and (path.suffix not in (".md", "") or path.name.startswith("NBP")):
            data = path.read_bytes()
            found.append(data[:_WINDOW])
            found += [data[at : at + _WINDOW] for at in (rng.randrange(len(data) or 1) for _ in range(_WINDOWS))]
    return found or [*nmea(), *ubx(), *canboat(), *ais(), WHOLE, *(f"{each}".encode() for each in LOGS.values())]


def _recorded_with(*signs: bytes) -> list[bytes]:
    return (
        [each for each in recorded() if any(sign in each for sign in signs)] if os.environ.get("STEERWAY_DATA") else []
    )


def nmea():
    """NMEA 0183 with every formatter that the reader knows."""
    others = ("GPGNS,120000.00,5400.0,N,01000.0,E,AA,10,0.9,1.0,47.0,,", "GPZDA,120000.00,01,07,2024,00,00")
    others += ("GPTHS,350.0,A", "HCHDM,350.0,M", "VWVHW,350.0,T,348.0,M,5.0,N,9.3,K", "TIROT,3.5,A")
    others += ("GPGST,120000.00,1.0,1.0,0.5,45.0,0.9,0.8,2.0", "HEHDT,350.0,T")
    times = b"2024-07-01T12:00:00.250Z " + sealed(others[0]) + b"1719835200123 " + sealed(others[2])
    return [sortie(6), b"".join(map(sealed, others)), times, *_recorded_with(b"GGA,", b"RMC,")]


def ubx():
    """UBX frames NAV-PVT."""
    return [b"".join(pvt(second) for second in range(1, 8)), *_recorded_with(b"\xb5\x62")]


BUS = (129025, position(0.0, -1.0)), (129029, gnss(1.0, 2.0))


def canboat():
    """NMEA 2000 as canboat writes it."""
    lines = [line(second, 129025, 52, position(second, -second)).encode() for second in range(1, 9)]
    lines += [line(9.0, 129029, 3, frame).encode() for frame in frames(gnss(1.0, 2.0))]
    return [b"\n".join(lines), *_recorded_with(b",12902", b",127250", b",130")]


def ais():
    """AIS reports with and without a tag block."""
    reports = [tagged(1565222400 + each, *sentences(mmsi=each + 1, second=each)) for each in range(8)]
    return [b"".join(reports), *_recorded_with(b"!AIVDM", b"!BSVDM", b"VDO,")]


def csv():
    """CSV tables of loggers and tools."""
    return [*(f"{LOGS[header]}".encode() for header in TABLES), *_recorded_with(b"MMSI", b"Latitude", b"lat")]


def parquet():
    """Small Parquet tables with three compressions."""
    return [test_hostile_input.parquet(2, compression) for compression in ("zstd", "snappy", "uncompressed")]


def examples(pattern: str):
    """Example files of the project."""
    return [path.read_bytes() for path in sorted((ROOT / "examples").rglob(pattern))]


def mixed():
    """NMEA 0183 and UBX on one serial line."""
    return [sortie(2) + pvt(1) + sortie(1) + pvt(2), *nmea(), *ubx()]


def signalk():
    """Signal K deltas."""
    values = [
        ("navigation.position", {"latitude": 54.0, "longitude": 10.0}), ("navigation.speedOverGround", 2.0),
        ("navigation.courseOverGroundTrue", 1.0), ("navigation.rateOfTurn", None),
        ("navigation.gnss.horizontalDilution", 0.9),
    ]  # fmt: skip
    updates = [
        {"$source": "gps.1", "timestamp": "2024-07-01T12:00:00.000Z", "values": [{"path": p, "value": v}]}
        for p, v in values
    ]
    hello = {"name": "server", "version": "2.0.0", "roles": ["master"], "self": "vessels.urn:mrn:imo:mmsi:1"}
    delta = {"context": "vessels.self", "updates": updates}
    return [b"\n".join(json.dumps(each).encode() for each in (hello, delta, delta)), *_recorded_with(b'"updates"')]


def gpsd():
    """JSON reports of gpsd."""
    device = {"class": "DEVICE", "path": "/dev/ttyACM0", "driver": "u-blox"}
    tpv = {
        "class": "TPV", "device": "/dev/ttyACM0", "mode": 3, "time": "2024-07-01T12:00:00.000Z", "lat": 54.0, "lon": 10,
        "track": 90.0, "speed": 2.0, "eph": 3.0, "epx": 1.0, "epy": 2.0,
    }  # fmt: skip
    messages = [
        {"class": "VERSION", "release": "3.25"},
        {"class": "DEVICES", "devices": [device, device | {"path": "b"}]},
    ]
    later = tpv | {"time": "2024-07-01T12:00:01.000Z"}
    return [b"\n".join(json.dumps(each).encode() for each in (*messages, tpv, later)), json.dumps(device).encode()]


def mavlink():
    """MAVLink packets of a vehicle."""
    from pymavlink.dialects.v20 import ardupilotmega as messages

    codec = messages.MAVLink(None, 1, 1)
    output = [
        messages.MAVLink_heartbeat_message(10, 3, 81, 4, 4, 3),
        messages.MAVLink_system_time_message(1_780_000_000_000_000, 60_000),
        messages.MAVLink_gps_raw_int_message(60_000_000, 3, 540000000, 100000000, 0, 90, 120, 200, 9000, 12),
        messages.MAVLink_global_position_int_message(60_000, 540000000, 100000000, 0, 0, 200, 0, 0, 9000),
        messages.MAVLink_attitude_message(60_000, 0.0, 0.0, 1.0, 0.0, 0.0, 0.1),
        messages.MAVLink_command_ack_message(176, 0),
        messages.MAVLink_param_value_message(b"GUID_OPTIONS", 0.0, 4, 1, 0),
        messages.MAVLink_statustext_message(4, b"mode change denied"),
    ]
    packets = [each.pack(codec) for each in output]
    gps, attitude = messages.MAVLink_gps_raw_int_message, messages.MAVLink_attitude_message
    for k in range(20):
        later = gps(60_200_000 + 200_000 * k, 3, 540000000, 100000000, 0, 90, 120, 200, 9000, 12)
        packets += [later.pack(codec), attitude(60_100 + 200 * k, 0.0, 0.0, 1.0, 0.0, 0.0, 0.1).pack(codec)]
    return [b"".join(packets), *packets]


def requests():
    """HTTP requests to the helm page: to read, to log in, to act; from its own and from foreign origins."""
    cookie = b"cookie: steerway_helm=99999999999.0123456789abcdef"
    host = b"host: boat.local:8080"
    return [
        b"GET / http\n" + host,
        b"GET /login http\n" + host + b"\norigin: http://evil.example",
        b"POST /login http\n" + host + b"\norigin: http://boat.local:8080\n\ntoken=wrong",
        b"GET /_nicegui_ws/socket.io ws\n" + host + b"\norigin: http://boat.local:8080\n" + cookie,
        b"HEAD / https\nhost: [::1]:8080\n" + cookie,
    ]


HELM_LINES = (
    {"ready": True}, {"do": "start", "who": "10.0.0.7"}, {"do": "stop", "who": ""}, {"failed": "port in use"},
    {"do": "hold-course", "value": 1.0}, {"do": "adjust", "value": -0.1}, {"do": "hold-position"}, {"do": "route"},
    {"do": "leg", "value": 1}, {"do": "mob"}, {"do": "mob-over"},
)  # fmt: skip


def mcap():
    """Positions of ROS 2 in chunks of every compression, and a recording of inputs."""
    from mcap.writer import CompressionType, Writer

    found = []
    for compression in CompressionType:
        file = io.BytesIO()
        writer = Writer(file, compression=compression, chunk_size=400)
        writer.start("ros2", "fuzz")
        schema = writer.register_schema("sensor_msgs/msg/NavSatFix", "ros2msg", b"")
        channel = writer.register_channel("/fix", "cdr", schema)
        inputs = writer.register_channel("/input", "json", 0)
        row = dict.fromkeys(REPORTED) | {"source": "GP", "time": 1.7e9, "latitude": 0.9, "longitude": 0.2}
        for k in range(4):
            writer.add_message(channel, k, nav_sat_fix(1.7e9 + k, 54.0 + 1e-5 * k, 10.0), k)
            writer.add_message(inputs, k, json.dumps(row | {"time": 1.7e9 + k}).encode(), k)
        writer.finish()
        found.append(file.getvalue())
    return found


def bags():
    """A ROS 2 bag in SQLite."""
    rows = ", ".join(f"({k}, x'{nav_sat_fix(1.7e9 + k, 54.0 + 1e-5 * k, 10.0).hex()}')" for k in range(4))
    columns = "1 AS topic_id, column1 AS timestamp, column2 AS data"
    return [test_hostile_input.bag(f"TABLE messages AS SELECT {columns} FROM (VALUES {rows})")]


LAYOUTS = {
    "%d/%m/%Y %H:%M:%S": "# Timestamp,Type of mobile,MMSI,Latitude,Longitude,SOG,COG,Heading,Ship type,Length,Width",
    "%Y-%m-%dT%H:%M:%S": "BaseDateTime,TransceiverClass,MMSI,LAT,LON,SOG,COG,Heading,VesselType,Length,Width",
    "%Y-%m-%d %H:%M:%S": "base_date_time,transceiver,mmsi,latitude,longitude,sog,cog,heading,vessel_type,length,width",
}
"""AIS tables of the Danish authority and of MarineCadastre, before 2025 and since: form of a time, header."""


def ais_tables():
    """One AIS table in every layout, as GeoParquet, and packed."""
    rows = [("A", 211000001, 54 + 1e-3 * k, 10.5, 5.5, 90.0, 511 if k == 3 else 91, "70", 80, 10) for k in range(8)]
    moments = [datetime.datetime(2024, 7, 1, 12, 0, k) for k in range(8)]
    found = []
    for form, header in LAYOUTS.items():
        cells = zip(moments, rows, strict=True)
        lines = (",".join((moment.strftime(form), *map(str, row))) for moment, row in cells)
        found.append("\n".join((header, *lines)).encode())
    *_, names = (header.split(",") for header in LAYOUTS.values())
    frame = pl.DataFrame([(moment, *row) for moment, row in zip(moments, rows, strict=True)], names, orient="row")
    points = [struct.pack("<BIdd", 1, 1, longitude, latitude) for _, _, latitude, longitude, *_ in rows]
    file, zipped = io.BytesIO(), io.BytesIO()
    frame.drop("latitude", "longitude").with_columns(geometry=pl.Series(points)).write_parquet(file)
    with zipfile.ZipFile(zipped, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("day.csv", found[0])
    return [*found, file.getvalue(), zipped.getvalue(), gzip.compress(found[1]), zstandard.compress(found[2])]


def unfinished():
    """The unfinished file of an interrupted campaign."""
    from steerway.simulation import Unfinished

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "work")
        work = Unfinished(path, {"work": "fuzzed"})
        for key in range(3):
            work.add(key, {"cog_rms_deg": 1.5 * key, "rows": np.arange(3.0)})
        return [path.read_bytes()]


def gateway(messages=BUS):
    """Lines of an NMEA 2000 gateway."""
    parts = [(pgn, data) for pgn, payload in messages for data in Splitter().parts(pgn, payload)]
    output = [f"12:00:00.000 R {identifier_of(pgn, 9):08X} {data.hex(' ').upper()}" for pgn, data in parts]
    return ["\r\n".join(output).encode()]


def beyond():
    """By target, messages with each number in turn beyond all range: of a text, of a vehicle, of every PGN."""
    from pymavlink.dialects.v20 import ardupilotmega as messages

    codec, heads = messages.MAVLink(None, 1, 1), b"".join(mavlink()[1:3])
    attitude, fix = messages.MAVLink_attitude_message, messages.MAVLink_gps_raw_int_message
    packets = [fix((1 << 64) - 1, 3, -(1 << 31), (1 << 31) - 1, 0, 0, 0, 0xFFFE, 0xFFFE, 9).pack(codec)]
    for k, value in enumerate((3.4e38, -3.4e38, math.nan, math.inf, -math.inf), 1):  # a fix takes what came with it
        turning = attitude(60_000 + 200 * k, 0.0, 0.0, value, 0.0, 0.0, value)
        placed = fix(60_000_000 + 200_000 * k, 3, 540000000, 100000000, 0, 90, 120, 200, 9000, 12)
        packets.append(turning.pack(codec) + placed.pack(codec))
    lengths = {pgn: 43 if pgn == 129029 else 8 for pgn in MESSAGES}
    payloads = [(pgn, bytes([fill]) * lengths[pgn]) for pgn in lengths for fill in (0x00, 0x7F, 0x80, 0xFE, 0xFF)]
    return {
        "gpsd": absurd(gpsd()[0].splitlines()[2]),
        "Signal K": absurd(signalk()[0].splitlines()[1]),
        "MAVLink": [heads + each for each in packets],
        "NMEA 2000 wire": [gateway([each])[0] for each in payloads],
    }
