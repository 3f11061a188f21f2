"""Encounters: the closest point of approach (CPA) of pairs of vessels, with its standard deviation.

Before a distance is computed, both positions are interpolated to the same time between two estimates.
"""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import polars as pl

from steerway.archive.store import DAY, Store
from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats
from steerway.core.earth import NAUTICAL_MILE, radii
from steerway.core.errors import InputError

STEP = 60.0
"""Time from one search for pairs to the next, s. Both vessels are assumed to keep their velocity in between."""
_LONGEST_INTERVAL = 600.0
"""Longest interval between two estimates of a vessel in which its position is interpolated, s."""
_APART_AGAIN = 900.0
"""Time (s) for which a pair must be farther apart than the distance before its next approach is a new encounter."""
_FASTEST = 30.0
"""Highest speed that the search allows for, m/s (58 kn). Encounters of faster vessels can be missed."""
_EARTH_RADIUS = 6.371e6
"""Mean radius of the earth (IUGG), m. Its chords are at most 0.5 % shorter than distances on the ellipsoid."""
_COLUMNS = ("mmsi", "track", "time_s", "lat_deg", "lon_deg", "sog_mps", "sog_std_mps", "position_std_m", "status")


def encounters(
    directory: str | Path, distance: float = NAUTICAL_MILE, progress: Callable[[float], None] | None = None
) -> pl.DataFrame:
    """Pairs of vessels that come within `distance` (m) of each other: one row per encounter, in order of time.

    Columns: MMSI and track of both; `start_s` and `end_s`, first and last time within the distance; `cpa_time_s`;
    `tcpa_s`, the time from `start_s` to the CPA; `cpa_m` and its standard deviation; relative speed, position and both
    speeds at the CPA. Raises InputError if the distance is not between 0 and 50 km, or if there is no archive.
    """
    if not 0.0 < distance <= 50e3:
        raise InputError(f"distance is {distance:g} m, expected more than 0 and at most 50 km")
    store = Store.opened(directory)
    days = sorted({day for day, _ in store.done()})
    found: list[pl.DataFrame] = []
    before = None
    for i, day in enumerate(days):
        files = [store.path("estimate", *unit) for unit in sorted(store.done()) if unit[0] == day]
        frame = pl.scan_parquet(files, glob=False).select(_COLUMNS).collect()
        frame = frame.filter(pl.col("lat_deg").is_not_null() & (pl.col("status") != "rejected"))
        whole = frame if before is None else pl.concat([before, frame])
        found += list(_near(whole, day, distance))
        before = frame.filter(pl.col("time_s") > (day + 1) * DAY - _LONGEST_INTERVAL)
        if progress:
            progress((i + 1) / len(days))
    return _encounters(pl.concat(found) if found else pl.DataFrame(schema=_NEAR), distance)


_PAIR = ("mmsi_a", "track_a", "mmsi_b", "track_b")
_OF_CLOSEST = (
    "cpa_time_s", "cpa_m", "cpa_std_m", "relative_speed_mps", "lat_deg", "lon_deg", "sog_a_mps", "sog_b_mps"
)  # fmt: skip
_NEAR = dict.fromkeys(_PAIR, pl.Int64) | dict.fromkeys(("time_s", *_OF_CLOSEST), pl.Float64)


def _near(frame: pl.DataFrame, day: int, distance: float) -> Iterator[pl.DataFrame]:
    """Pairs near each other at each search time of a day, with their closest approach within half a STEP."""
    frame = frame.sort("mmsi", "track", "time_s")
    if len(frame) < 2:
        return
    ids = frame.select("mmsi", "track").unique(maintain_order=True).to_numpy().astype(np.int64)
    columns = {name: frame[name].cast(pl.Float64).fill_null(np.nan).to_numpy() for name in _COLUMNS[2:8]}
    same = (frame["mmsi"].diff() == 0) & (frame["track"].diff() == 0)
    number = np.cumsum(~same.fill_null(False).to_numpy()) - 1
    columns |= {"latitude": np.radians(columns["lat_deg"]), "longitude": np.radians(columns["lon_deg"])}
    time = columns["time_s"]
    span = DAY * 4.0  # one sorted key for all rows: the track, then the time
    origin = (day - 1) * DAY
    order = number * span + (time - origin)
    tracks = np.arange(len(ids))
    for moment in np.arange(day * DAY, (day + 1) * DAY, STEP):
        after = np.searchsorted(order, tracks * span + (moment - origin), side="left")
        inside = (after > 0) & (after < len(order))
        after = np.where(inside, after, 1)
        known = inside & (number[after - 1] == tracks) & (number[after] == tracks)
        elapsed = time[after] - time[after - 1]
        who = np.flatnonzero(known & (elapsed > 0.0) & (elapsed <= _LONGEST_INTERVAL))
        if len(who) >= 2:
            yield from _approaches(columns, ids[who], after[who], moment, distance)


def _approaches(
    columns: dict[str, np.ndarray], ids: np.ndarray, after: np.ndarray, moment: float, distance: float
) -> Iterator[pl.DataFrame]:
    """Pairs that come within a distance (m) around a moment (s).

    Each vessel is between rows after − 1 and after. The search radius is this distance plus the distance that two
    vessels at `_FASTEST` close in half a step.
    """
    from scipy.spatial import cKDTree

    time, row = columns["time_s"], after - 1
    latitude, longitude = columns["latitude"], columns["longitude"]
    elapsed = time[after] - time[row]
    share = (moment - time[row]) / elapsed
    step_longitude = wrap_array(longitude[after] - longitude[row])
    lat, lon = latitude[row] + share * (latitude[after] - latitude[row]), longitude[row] + share * step_longitude
    flat = np.column_stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)]) * _EARTH_RADIUS
    pairs = cKDTree(flat).query_pairs(distance + 2.0 * _FASTEST * STEP / 2.0, output_type="ndarray")
    if not len(pairs):
        return
    i, j = pairs.T
    meridian, prime_vertical = radii(float(np.mean(lat[i])))
    scale = prime_vertical * np.cos(0.5 * (lat[i] + lat[j]))
    north = (lat[j] - lat[i]) * meridian
    east = wrap_array(lon[j] - lon[i]) * scale
    v_n, v_e = (latitude[after] - latitude[row]) / elapsed * meridian, step_longitude / elapsed
    along_n, along_e = v_n[j] - v_n[i], (v_e[j] - v_e[i]) * scale
    speed = np.hypot(along_n, along_e)
    with np.errstate(divide="ignore", invalid="ignore"):
        wait = np.where(speed > 1e-3, -(north * along_n + east * along_e) / speed**2, 0.0)
    wait = np.clip(np.nan_to_num(wait), -0.5 * STEP, 0.5 * STEP)
    closest = np.hypot(north + wait * along_n, east + wait * along_e)
    std = _std(columns, row, after, np.minimum(share, 1.0 - share) * elapsed)
    at = np.flatnonzero(closest <= distance)
    if not len(at):
        return
    i, j = i[at], j[at]
    yield pl.DataFrame(
        {
            "mmsi_a": ids[i, 0],
            "track_a": ids[i, 1],
            "mmsi_b": ids[j, 0],
            "track_b": ids[j, 1],
            "time_s": np.full(len(i), float(moment)),
            "cpa_time_s": moment + wait[at],
            "cpa_m": closest[at],
            "cpa_std_m": np.hypot(std[i], std[j]),
            "relative_speed_mps": speed[at],
            "lat_deg": np.degrees(0.5 * (lat[i] + lat[j])),
            "lon_deg": np.degrees(lon[i]),
            "sog_a_mps": columns["sog_mps"][row[i]],
            "sog_b_mps": columns["sog_mps"][row[j]],
        },
        schema=_NEAR,
    )


def _std(columns: dict[str, np.ndarray], row: np.ndarray, after: np.ndarray, away: Floats) -> np.ndarray:
    """1σ (m) of an interpolated position, from position and speed σ; `away`: time (s) to the nearer estimate."""
    position = np.maximum(columns["position_std_m"][row], columns["position_std_m"][after])
    return np.hypot(position, np.nan_to_num(columns["sog_std_mps"][row]) * away)


def _encounters(near: pl.DataFrame, distance: float) -> pl.DataFrame:
    near = near.sort(*_PAIR, "time_s")
    fresh = (pl.col("time_s").diff().over(_PAIR).fill_null(np.inf) > _APART_AGAIN).cum_sum().over(_PAIR)
    closest = pl.col("cpa_m").arg_min()
    return (
        near.with_columns(encounter=fresh)
        .group_by(*_PAIR, "encounter", maintain_order=True)
        .agg(
            *(pl.col(name).get(closest) for name in _OF_CLOSEST),
            start_s=pl.col("time_s").min(),
            end_s=pl.col("time_s").max(),
        )
        .filter(pl.col("cpa_m") <= distance)
        .select(*_PAIR, "start_s", "end_s", *_OF_CLOSEST, tcpa_s=pl.col("cpa_time_s") - pl.col("start_s"))
        .sort("cpa_time_s", "mmsi_a", "mmsi_b")
    )
