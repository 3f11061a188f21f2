"""The tables and counts that a unit writes, and the table of trips unfinished at the end of the archive."""

from typing import Any, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from steerway.archive.association import Found
from steerway.archive.histories import EVENTS, HISTORY, MODES, TRIP, unfinished
from steerway.archive.store import Store
from steerway.archive.tracks import INTERVALS, LEVELS, STEADY
from steerway.core.arrays import Floats
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
    latitude, longitude, sog, cog, rate, sog_std, cog_std, rate_std, std = estimate[chosen].T
    compass = np.where(cog >= 0.0, np.degrees(cog), np.degrees(cog) + 360.0).astype(np.float32)
    compass = np.where(compass < 360.0, compass, compass - np.float32(360.0))
    course = compass, np.degrees(rate)
    deviations = sog_std, np.degrees(cog_std), np.degrees(rate_std), np.hypot(std, USUAL_STD), std
    single = zip(_SINGLE, (sog, *course, *deviations, found.nis[chosen]), strict=True)
    columns = {
        "mmsi": rows.mmsi[chosen],
        "track": found.track[chosen].astype(np.int16),
        "time_s": rows.time[chosen],
        "lat_deg": pl.Series(np.degrees(latitude), nan_to_null=True),
        "lon_deg": pl.Series(np.degrees(longitude), nan_to_null=True),
    }
    columns |= {name: pl.Series(values.astype(np.float32), nan_to_null=True) for name, values in single}
    return pl.DataFrame(columns | {"status": _STATUS.gather(found.status[chosen])})


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
    fixed = np.flatnonzero(np.isfinite(rows.latitude))
    vessel = np.repeat(np.arange(len(bounds) - 1), np.diff(bounds))[fixed]
    elapsed = np.diff(rows.time[fixed], prepend=np.nan)
    elapsed[np.diff(vessel, prepend=-1) != 0] = np.nan
    status, nis = found.status[fixed], found.nis[fixed]
    under_way = np.isfinite(nis) & (status == OK)
    judged = np.isfinite(nis) & np.isfinite(elapsed) & ((status == OK) | (status == NO_COURSE))
    of_class = found.which[fixed][judged].astype(int) // LEVELS * (len(INTERVALS) + 1)
    cell = 2 * (of_class + np.searchsorted(INTERVALS, elapsed[judged])) + under_way[judged]
    counted = np.searchsorted(COUNTED_INTERVALS, elapsed[np.isfinite(elapsed)])
    vessels = [np.bincount(vessel[under_way], each, len(bounds) - 1) for each in (None, nis[under_way])]
    seen = vessels[0] > 0
    return {
        "rows": int(rows.wanted.sum()),
        "rejected": int((status == REJECTED).sum()),
        "cells": [np.bincount(cell, each, CELLS).tolist() for each in (None, nis[judged])],
        "nis_of": [each[seen].tolist() for each in (rows.mmsi[bounds[:-1]], *vessels)],
        "intervals": np.bincount(counted, minlength=len(COUNTED_INTERVALS) + 1).tolist(),
    }


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
