"""This project's filter as a contender."""

import numpy as np

from benchmarks.support.record import PROFILE, STEP, Record
from steerway import FiveStateFilter
from steerway.estimation.course.model import empty_memory
from steerway.estimation.course.replay import Run, outputs, room_to_keep
from steerway.estimation.course.tracking import track

MODEL = PROFILE.model()
_NO_DOUBTS, _NO_AIDS = np.empty(0), np.empty((0, 5))


def whole_record(record: Record, model=MODEL) -> tuple[np.ndarray, np.ndarray]:
    """What the filter says after every row (n, 9) in the record's own plane, and the NIS of its fixes (n,)."""
    run = Run(len(record))
    memory = empty_memory(model)
    rows = record.time, record.north, record.east, _NO_DOUBTS, _NO_AIDS
    track(*rows, False, model, memory, *outputs(run), room_to_keep(memory, 0))
    return run.spoken, run.nis


def started(record: Record, rows: int) -> FiveStateFilter:
    """A filter that has seen the first rows of a record and is under way."""
    estimator = FiveStateFilter(PROFILE)
    stream(estimator, record.positions(0, rows))
    assert estimator.underway
    return estimator


def stream(estimator: FiveStateFilter, positions) -> None:
    """Rows one by one."""
    for north, east in positions:
        estimator.predict(STEP)
        if north == north:
            estimator.update_north_east(north, east)


def stream_and_read(estimator: FiveStateFilter, positions):
    """The same, with SOG, COG and course rate read after each row. Returns the last."""
    said = None
    for north, east in positions:
        estimator.predict(STEP)
        if north == north:
            estimator.update_north_east(north, east)
        said = estimator.sog, estimator.cog, estimator.course_rate
    return said
