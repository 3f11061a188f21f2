"""What the last states of an archive hold: the trips that every vessel is at."""

import numpy as np
import polars as pl

from steerway.archive.histories import TRIP_COLUMNS, unfinished
from steerway.archive.store import Store
from steerway.archive.tables import trip_table
from steerway.core.files import complete_or_absent

UNFINISHED = "unfinished.parquet"


def last_units(store: Store) -> list[tuple[int, int]]:
    """(day, bucket) of the last day of every bucket."""
    last: dict[int, int] = {}
    for day, bucket in store.done():
        last[bucket] = max(day, last.get(bucket, day))
    return sorted((day, bucket) for bucket, day in last.items())


def write_unfinished_trips(store: Store) -> None:
    """trips/unfinished.parquet: the trip or stop of every track that goes on at the end of the archive."""
    tables = []
    for day, bucket in last_units(store):
        state = store.state(day, bucket)
        trips = np.zeros((len(state.tracks), TRIP_COLUMNS))
        count = unfinished(state.carry, trips)
        tables.append(trip_table(state.tracks, trips[:count]))
    if not tables:
        return
    (store.root / "trips").mkdir(exist_ok=True)
    with complete_or_absent(store.root / "trips" / UNFINISHED) as file:
        pl.concat(tables).sort("mmsi", "track", "start_s").write_parquet(file)
