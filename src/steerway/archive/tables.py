"""The tables and counts that a unit writes, and the table of trips unfinished at the end of the archive."""

import math
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from steerway.archive.association import Found
from steerway.archive.histories import EVENTS, HISTORY, MODES, TRIP, unfinished
from steerway.archive.store import Store
from steerway.archive.tracks import INTERVALS, LEVELS, STEADY
from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.files import complete_or_absent
from steerway.core.records import NO_COURSE, OK, REJECTED, STATUSES
from steerway.core.slow_error import USUAL_STD
from steerway.formats.ais_tables import MOBILES

UNFINISHED = "unfinished.parquet"
COUNTED_INTERVALS = (2.5, 5.0, 7.5, 10.5, 15.0, 30.5, 60.5, 120.5, 180.5, 600.0, 1800.0)
"""Upper limits of the classes of intervals that are counted, s."""
CELLS = len(MOBILES) * (LEVELS - STEADY)
"""Cells of the consistency table: class of vessel × interval (`tracks.INTERVALS`) × at rest or under way."""
_STATUS, _EVENT, _MODE = (pl.Series(names, dtype=pl.Enum(names)) for names in (STATUSES, EVENTS, MODES))
_SINGLE = (
    "sog_mps",
    "cog_deg",
    "course_rate_dps",
    "sog_std_mps",
    "cog_std_deg",
    "course_rate_std_dps",
    "position_std_m",
    "position_relative_std_m",
    "nis",
)


class UnitRows(NamedTuple):
    """Reports by vessel and time, with rows that only request output (NaN latitude)."""

    mmsi: np.ndarray
    time: np.ndarray
    latitude: np.ndarray  # rad
    longitude: np.ndarray
    digit: np.ndarray  # rad, as in Reports
    reported: np.ndarray  # (n, 4) latitude, longitude, SOG, COG
    aids: np.ndarray
    hull: np.ndarray
    mobile: np.ndarray  # class of the vessel
    wanted: np.ndarray  # whether the row is in the output
    asked: np.ndarray  # as in Reports


def estimate_table(rows: UnitRows, found: Found, order: NDArray[np.int64], estimate: Floats) -> pl.DataFrame:
    """The output rows in the given order, with the columns of `steerway estimate`."""
    chosen = order if rows.wanted.all() else order[rows.wanted[order]]
    places, single = np.empty((2, len(chosen))), np.empty((len(_SINGLE), len(chosen)), np.float32)
    _fill(chosen, estimate, found.nis, places, single)
    columns = {
        "mmsi": rows.mmsi[chosen],
        "track": found.track[chosen].astype(np.int16),
        "time_s": rows.time[chosen],
        "lat_deg": pl.Series(places[0], nan_to_null=True),
        "lon_deg": pl.Series(places[1], nan_to_null=True),
    }
    columns |= {name: pl.Series(values, nan_to_null=True) for name, values in zip(_SINGLE, single, strict=True)}
    return pl.DataFrame(columns | {"status": _STATUS.gather(found.status[chosen])})


@kernel
def _fill(
    chosen: NDArray[np.int64], estimate: Floats, nis: Floats, places: Floats, single: NDArray[np.float32]
) -> None:
    """Fill positions (2, n) and single-precision columns (9, n) in degrees, from rows in radians."""
    degrees = 180.0 / np.pi
    for j in range(len(chosen)):
        k = chosen[j]
        e = estimate[k]
        places[0, j], places[1, j] = degrees * e[0], degrees * e[1]
        compass = np.float32(degrees * e[3] if e[3] >= 0.0 else degrees * e[3] + 360.0)
        single[0, j], single[1, j], single[2, j] = e[2], compass if compass < 360.0 else compass - 360.0, degrees * e[4]
        single[3, j], single[4, j], single[5, j] = e[5], degrees * e[6], degrees * e[7]
        single[6, j], single[7, j], single[8, j] = math.hypot(e[8], USUAL_STD), e[8], nis[k]


def event_table(tracks: NDArray[np.int64], events: np.ndarray) -> pl.DataFrame:
    """The table of events, from (n,) EVENT. tracks: (t, 2) MMSI and number of the tracks that events index."""
    return pl.DataFrame(
        _of_tracks(tracks, events)
        | {
            "event": _EVENT.gather(events["kind"].astype(np.uint32)),
            "start_s": events["start"],
            "end_s": events["end"],
            "lat_deg": np.degrees(events["latitude"]),
            "lon_deg": np.degrees(events["longitude"]),
            "value": events["value"],
            "reports": events["rows"].astype(np.int32),
        }
    )


def trip_table(tracks: NDArray[np.int64], trips: np.ndarray) -> pl.DataFrame:
    """The table of trips and stops, from (n,) TRIP. tracks: (t, 2) MMSI and number of the tracks that trips index."""
    duration = trips["end"] - trips["start"]
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(duration > 0.0, trips["distance"] / duration, np.nan)
    return pl.DataFrame(
        _of_tracks(tracks, trips)
        | {
            "what": _MODE.gather(trips["mode"].astype(np.uint32)),
            "start_s": trips["start"],
            "end_s": trips["end"],
            "start_lat_deg": np.degrees(trips["start_latitude"]),
            "start_lon_deg": np.degrees(trips["start_longitude"]),
            "end_lat_deg": np.degrees(trips["end_latitude"]),
            "end_lon_deg": np.degrees(trips["end_longitude"]),
            "distance_m": trips["distance"],
            "duration_s": duration,
            "mean_speed_mps": pl.Series(mean, nan_to_null=True),
            "greatest_sog_mps": trips["greatest_speed"],
        }
    )


def _of_tracks(tracks: NDArray[np.int64], rows: np.ndarray) -> dict[str, np.ndarray]:
    """Columns with MMSI and track of events or trips."""
    of_row = tracks[rows["track"].astype(np.int64)]
    return {"mmsi": of_row[:, 0], "track": of_row[:, 1].astype(np.int16)}


def numbers(rows: UnitRows, found: Found, bounds: NDArray[np.int64]) -> dict[str, Any]:
    """Counts of a unit for the page: fixes and sum of NIS, by cell (CELLS) and by vessel; intervals; rejections.

    bounds: (vessels + 1,) where in the rows each vessel begins.
    """
    cells, vessels = np.zeros((2, CELLS)), np.zeros((2, len(bounds) - 1))
    intervals = np.zeros(len(COUNTED_INTERVALS) + 1, np.int64)
    record = (rows.time, rows.latitude, found.nis, found.status, found.which)
    rejected = _count(bounds, record, cells, vessels, intervals)
    seen = vessels[0] > 0.0
    return {
        "rows": int(rows.wanted.sum()),
        "rejected": rejected,
        "cells": cells.tolist(),
        "nis_of": [rows.mmsi[bounds[:-1]][seen].tolist(), *vessels[:, seen].tolist()],
        "intervals": intervals.tolist(),
    }


@kernel
def _count(
    bounds: NDArray[np.int64],
    record: tuple[np.ndarray, ...],
    cells: Floats,
    vessels: Floats,
    intervals: NDArray[np.int64],
) -> int:
    """Add fixes and NIS to cells (2, CELLS) and, if under way, to vessels (2, v); count intervals.

    Returns the number of rejected fixes.
    """
    time, latitude, nis, status, which = record
    rejected = 0
    for v in range(len(bounds) - 1):
        last = np.nan
        for k in range(bounds[v], bounds[v + 1]):
            if not np.isfinite(latitude[k]):
                continue
            elapsed, last = time[k] - last, time[k]
            follows = np.isfinite(elapsed)
            if follows:
                place = 0
                for edge in COUNTED_INTERVALS:
                    place += elapsed > edge
                intervals[place] += 1
            if status[k] == REJECTED:
                rejected += 1
            elif np.isfinite(nis[k]) and (status[k] == OK or status[k] == NO_COURSE):
                if status[k] == OK:
                    vessels[0, v] += 1.0
                    vessels[1, v] += nis[k]
                if follows:
                    mobile, cell = which[k] // LEVELS, 0
                    for edge in INTERVALS:
                        cell += elapsed > edge
                    cell = 2 * (mobile * (len(INTERVALS) + 1) + cell) + (status[k] == OK)
                    cells[0, cell] += 1.0
                    cells[1, cell] += nis[k]
    return rejected


def write_unfinished_trips(store: Store) -> None:
    """Write trips/unfinished.parquet: the trip or stop in which each track ends."""
    tables = []
    last_days = {bucket: day for day, bucket in sorted(store.done())}
    for bucket, day in last_days.items():
        state = store.state(day, bucket)
        trips = np.zeros(len(state.tracks), TRIP)
        count = unfinished(state.carry.view(HISTORY), trips)
        tables.append(trip_table(state.tracks, trips[:count]))
    if not tables:
        return
    (store.root / "trips").mkdir(exist_ok=True)
    with complete_or_absent(store.root / "trips" / UNFINISHED) as file:
        pl.concat(tables).sort("mmsi", "track", "start_s").write_parquet(file)
