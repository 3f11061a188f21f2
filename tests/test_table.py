"""Tables: the meaning of columns, the effect of bad cells, and mistakes in units, read correctly or refused."""

import io
import math

import numpy as np
import polars as pl
import pytest
from numpy.testing import assert_allclose

import steerway
from steerway.core import InputError
from steerway.core.testing import KNOT, iso, unix_times
from steerway.formats.testing import table
from tests.scenes import straight
from tests.sentences import only

T = 1672531201.0  # 2023-01-01 00:00:01
DEGREE = np.pi / 180


def read(text):
    return table.read(text.encode() if isinstance(text, str) else text)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|"])
def test_plain_names_and_every_delimiter(delimiter):
    text = "time_s,lat_deg,lon_deg,sog_mps,cog_deg\n1,2,3,4,90\n2,2.5,3.5,5,-90\n".replace(",", delimiter)
    fixes = only(read(text))
    assert_allclose(np.degrees(fixes.latitude), [2.0, 2.5])
    assert_allclose(np.degrees(fixes.cog), [90.0, -90.0])
    assert list(fixes.sog) == [4.0, 5.0]


@pytest.mark.parametrize(
    ("name", "cell"),
    [
        ("Time", "2023-01-01T00:00:01Z"),
        ("timestamp", "2023-01-01 00:00:01"),
        ("UTC", "20230101T000001Z"),
        ("utc_time", "2023-01-01T02:00:01.000+02:00"),
        ("t", "2022-12-31T19:00:01-0500"),
        ("# Timestamp", "01/01/2023 00:00:01"),
        ("time", "1672531201000"),
        ("epoch", "1672531201000000"),
        ("Time [s]", "1.672531201e9"),
    ],
)
def test_spellings_of_time(name, cell):
    assert only(read(f"{name},lat,lon\n{cell},1,2\n")).time[0] == T


def test_spellings_of_place():
    for latitude, longitude in (("LAT", "lng"), ("Latitude_degrees", "Longitude_degrees"), ("lat (°)", "long")):
        fixes = only(read(f"{longitude},time,{latitude}\n-3.5,{T},47.5\n"))
        assert_allclose(np.degrees((fixes.latitude[0], fixes.longitude[0])), (47.5, -3.5))


UNITS = {
    "sog": {"mps m_s ms": 1.0, "kn kt kts knot knots": KNOT, "kmh km_h kph": 1 / 3.6, "mph": 0.44704},
    "yaw_rate": {
        "dps deg_s degps deg_per_s": DEGREE, "dpm deg_min degpm deg_per_min": DEGREE / 60, "radps rad_s rads": 1.0
    },
    "heading": {"deg degrees degree dd": DEGREE, "rad radians": 1.0, "semicircles": np.pi / 2**31},
    "position_std": {"m metres meters": 1.0, "mm": 1e-3},
}  # fmt: skip
OTHER_NAMES = {"SOG": ("sog", KNOT), "speed": ("sog", 1.0), "Speed [m/s]": ("sog", 1.0), "vel (km/h)": ("sog", 1 / 3.6)}
OTHER_NAMES |= {"rot": ("yaw_rate", DEGREE / 60), "yaw rate": ("yaw_rate", DEGREE), "hdg": ("heading", DEGREE)}
OTHER_NAMES |= {
    "stw": ("water_speed", KNOT),
    "hdop": ("position_std", 1.5),
    "hAcc [mm]": ("position_std", 1e-3 * 0.5**0.5),
}


def test_every_unit_that_a_name_may_end_with_and_those_of_names_without():
    for units, digits in {"s sec seconds": 0, "ms msec": 3, "us usec": 6, "ns nsec": 9}.items():
        for unit in units.split():
            assert only(read(f"time_{unit},lat,lon\n{int(T) * 10**digits},1,2\n")).time[0] == T, unit
    named = {
        f"{m}_{unit}": (m, by) for m, all_ in UNITS.items() for units, by in all_.items() for unit in units.split()
    }
    for name, (meaning, factor) in (named | OTHER_NAMES).items():
        recording = read(f"time,lat,lon,{name}\n{T},1,2,{0.5 / factor!r}\n")
        assert_allclose(getattr(only(recording), meaning), 0.5, rtol=1e-12, err_msg=name)
        assert f"{name} as {meaning}" in recording.notes[0]


def test_not_available_in_tables_of_ais():
    text = "MMSI,BaseDateTime,LAT,LON,SOG,COG,Heading,VesselName\n"
    text += '367000000,2023-01-01T00:00:01,29.1,-90.2,102.3,360.0,511.0,"A, B"\n'
    text += "367000000,2023-01-01T00:00:02,91,181,1,2,3,C\n"
    text += "367000000,2023-01-01T00:00:02,29,181,1,2,3,C\n"
    text += "219000001,2023-01-01T00:00:03,29.1,-90.2,10,359.9,100,D\n"
    text += "219000001,2023-01-01T00:00:02,-90,180,102.2,359.9,510,D\n"
    recording = read(text)
    fixes = only(recording)
    assert list(fixes.mmsi) == [219000001, 219000001, 367000000]
    assert list(fixes.time - T) == [1, 2, 0]
    assert list(recording.sources) == ["AIS"]
    assert_allclose(fixes.sog, [102.2 * KNOT, 10 * KNOT, np.nan])
    assert_allclose(np.degrees((fixes.latitude, fixes.longitude)), [[-90.0, 29.1, 29.1], [-180.0, -90.2, -90.2]])
    assert_allclose(np.degrees(fixes.cog), [359.9, 359.9, np.nan])
    assert_allclose(np.degrees(fixes.heading), [np.nan, 100.0, np.nan])
    assert recording.skipped == {"no position": 2}
    # Where it is no AIS, 360° is north.
    assert_allclose(only(read(f"time,lat,lon,cog\n{T},1,2,360.0\n")).cog, 2 * np.pi)


def test_bad_cells_are_counted_with_their_lines_and_a_stray_quote_costs_its_line():
    text = "# a comment\ntime,lat,lon,sog\n1,1,2,3\n\nfoo,1,2,3\n2,bar,2,3\n# another\n3,1,2,baz\n4,1\n5,1,2,3,4,5\n"
    recording = read(text)
    assert_allclose(only(recording).time, [1, 3, 5])
    assert_allclose(only(recording).sog, [3 * KNOT, np.nan, 3 * KNOT])
    assert recording.skipped == {
        "time not understood": 1,
        "lat not understood": 1,
        "sog not understood": 1,
        "no position": 1,
    }
    assert [note for note in recording.notes if note.startswith("line")] == [
        "line 5: 'foo' is not a valid time",
        "line 6: 'bar' is not a valid latitude",
        "line 8: 'baz' is not a valid sog",
    ]
    recording = read('time,lat,lon,name\n1,1,2,"a\n2,1,2,"b, c"\n3,1,2,d\n')
    assert_allclose(only(recording).time, [2, 3])
    assert recording.skipped == {"unbalanced quote": 1}


def test_decimal_commas_and_longitudes_to_360():
    recording = read("time;lat;lon\n1,5;47,25;356,5\n2;47,25;360\n3;47,25;-180\n4;47,25;360,1\n5;47,25;-180,1\n")
    fixes = only(recording)
    assert list(fixes.time) == [1.5, 2.0, 3.0]
    assert_allclose(np.degrees((fixes.latitude, fixes.longitude)), [[47.25] * 3, [-3.5, 0.0, -180.0]])
    assert recording.skipped == {"latitude or longitude out of range": 2}


def test_degrees_and_minutes():
    rows = (
        """1,54°18.5'N,10 30 W""",
        """2,54°18'30"S,W 10°30'00\"""",
        "3,54.30833333333333s,10.5e",
        "4,-54 18.5,-10 30",
        "5,54.5 18 N,10E",  # decimals of a degree and minutes
        "6,54 60 N,10E",
        "7,-54 18 N,10E",
        "8,54 18 E,10E",
        "9,91 N,10E",
    )
    recording = read("time,lat,lon\n" + "\n".join(rows))
    fixes = only(recording)
    assert_allclose(np.degrees(fixes.latitude), (54 + 18.5 / 60) * np.array([1, -1, -1, -1]))
    assert_allclose(np.degrees(fixes.longitude), [-10.5, -10.5, 10.5, -10.5])
    assert recording.skipped == {"lat not understood": 4, "latitude or longitude out of range": 1}


def test_a_row_without_a_place_may_bring_a_heading():
    fixes = only(read("time,lat,lon,heading\n1,1,2,\n2,,,45\n3,,,\n"))
    assert list(fixes.has_position) == [True, False]
    assert_allclose(np.degrees(fixes.heading), [np.nan, 45.0])


def test_missing_columns_are_named():
    with pytest.raises(InputError, match="no column for longitude: found 'time', 'lat', 'x', expected time_s"):
        read("time,lat,x\n1,2,3\n")
    with pytest.raises(InputError, match="line 1 of the table is 'a,b,c', expected names of columns"):
        read("a,b,c\n1,2,3\n")
    assert read("time,lat,lon\n").sources == {}


def parquet(**cells):
    file = io.BytesIO()
    pl.DataFrame(cells).write_parquet(file)
    return file.getvalue()


def test_parquet_with_types():
    stamps = pl.Series([1672531201123], dtype=pl.Datetime("ms"))
    cells = {"timestamp": stamps, "lat": [1.5], "N/S": ["S"], "lon": [2.5], "E/W": ["W"]}
    data = parquet(mmsi=[219000001], **cells)
    fixes = only(read(data))
    assert fixes.time[0] == 1672531201.123
    assert fixes.mmsi[0] == 219000001
    assert_allclose(np.degrees((fixes.latitude[0], fixes.longitude[0])), (-1.5, -2.5))
    with pytest.raises(InputError, match="Parquet file is damaged"):
        read(data[:-30])


def test_the_solent_table_against_numpy(shared_data):
    path = shared_data / "data" / "solent_ais" / "SolentAIS_20160112_130211.csv"
    rows = np.genfromtxt(path, delimiter=",", skip_header=1, dtype=None, encoding="utf-8")
    fixes = only(table.read(path.read_bytes()))
    time = np.array([row[0] for row in rows.tolist()], dtype="datetime64[ms]").astype(np.int64) / 1000.0
    order = np.lexsort((time, rows["f1"]))
    assert len(fixes) == len(rows) == 18623
    assert np.array_equal(fixes.mmsi, rows["f1"][order])
    assert_allclose(fixes.time, time[order], atol=1e-6, rtol=0)
    assert_allclose(np.degrees(fixes.latitude), rows["f2"][order], rtol=1e-15)
    assert_allclose(fixes.sog, rows["f5"][order] * KNOT, rtol=1e-15)
    assert np.isnan(fixes.cog).sum() == (rows["f4"] == 360).sum() == 1027


def test_dates_there_and_back():
    times = np.array([0.0, 1e9 + 0.1, T + 0.123456, -86399.5, 951782400.0, 1.7e9 + 2**-22])
    assert np.array_equal(unix_times([iso(time) for time in times]), times)
    assert np.isnan(unix_times(["2023-02-30T00:00:00", "31/31/2023 00:00", "noon", "", None])).all()
    clocks = ("12:00:01 am", "1:00:01AM", "12:00:01 PM", "11:00:01 pm Z", "0:30 AM")
    after = unix_times([f"2023-01-02 {clock}" for clock in clocks]) - unix_times(["2023-01-02T00:00:01Z"])
    assert_allclose(after, [0.0, 3600.0, 43200.0, 82800.0, np.nan])
    assert unix_times(["12/31/2023 00:00:01"])[0] == unix_times(["2023-12-31T00:00:01Z"])[0]


def log(names, *cells, place=(63.4, 10.3)):
    """CSV of a straight track at 2 m/s on 0.7 rad with 0.3 m of noise; `cells` are more, equal in every row."""
    fixes = straight(2.0, 0.7, 119.0, 1.0, np.radians(place)).fixes(0.3, 5)
    rows = zip(fixes.time, np.degrees(fixes.latitude), np.degrees(fixes.longitude), strict=True)
    more = "".join(f",{each:.4f}" for each in cells)
    return "\n".join([f"time,{names}", *(f"{t:.0f},{a:.8f},{o:.8f}{more}" for t, a, o in rows)])


@pytest.mark.parametrize(("unit", "words"), [(1.0, "m/s"), (KNOT, "knots"), (1 / 3.6, "km/h")])
def test_the_unit_of_a_bare_speed_is_that_of_the_positions(unit, words):
    for name in ("sog", "Speed"):
        recording = read(log(f"lat,lon,{name}", 2.0 / unit))
        assert_allclose(only(recording).sog, 2.0, rtol=1e-3)
        assert f"{name} as sog in {words} (by the positions)" in recording.notes[0]
        assert "by the positions" not in read(log(f"lat,lon,{name}", 30.0)).notes[0]
    # A unit in the name is never overruled.
    assert_allclose(only(read(log("lat,lon,sog_kn", 2.0))).sog, 2.0 * KNOT, rtol=1e-9)


def test_angles_may_be_in_radians_and_positions_only_if_named_so():
    for value in (0.7, math.degrees(0.7)):
        assert_allclose(only(read(log("lat,lon,cog", value))).cog, 0.7, atol=1e-4)
    rows = "".join(f"{T + k},{math.radians(63.4 + 1e-5 * k):.10f},{math.radians(10.3):.10f}\n" for k in range(20))
    with pytest.raises(InputError, match=r"'latitude' and 'longitude' .* may be radians, expected names"):
        read("time,latitude,longitude\n" + rows)
    fixes = only(read("time,lat_rad,lon_rad\n" + rows))
    assert_allclose(np.degrees(fixes.latitude[0]), 63.4, atol=1e-6)
    assert len(only(read(log("lat,lon", place=(0.5, 10.3))))) == 120


def test_a_time_without_a_date_is_left_out():
    recording = read(f"time_s,lat_deg,lon_deg\n{T},54,10\n1e300,54,10\n-1e12,54,10\n{T + 1},54,10\n")
    assert only(recording).time.tolist() == [T, T + 1]
    assert recording.skipped == {"time_s not understood": 2}
    assert len(only(read(parquet(time_s=[T, 1e300, T + 1.0], lat_deg=[54.0] * 3, lon_deg=[10.0] * 3)))) == 2


@pytest.mark.parametrize("row", ["{t},54.1234\u0663,10.1", "{t},N 54 12.\u0663,10.1", "\u0662\u0660{t},54.1,10.1"])
def test_digits_of_other_scripts_are_no_numbers_and_spreadsheets_write_utf_16(row):
    rows = [row.format(t=T), *(f"{T + k},54.{k:05d},10.1" for k in range(1, 9))]
    for encoding in ("utf-8", "utf-16", "utf-8-sig"):
        assert len(steerway.read("\n".join(["time_s,lat_deg,lon_deg", *rows]).encode(encoding))) == 8
