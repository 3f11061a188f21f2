"""Tables: the meaning of columns, the effect of bad cells, and our own output read back."""

import io

import numpy as np
import polars as pl
import pytest
from numpy.testing import assert_allclose

from steerway.core import InputError
from steerway.core.testing import KNOT, iso, unix_times
from steerway.formats.testing import table
from tests.sentences import only

T = 1672531201.0  # 2023-01-01 00:00:01


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
        ("BaseDateTime", "2023-01-01T00:00:01"),
        ("UTC", "20230101T000001Z"),
        ("utc_time", "2023-01-01T02:00:01.000+02:00"),
        ("t", "2022-12-31T19:00:01-0500"),
        ("# Timestamp", "01/01/2023 00:00:01"),
        ("time", "1672531201"),
        ("time", "1672531201000"),
        ("epoch", "1672531201000000"),
        ("Time [s]", "1.672531201e9"),
    ],
)
def test_spellings_of_time(name, cell):
    assert only(read(f"{name},lat,lon\n{cell},1,2\n")).time[0] == T


@pytest.mark.parametrize(
    ("latitude", "longitude"),
    [
        ("lat", "lon"),
        ("LAT", "LON"),
        ("Latitude_degrees", "Longitude_degrees"),
        ("Latitude", "lng"),
        ("lat (°)", "long"),
    ],
)
def test_spellings_of_place(latitude, longitude):
    fixes = only(read(f"{longitude},time,{latitude}\n-3.5,{T},47.5\n"))
    assert_allclose(np.degrees((fixes.latitude[0], fixes.longitude[0])), (47.5, -3.5))


@pytest.mark.parametrize(
    ("name", "factor"), [("SOG", KNOT), ("speed", 1.0), ("Speed [m/s]", 1.0), ("speed (km/h)", 1 / 3.6)]
)
def test_units_of_speed(name, factor):
    recording = read(f"time,lat,lon,{name}\n{T},1,2,10\n")
    assert_allclose(only(recording).sog, 10 * factor, rtol=1e-12)
    assert f"{name} as sog" in recording.notes[0]


DEGREE = np.pi / 180
UNITS = {
    "sog": {"mps m_s ms": 1.0, "kn kt kts knot knots": KNOT, "kmh km_h kph": 1 / 3.6, "mph": 0.44704},
    "yaw_rate": {
        "dps deg_s degps deg_per_s": DEGREE, "dpm deg_min degpm deg_per_min": DEGREE / 60, "radps rad_s rads": 1.0
    },
    "heading": {"deg degrees degree dd": DEGREE, "rad radians": 1.0, "semicircles": np.pi / 2**31},
    "position_std": {"m metres meters": 1.0, "mm": 1e-3},
}  # fmt: skip


def test_every_unit_of_time_that_a_name_may_end_with():
    for units, digits in {"s sec seconds": 0, "ms msec": 3, "us usec": 6, "ns nsec": 9}.items():
        for unit in units.split():
            assert only(read(f"time_{unit},lat,lon\n{int(T) * 10**digits},1,2\n")).time[0] == T, unit


@pytest.mark.parametrize("meaning", UNITS)
def test_every_unit_that_a_name_may_end_with(meaning):
    for units, factor in UNITS[meaning].items():
        for unit in units.split():
            fixes = only(read(f"time,lat,lon,{meaning}_{unit}\n{T},1,2,{0.5 / factor!r}\n"))
            assert_allclose(getattr(fixes, meaning), 0.5, rtol=1e-12, err_msg=unit)


def test_rates_headings_and_deviations():
    fixes = only(read(f"time,lat,lon,heading_deg,rot,position_std_m,stw_kn\n{T},1,2,350,-2,0.5,3\n"))
    assert_allclose(np.degrees((fixes.heading[0], fixes.yaw_rate[0])), (350.0, -2.0 / 60.0))
    assert_allclose((fixes.position_std[0], fixes.water_speed[0]), (0.5, 3 * KNOT))


def test_not_available_in_tables_of_ais():
    text = "MMSI,BaseDateTime,LAT,LON,SOG,COG,Heading,VesselName\n"
    text += '367000000,2023-01-01T00:00:01,29.1,-90.2,102.3,360.0,511.0,"A, B"\n'
    text += "367000000,2023-01-01T00:00:02,91,181,1,2,3,C\n"
    text += "367000000,2023-01-01T00:00:02,29,181,1,2,3,C\n"
    text += "219000001,2023-01-01T00:00:03,29.1,-90.2,10,359.9,100,D\n"
    recording = read(text)
    fixes = only(recording)
    assert list(fixes.mmsi) == [219000001, 367000000]
    assert list(recording.sources) == ["AIS"]
    assert_allclose(fixes.sog, [10 * KNOT, np.nan])
    assert_allclose(np.degrees(fixes.cog), [359.9, np.nan])
    assert_allclose(np.degrees(fixes.heading), [100.0, np.nan])
    assert recording.skipped == {"no position": 2}
    # Where it is no AIS, 360° is north.
    assert_allclose(only(read(f"time,lat,lon,cog\n{T},1,2,360.0\n")).cog, 2 * np.pi)


def test_bad_cells_are_counted_with_their_lines():
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


def test_a_stray_quote_costs_its_line():
    recording = read('time,lat,lon,name\n1,1,2,"a\n2,1,2,"b, c"\n3,1,2,d\n')
    assert_allclose(only(recording).time, [2, 3])
    assert recording.skipped == {"unbalanced quote": 1}


def test_decimal_commas_and_longitudes_to_360():
    fixes = only(read("time;lat;lon\n1,5;47,25;356,5\n"))
    assert fixes.time[0] == 1.5
    assert_allclose(np.degrees((fixes.latitude[0], fixes.longitude[0])), (47.25, -3.5))


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


def test_rows_come_in_time_order_by_vessel():
    fixes = only(read("mmsi,time,lat,lon\n2,5,1,1\n1,7,1,1\n2,3,1,1\n"))
    assert list(fixes.mmsi) == [1, 2, 2]
    assert list(fixes.time) == [7, 3, 5]


def test_parquet_with_types():
    stamps = pl.Series("timestamp", [1672531201123], dtype=pl.Datetime("ms"))
    cells = {"mmsi": [219000001], "lat": [1.5], "N/S": ["S"], "lon": [2.5], "E/W": ["W"]}
    frame = pl.DataFrame([stamps, *pl.DataFrame(cells)])
    file = io.BytesIO()
    frame.write_parquet(file)
    fixes = only(table.read(file.getvalue()))
    assert fixes.time[0] == 1672531201.123
    assert fixes.mmsi[0] == 219000001
    assert_allclose(np.degrees((fixes.latitude[0], fixes.longitude[0])), (-1.5, -2.5))
    with pytest.raises(InputError, match="Parquet file is damaged"):
        table.read(file.getvalue()[:-30])


def test_the_solent_table_against_numpy(shared_data):
    path = shared_data / "data" / "solent_ais" / "SolentAIS_20160112_130211.csv"
    rows = np.genfromtxt(path, delimiter=",", skip_header=1, dtype=None, encoding="utf-8")
    fixes = only(table.read(path.read_bytes()))
    time = np.array([row[0] for row in rows.tolist()], dtype="datetime64[ms]").astype(np.int64) / 1000.0
    order = np.lexsort((time, rows["f1"]))
    assert len(fixes) == len(rows) == 18623
    assert len(set(fixes.mmsi.tolist())) == 91
    assert np.array_equal(fixes.mmsi, rows["f1"][order])
    assert_allclose(fixes.time, time[order], atol=1e-6, rtol=0)
    assert_allclose(np.degrees(fixes.latitude), rows["f2"][order], rtol=1e-15)
    assert_allclose(fixes.sog, rows["f5"][order] * KNOT, rtol=1e-15)
    assert np.isnan(fixes.cog).sum() == (rows["f4"] == 360).sum() == 1027


def test_dates_there_and_back():
    times = np.array([0.0, 1e9 + 0.1, T + 0.123456, -86399.5, 951782400.0, 1.7e9 + 2**-22])
    assert np.array_equal(unix_times([iso(time) for time in times]), times)
    assert np.isnan(unix_times(["2023-02-30T00:00:00", "31/31/2023 00:00", "noon", "", None])).all()
    assert_allclose(
        unix_times(
            [f"2023-01-02 {clock}" for clock in ("12:00:01 am", "1:00:01AM", "12:00:01 PM", "11:00:01 pm Z", "0:30 AM")]
        )
        - unix_times(["2023-01-02T00:00:01Z"]),
        [0.0, 3600.0, 43200.0, 82800.0, np.nan],
    )
    assert unix_times(["12/31/2023 00:00:01"])[0] == unix_times(["2023-12-31T00:00:01Z"])[0]
