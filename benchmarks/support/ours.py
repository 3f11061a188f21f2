"""Steerway's filter, as a contender."""

import numpy as np

from benchmarks.support.record import PROFILE, STEP, Record
from steerway import FiveStateFilter, Profile
from steerway.estimation.filter.model import FUSED, Model, empty_bank, room_to_keep
from steerway.estimation.filter.row import Asked, Rows
from steerway.estimation.log.course import run_model
from steerway.estimation.vessel.aids import NO_AIDS
from steerway.estimation.vessel.flat import model_of_profile

MODEL = model_of_profile(PROFILE)
_NONE = np.empty(0)


def tracks(bounds, time, north, east, output, model: Model = MODEL) -> None:
    """Fill `output` (n, FUSED + 2) for tracks one after another, track i in rows bounds[i] to bounds[i + 1]."""
    rows = Rows(time, north, east, _NONE, NO_AIDS, np.asarray(bounds[1:-1], np.int64))
    run_model(rows, model, empty_bank(model), Asked(output, _NONE, room_to_keep(0, model), 0))


def whole_record(record: Record, model: Model = MODEL) -> np.ndarray:
    """(n, 10) estimates after every row, in the record's plane, and the NIS of fixes."""
    output = np.empty((len(record), FUSED + 2))
    tracks([0, len(record)], record.time, record.north, record.east, output, model)
    return compared(output)


def compared(output) -> np.ndarray:
    """The columns that the C code also fills."""
    return output[:, [*range(FUSED - 1), -2]]


def model_with(**update) -> Model:
    """The model of the benchmarks' profile with changed parameters."""
    return model_of_profile(Profile(**(PROFILE.model_dump() | update)))


def started(record: Record, rows: int) -> FiveStateFilter:
    """A filter under way, after the first rows of a record."""
    estimator = FiveStateFilter(PROFILE)
    stream(estimator, record.positions(0, rows))
    assert estimator.underway
    return estimator


def stream(estimator: FiveStateFilter, positions) -> None:
    """Filter rows one by one; NaN is a row without a fix."""
    for north, east in positions:
        estimator.predict(STEP)
        if north == north:
            estimator.update_north_east(north, east)
