"""NMEA 2000: constructed messages with known values, and recorded logs compared with tables that others derived."""

import json
import math
import struct

import numpy as np
import pytest
from numpy.testing import assert_allclose

from steerway.formats.testing import Frame, Splitter, identifier_of, nmea2000
from steerway.live.testing import N2kDecoder
from tests.messages import STAMP, frames, gnss, line, position

START = 1785732420.0  # 04:47:00


def read(*lines):
    return nmea2000.read("".join(lines).encode())


def test_each_message_in_si_and_radians():
    recording = read(
        "# format=FAST\n",
        line(1.0, 129025, 52, position(-34.5, 133.25)),
        line(2.0, 129026, 52, struct.pack("<BBHHH", 255, 0xFC, 15000, 321, 65535)),
        line(3.0, 127250, 7, struct.pack("<BHhhB", 1, 31000, 0x7FFF, 0x7FFF, 0xFC)),
        line(4.0, 127251, 7, struct.pack("<Bi", 1, -3200000)),
        line(5.0, 128259, 9, struct.pack("<BHHB", 1, 250, 65535, 0)),
        line(6.0, 127488, 9, struct.pack("<BHHbH", 0, 4800, 65535, 127, 65535)),
    )
    receiver, compass, log = (recording.sources[name] for name in ("src 52", "src 7", "src 9"))
    assert_allclose(receiver.time, START + np.array([1.0, 2.0]), rtol=0, atol=1e-6)
    assert_allclose(receiver.latitude[0], np.radians(-34.5), rtol=1e-15)
    assert_allclose(receiver.longitude[0], np.radians(133.25), rtol=1e-15)
    assert_allclose((receiver.cog[1], receiver.sog[1]), (1.5, 3.21))
    assert list(receiver.has_position) == [True, False]
    assert_allclose(compass.heading[0], 3.1)
    assert_allclose(compass.yaw_rate[1], -0.1)
    assert_allclose(log.water_speed, [2.5, np.nan])
    assert_allclose(log.shaft, [np.nan, 20.0])
    assert recording.skipped == {}


def test_not_available_is_unknown():
    nothing = bytes.fromhex("ffff7fffff7fff7f")
    recording = read(
        line(1.0, 129025, 1, struct.pack("<ii", 2**31 - 1, 2**31 - 1)),
        line(2.0, 129026, 1, b"\xff" * 8),
        line(3.0, 127250, 1, b"\xff\xff\xff" + nothing[3:] + b""),
        line(4.0, 127251, 1, b"\xff\xff\xff\xff\x7f"),
        line(5.0, 128259, 1, b"\xff" * 8),
    )
    assert recording.sources == {}
    assert recording.skipped["position not available"] == 1


def test_a_long_message_is_joined_from_frames_of_two_senders_mixed_and_a_lost_frame_costs_one():
    payload = gnss(50.123456789012, -4.5)
    mine, other = frames(payload), frames(gnss(10.0, 20.0), sequence=5)
    lines = []
    for first, second in zip(mine, other, strict=True):
        lines += [line(0.1, 129029, 3, first), line(0.1, 129029, 4, second)]
    plain, fast = read(*lines), read(line(0.1, 129029, 3, payload))
    assert plain.sources["src 3"].latitude[0] == fast.sources["src 3"].latitude[0]
    assert_allclose(np.degrees(plain.sources["src 3"].latitude[0]), 50.123456789012, rtol=1e-15)
    assert plain.sources["src 4"].latitude[0] == np.radians(10.0)
    assert plain.sources["src 3"].time[0] == 20668 * 86400 + 17220.5
    broken = frames(gnss(3.0, 4.0), sequence=2)
    recording = read(*(line(0.1, 129029, 3, frame) for frame in (*broken[:3], *broken[4:], *mine)))
    assert_allclose(recording.sources["src 3"].latitude, plain.sources["src 3"].latitude)
    assert recording.skipped == {"fast packet incomplete": 1}


def test_magnetic_heading_is_corrected_by_deviation_and_variation():
    own = struct.pack("<BHhhB", 1, 10000, 100, -500, 0xFD)
    bare = struct.pack("<BHhhB", 1, 10000, 0x7FFF, 0x7FFF, 0xFD)
    variation = struct.pack("<BBHh", 1, 0, 20000, 700)
    assert_allclose(read(line(1, 127250, 7, own)).sources["src 7"].heading, [1.0 + 0.01 - 0.05])
    assert_allclose(read(line(1, 127258, 8, variation), line(2, 127250, 7, bare)).sources["src 7"].heading, [1.07])
    alone = read(line(1, 127250, 7, bare))
    assert alone.sources == {} and alone.skipped == {"magnetic angle without variation": 1}
    assert read(line(1, 127250, 7, struct.pack("<BHhhB", 1, 10000, 100, -500, 0xFE))).sources == {}, "an error"


def test_positions_without_a_fix_are_left_out():
    fixes = [line(method, 129029, 3, gnss(1, 2, clock=17220 + method, method=method)) for method in (0, 1, 5, 6)]
    recording = read(*fixes, line(7, 129025, 9, position(90.1, 0)), line(8, 129025, 9, position(-90, 180)))
    assert recording.skipped == {"position not available": 3}
    assert_allclose(recording.sources["src 3"].time, START + np.array([1.0, 5.0]), rtol=0, atol=1e-6)
    pole = recording.sources["src 9"]
    assert (pole.latitude.tolist(), pole.longitude.tolist()) == ([-math.pi / 2.0], [-math.pi])


@pytest.mark.parametrize("pgn", [129029, 126992])
def test_a_wrong_clock_is_set_by_gnss_or_system_time_but_not_by_a_receiver_without_a_date(pgn):
    turn = line(1.5, 127251, 7, struct.pack("<Bi", 1, 3200000))
    for days, corrected in ((20668, -100.0), (0, 0.0)):
        clock = 17220.5 - 100.0
        system = struct.pack("<BBHI", 1, 0, days, round(clock * 1e4))
        recording = read(line(0.5, pgn, 3, system if pgn == 126992 else gnss(1, 2, days, clock)), turn)
        assert_allclose(recording.sources["src 7"].time, [START + 1.5 + corrected], rtol=0, atol=1e-6)
        assert any("corrected by -100.0 s" in note for note in recording.notes) is (corrected < 0.0)


def test_nothing_valid_is_lost_around_damage():
    good = [line(second, 129025, 52, position(10 + second, 20)) for second in range(1, 5)]
    spliced = good[0][:30] + good[1] + "garbage\n" + good[2].replace("02,", "0", 1)[:-4] + "\n" + good[3]
    recording = nmea2000.read(spliced.encode() + b"\x00\xff\xfe,,,\n" + good[0].encode()[:-3])
    assert_allclose(np.degrees(recording.sources["src 52"].latitude), [12.0, 14.0])
    for stamp in ("2026-08-03T04:47:{:06.3f}", "2026-08-03-04:47:{:06.3f}", "2026-08-03 04:47:{:06.3f}"):
        assert read(line(1.25, 129025, 1, position(1, 2), stamp)).sources["src 1"].time[0] == START + 1.25


@pytest.mark.parametrize("run", ["figure8-fast", "wide-turn"])
@pytest.mark.parametrize(("unit", "source"), [("scx20", "src 52"), ("zeus", "src 25")])
def test_the_furuno_runs_agree_with_the_tables_derived_elsewhere(shared_data, run, unit, source):
    folder = shared_data / "data" / "furuno_scx20_n2k"
    recording = nmea2000.read((folder / f"furuno-130842-{run}.raw").read_bytes())
    table = np.genfromtxt(folder / "derived" / f"furuno-130842-{run}_{unit}.csv", delimiter=",", names=True)
    fixes = recording.sources[source]
    fixes = fixes.rows(fixes.has_position)
    _, once = np.unique(table["t"][::-1], return_index=True)
    table = table[::-1][once]
    assert len(fixes) == len(table)
    assert_allclose(fixes.time, table["t"], atol=1e-6, rtol=0)
    assert_allclose(np.degrees(fixes.latitude), table["lat"], atol=1e-9, rtol=0)
    assert_allclose(np.degrees(fixes.longitude), table["lon"], atol=1e-9, rtol=0)
    gyro = recording.sources["src 27"]
    rate = np.degrees(np.interp(fixes.time, gyro.time, gyro.yaw_rate))
    assert np.corrcoef(rate, table["p9_rot_dps"])[0, 1] > 0.999
    assert_allclose(np.polyfit(table["p9_rot_dps"], rate, 1)[0], 1.0, atol=0.01)
    log = recording.sources["src 35"]
    assert np.nanmedian(np.abs(np.interp(fixes.time, log.time, log.water_speed) - table["stw_mps"])) < 0.01


def forms(messages):
    """The log of messages (second, PGN, source, payload) in every form, by name of the form."""
    found = {name: b"" for name in ("canboat", "candump -l", "candump", "Yacht Devices RAW", "Actisense")}
    splitter = Splitter()
    for second, pgn, source, payload in messages:
        stamp = START + second
        clock = f"04:47:{second:06.3f}"
        found["canboat"] += line(second, pgn, source, payload).encode()
        prefix = f"A{clock.replace(':', '')} {source:02X}FF3 {pgn:05X}"
        found["Actisense"] += f"{prefix} {payload.hex().upper()}\r\n".encode()
        for data in splitter.parts(pgn, payload):
            name, text = f"{identifier_of(pgn, source):08X}", data.hex(" ").upper()
            found["candump -l"] += f"({stamp:.6f}) can0 {name}#{text.replace(' ', '')}\n".encode()
            found["candump"] += f" ({stamp:.6f})  can0  {name}   [{len(data)}]  {text}\n".encode()
            found["Yacht Devices RAW"] += f"{clock} R {name} {text}\r\n".encode()
    return found


BUS = [
    (1.0, 127258, 8, struct.pack("<BBHh", 1, 0, 20000, 700)),
    (1.1, 129029, 3, gnss(54.0, 10.0)),
    (1.3, 129025, 3, position(54.0001, 10.0)),
    (1.4, 129026, 3, struct.pack("<BBHHH", 255, 0xFD, 10000, 321, 65535)),
    (1.5, 127250, 7, struct.pack("<BHhhB", 1, 11000, 0x7FFF, 0x7FFF, 0xFD)),
]
"""Magnetic COG and heading, with the variation from another sender; a position with accuracy, and a rapid one."""


@pytest.mark.parametrize("form", forms(BUS))
def test_every_form_of_a_log_and_the_wire_say_the_same(form):
    sources = read(forms(BUS)[form].decode()).sources
    wire = N2kDecoder()
    rows = [
        row
        for second, pgn, source, payload in BUS
        for part in Splitter().parts(pgn, payload)
        for row in wire.frame(Frame(pgn, source, 255, 3, part), 1784609220.0 + second)
    ]
    by_source = {row.source: row for row in rows}
    (gnss_row,) = (row for row in rows if row.source == "src 3 GNSS")
    (course,) = (row for row in rows if math.isfinite(row.cog))
    (rapid,) = (row for row in rows if row.source == "src 3" and row.has_position)
    assert_allclose(sources["src 7"].heading, [1.17])
    assert_allclose(by_source["src 7"].heading, 1.17)
    assert_allclose(course.cog, 1.07)
    receiver = sources["src 3"]
    assert_allclose(receiver.cog[np.isfinite(receiver.cog)], [1.07])
    assert_allclose(receiver.position_std[receiver.has_position], [gnss_row.position_std], rtol=1e-12)
    assert rapid.position_std == gnss_row.position_std > 0.0


def test_the_accuracy_of_a_rapid_position_is_that_of_its_receiver_and_recent():
    log = [(0.1, 129029, 3, gnss(54.0, 10.0))]
    log += [(1.0 + 0.2 * k, 129025, 3, position(54.0 + 1e-5 * k, 10.0)) for k in range(15)]
    log += [(1.05, 129025, 4, position(50.0, 10.0))]
    sources = read(forms(log)["canboat"].decode()).sources
    ages = sources["src 3"].time - sources["src 3"].time[0] + 0.9
    assert_allclose(np.isfinite(sources["src 3"].position_std), ages < 3.0)
    assert not np.isfinite(sources["src 4"].position_std).any()


@pytest.mark.parametrize("in_radians", [False, True])
def test_canboats_json_in_degrees_and_in_radians(in_radians):
    def angle(degrees):
        return math.radians(degrees) if in_radians else degrees

    def message(second, pgn, **fields):
        stamp = STAMP.format(second)
        return json.dumps({"timestamp": stamp, "prio": 2, "src": 3, "dst": 255, "pgn": pgn, "fields": fields}) + "\n"

    recording = read(
        message(1.0, 129026, **{"COG Reference": "True", "COG": angle(222.5), "SOG": 2.5}),
        message(2.0, 129026, **{"COG Reference": {"value": 0, "name": "True"}, "SOG": 655.34}),
        message(3.0, 129029, Date="2021.10.13", Time="09:00:38", Latitude=0, Longitude=0, Method="no GNSS"),
        message(
            4.0, 129029, Date="2021.10.13", Time="09:00:39", Latitude=57.7, Longitude=-11.8, Method="GNSS fix", HDOP=0.9
        ),
        message(5.0, 127251, Rate=angle(-3.0)),
        '{"pgn": 129026}\n',
    )
    fixes = recording.sources["src 3"]
    placed = fixes.rows(fixes.has_position)
    assert_allclose(placed.time, [1634115639.0])
    assert_allclose(np.degrees((placed.latitude[0], placed.longitude[0])), (57.7, -11.8), rtol=1e-12)
    assert_allclose(np.degrees(fixes.cog[np.isfinite(fixes.cog)]), [222.5], atol=0.01)
    assert_allclose(fixes.sog[np.isfinite(fixes.sog)], [2.5])
    assert_allclose(np.degrees(fixes.yaw_rate[np.isfinite(fixes.yaw_rate)]), [-3.0], atol=1e-5)
    assert recording.skipped == {"not a line of NMEA 2000": 1, "position not available": 1}


def test_a_log_with_times_of_the_day_counts_days_over_midnight():
    lines = [f"A235959.{k:03d} 03FF2 1F801 {position(54.0, 10.0).hex().upper()}\n" for k in (100, 600)]
    recording = read(*lines, f"A000000.100 03FF2 1F801 {position(54.0, 10.0).hex().upper()}\n")
    assert_allclose(recording.sources["src 3"].time, [86399.1, 86399.6, 86400.1])
    assert any("no date" in note for note in recording.notes)
