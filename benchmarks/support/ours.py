"""This project's filter as a contender."""

import numpy as np

from benchmarks.support.record import PROFILE, STEP, Record
from steerway import FiveStateFilter
from steerway.estimation.course.motion.layout import empty_bank
from steerway.estimation.course.replay import TrackOutput, run_track
from steerway.estimation.vessel.aids import NO_AIDS

MODEL = PROFILE.parameters()
_NO_SCALES = np.empty(0)


def whole_record(record: Record, model=MODEL) -> tuple[np.ndarray, np.ndarray]:
    """What the filter says after every row (n, 9) in the record's own plane, and the NIS of its fixes (n,)."""
    found, bounds = TrackOutput(len(record)), np.array([0, len(record)])
    rows = record.time, record.north, record.east, _NO_SCALES, NO_AIDS, False
    run_track(bounds, rows, model, empty_bank(model), found.arrays())
    return found.estimate, found.nis


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
