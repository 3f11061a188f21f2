"""The unit of work: the reports of one bucket of vessels on one day, from yesterday's state to today's."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from steerway.archive.association import Fleet, Found, associate, empty_fleet, empty_found
from steerway.archive.filters import Filters, State, empty_states
from steerway.archive.histories import EVENT, HISTORY, TRIP, history
from steerway.archive.levels import filters as filters_of_levels
from steerway.archive.smoothing import smoothed
from steerway.archive.store import DAY, BucketState, Store
from steerway.archive.tables import UnitRows, estimate_table, event_table, numbers, trip_table
from steerway.archive.tracks import CURRENT_TRACK, MOVED, TRACK, TRACKED, VESSEL, Reports
from steerway.core.arrays import Floats
from steerway.core.files import complete_or_absent
from steerway.core.gaps import LONGEST_GAP
from steerway.core.records import REJECTED
from steerway.estimation.filter.model import RUN
from steerway.estimation.vessel.aids import AIDS, NO_AIDS

LOOKAHEAD = 3600.0
"""Length of the part of the next day that smoothing uses, s. A fix influences only the estimates of minutes before."""
_AT_ONCE = 1e-4
"""Tolerance of an output time, s: a report closer than this replaces the output row."""
_ORDER = ("mmsi", "time_s", "lat_deg", "lon_deg", "sog_mps", "cog_deg", "heading_deg", "hull", "mobile", "digit")
_LEAST_EVENTS = 1000


@dataclass(frozen=True)
class Work:
    """A unit and its settings, as sent to a worker."""

    directory: str
    day: int  # since 1970
    bucket: int
    before: int | None  # day whose state the unit starts from
    digits: dict[str, float]  # position resolution (°) of inputs, by key
    profiles: Sequence[Sequence[dict[str, Any]]]  # by class (`formats.ais_tables.MOBILES`) and level
    aid: Sequence[str] = ()
    smooth: bool = False
    rate: float | None = None


def run_unit(work: Work) -> dict[str, Any]:
    """Filter a unit, write its tables and then its state; returns its counts."""
    store = Store(Path(work.directory))
    filters = filters_of_levels(work.profiles, tuple(work.aid), work.smooth)
    frame = store.staged(work.day, work.bucket, work.digits)
    received = len(frame)
    frame = _ordered(frame)
    state = store.state(work.before, work.bucket) if work.before is not None else _no_state(filters)
    until = (work.day + 1) * DAY + LOOKAHEAD
    following = _ordered(store.staged(work.day + 1, work.bucket, work.digits, until))
    if not work.smooth and work.rate is None:
        following = following.clear()
    rows = _rows(frame, work)
    if work.rate is not None:
        reports = _rows(pl.concat([frame, following]).sort("mmsi", maintain_order=True), work)
        rows = _on_grid(rows, work, work.rate, filters, state, reports)
    state = _with_vessels(state, np.unique(rows.mmsi), filters)
    found = _filtered(rows, filters, state, work.smooth)
    order, bounds = _by_track(rows.mmsi, found.track)
    estimate = _smoothed(rows, found, following, filters, state, work) if work.smooth else found.estimate
    first = order[bounds[:-1]]
    tracks = np.column_stack([rows.mmsi[first], found.track[first]])
    state, events, trips = _histories(rows, found, order, bounds, estimate, tracks, state)
    tables = {
        "estimate": estimate_table(rows, found, order, estimate),
        "events": event_table(tracks, events),
        "trips": trip_table(tracks, trips),
    }
    for kind, table in tables.items():
        with complete_or_absent(store.path(kind, work.day, work.bucket)) as file:
            table.write_parquet(file, compression="zstd", compression_level=1)
    counts = numbers(rows, found, _bounds(rows.mmsi)) | {
        "reports": received,
        "doubled": received - len(frame),
        "looked_ahead": len(following),
    }
    store.finish(work.day, work.bucket, state, counts)
    return counts


def _ordered(frame: pl.DataFrame) -> pl.DataFrame:
    """The reports by vessel and time, whatever the order of files; duplicates are left out."""
    mmsi, time = frame["mmsi"].to_numpy(), frame["time_s"].to_numpy()
    order, kept = np.lexsort((time, mmsi)), np.ones(len(frame), bool)
    same = (np.diff(mmsi[order]) == 0) & (np.diff(time[order]) == 0)
    tied = np.union1d(np.flatnonzero(same), np.flatnonzero(same) + 1)
    # Only tied rows are sorted by all columns: sorting all rows that way would double the time.
    ranked = frame[order[tied]].with_columns(place=order[tied]).sort(_ORDER, nulls_last=True)
    again = ranked.select(pl.all_horizontal(pl.col(name) == pl.col(name).shift() for name in _ORDER[:4])).to_series()
    order[tied] = ranked["place"].to_numpy()
    kept[tied] = ~again.fill_null(False).to_numpy()
    return frame[order[kept]]


def _rows(frame: pl.DataFrame, work: Work) -> UnitRows:
    # Writable arrays everywhere, so that kernels are compiled for one type.
    vessel, time = (frame[name].to_numpy(writable=True) for name in ("mmsi", "time_s"))
    hull = frame["hull"].to_numpy().astype(np.int64)
    values = (frame[name].cast(pl.Float64).fill_null(np.nan).to_numpy() for name in _ORDER[2:7])
    latitude, longitude, sog, cog, heading = values
    latitude, longitude, cog, heading = (np.radians(each) for each in (latitude, longitude, cog, heading))
    reported = np.column_stack([latitude, longitude, sog, cog])
    known = {"sog": sog, "cog": cog, "heading": heading}
    unknown = np.full(len(frame), np.nan)
    aids = NO_AIDS
    if work.aid:
        aids = np.column_stack([known.get(name, unknown) if name in work.aid else unknown for name in AIDS])
    mobile = frame["mobile"].to_numpy().astype(np.int64)
    digit = np.radians(frame["digit"].to_numpy())
    wanted = np.ones(len(frame), bool)
    asked = np.full(len(frame), CURRENT_TRACK)
    return UnitRows(vessel, time, latitude, longitude, digit, reported, aids, hull, mobile, wanted, asked)


def _on_grid(
    rows: UnitRows, work: Work, rate: float, filters: Filters, state: BucketState, reports: UnitRows
) -> UnitRows:
    """Add output rows at a rate (Hz) between the reports of each track; reports off that grid are not output.

    reports: those of the day and the first ones of the next. A first pass of the filters assigns them to tracks.
    """
    seen = _filtered(reports, filters, _with_vessels(state, np.unique(reports.mmsi), filters), False)
    taken = seen.status != REJECTED
    vessel, slot = np.nonzero(state.slots["use"] == TRACKED)
    before = state.slots[vessel, slot]
    low, high = (math.ceil(day * DAY * rate) for day in (work.day, work.day + 1))
    now, following = pl.col("time"), pl.col("time").shift(-1).over("mmsi", "track")
    columns = {
        "mmsi": np.concatenate([state.mmsi[vessel], reports.mmsi[taken]]),
        "track": np.concatenate([before["number"].astype(np.int64), seen.track[taken]]),
        "time": np.concatenate([before["last"], reports.time[taken]]),
    }
    first, stop = ((now + _AT_ONCE) * rate).ceil(), ((following - _AT_ONCE) * rate).floor() + 1.0
    between = pl.int_ranges(*(each.clip(low, high).cast(pl.Int64) for each in (first, stop)))
    bridged = pl.DataFrame(columns).sort("mmsi", "track", "time", maintain_order=True)
    bridged = bridged.with_columns(place=pl.when(following - now <= LONGEST_GAP).then(between)).drop("time")
    refused = {"mmsi": reports.mmsi[~taken], "track": seen.track[~taken]}
    refused["place"], refused_on_grid = _on_the_grid(reports.time[~taken], rate)
    grid = bridged.explode("place").drop_nulls()
    grid = grid.join(pl.DataFrame(refused).filter(refused_on_grid), on=["mmsi", "track", "place"], how="anti")
    n = len(grid)
    added = {
        "mmsi": grid["mmsi"].to_numpy(),
        "time": grid["place"].to_numpy() / rate,
        "asked": grid["track"].to_numpy(),
    }
    added |= {"digit": np.zeros(n), "wanted": np.ones(n, bool)}
    rows = rows._replace(wanted=_on_the_grid(rows.time, rate)[1])

    def with_grid(name: str, given: np.ndarray) -> np.ndarray:
        blank = np.full((n, *given.shape[1:]), np.nan if given.dtype.kind == "f" else 0, given.dtype)
        return given if name == "aids" and not len(given) else np.concatenate([given, added.get(name, blank)])

    whole = UnitRows(*(with_grid(*each) for each in rows._asdict().items()))
    order = np.lexsort((whole.asked, whole.time, whole.mmsi))
    return UnitRows(*(each[order] if len(each) else each for each in whole))


def _on_the_grid(time: Floats, rate: float) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Number of the grid point nearest to each time, at a rate (Hz), and whether the time is on that point."""
    place = np.round(time * rate)
    return place.astype(np.int64), np.abs(time - place / rate) < _AT_ONCE


def _no_state(filters: Filters) -> BucketState:
    arrays = _arrays(empty_fleet(0, filters))
    return BucketState(np.zeros(0, np.int64), np.zeros((0, 2), np.int64), np.zeros(0, HISTORY), *arrays)


def _arrays(fleet: Fleet) -> tuple[np.ndarray, ...]:
    return (fleet.vessels, fleet.tracks, *fleet.states)


def _with_vessels(state: BucketState, mmsi: NDArray[np.int64], filters: Filters) -> BucketState:
    """The state, with empty vessels added for new MMSI."""
    new = np.setdiff1d(mmsi, state.mmsi)
    numbers = np.concatenate([state.mmsi, new])
    place = np.argsort(numbers, kind="stable")
    added = _arrays(empty_fleet(len(new), filters))
    arrays = (np.concatenate([each, more])[place] for each, more in zip(state.arrays, added, strict=True))
    return BucketState(numbers[place], state.tracks, state.carry, *arrays)


def _filtered(rows: UnitRows, filters: Filters, state: BucketState, keep: bool) -> Found:
    """Run the rows through the filters of `state`, which are updated. keep: store filter states for smoothing."""
    n = len(rows.time)
    found = empty_found(n, n if keep else 0, filters)
    bounds = _bounds(rows.mmsi)
    here = np.searchsorted(state.mmsi, rows.mmsi[bounds[:-1]])
    vessels, tracks, x, p, probability, run = (each[here] for each in state.arrays)
    fleet = Fleet(vessels.view(VESSEL), tracks.view(TRACK), State(x, p, probability, run.view(RUN)))
    reports = Reports(*(getattr(rows, name) for name in Reports._fields))
    associate(bounds, reports, filters, fleet, found, empty_states((2,), filters))
    for whole, part in zip(state.arrays, _arrays(fleet), strict=True):
        whole[here] = part
    return found


def _bounds(mmsi: NDArray[np.int64]) -> np.ndarray:
    """Where the rows of each vessel begin, and the number of rows."""
    return np.r_[0, np.flatnonzero(np.diff(mmsi)) + 1, len(mmsi)] if len(mmsi) else np.zeros(1, np.int64)


def _by_track(mmsi: NDArray[np.int64], track: NDArray[np.int64]) -> tuple[np.ndarray, np.ndarray]:
    """Row numbers sorted by vessel and track, in order of time, and where each track begins."""
    order = np.lexsort((track, mmsi))
    change = (np.diff(mmsi[order]) != 0) | (np.diff(track[order]) != 0)
    return order, np.r_[0, np.flatnonzero(change) + 1, len(order)] if len(order) else np.zeros(1, np.int64)


def _smoothed(
    rows: UnitRows, found: Found, following: pl.DataFrame, filters: Filters, state: BucketState, work: Work
) -> np.ndarray:
    """The smoothed estimate, for which the first LOOKAHEAD s of the next day are used too.

    A track is smoothed in pieces, which end at long gaps and where a ship went on at another place (MOVED).
    """
    ahead = _rows(following, work)
    later = _with_vessels(state, np.unique(ahead.mmsi), filters)
    beyond = _filtered(ahead, filters, BucketState(*(np.copy(each) for each in vars(later).values())), True)
    mmsi, time = (np.concatenate([getattr(r, name) for r in (rows, ahead)]) for name in ("mmsi", "time"))
    track, event, which, estimate = (
        np.concatenate([getattr(f, name) for f in (found, beyond)]) for name in ("track", "event", "which", "estimate")
    )
    whole, bounds = _by_track(mmsi, track)
    split = (np.diff(time[whole]) > LONGEST_GAP) | (event[whole][1:] == MOVED)
    pieces = np.union1d(bounds, np.flatnonzero(split) + 1)
    result = np.empty_like(estimate)
    result[whole] = smoothed(whole, pieces, which, time, filters, (found.kept, beyond.kept), estimate)
    return result[: len(rows.time)]


def _histories(
    rows: UnitRows,
    found: Found,
    order: NDArray[np.int64],
    bounds: NDArray[np.int64],
    estimate: Floats,
    tracks: NDArray[np.int64],
    state: BucketState,
) -> tuple[BucketState, np.ndarray, np.ndarray]:
    """(state with updated histories, events, trips)."""
    known = {tuple(each): i for i, each in enumerate(state.tracks.tolist())}
    places = np.array([known.get(tuple(each), -1) for each in tracks.tolist()], int)
    carry = np.zeros(len(places), HISTORY)
    carry[places >= 0] = state.carry[places[places >= 0]]
    record = (rows.time, estimate, found.status, found.event, rows.reported)
    room = _LEAST_EVENTS + len(order) // 8
    while True:
        events, trips = np.empty(room, EVENT), np.empty(room, TRIP)
        updated = carry.copy()
        e, t = history(bounds, order, record, updated, events, trips)
        if max(e, t) <= room:
            break
        room = max(e, t)
    kept = np.ones(len(state.tracks), bool)
    kept[places[places >= 0]] = False
    keys = np.concatenate([state.tracks[kept], tracks])
    place = np.lexsort((keys[:, 1], keys[:, 0]))
    carried = np.concatenate([state.carry[kept], updated])[place]
    whole = BucketState(state.mmsi, keys[place], carried, *state.arrays)
    return whole, events[:e], trips[:t]
