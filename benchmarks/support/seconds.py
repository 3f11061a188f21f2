"""The filter by steps of one second, which few long steps are compared with."""

import numpy as np

from steerway.core.compiled import kernel
from steerway.estimation.course.motion.layout import LONGEST_GAP, empty_bank
from steerway.estimation.course.output import OUTPUTS, status_of, write_output
from steerway.estimation.course.tracking import advance, recentre, settle, take_position


def by_seconds(fixes, parameters) -> tuple[np.ndarray, np.ndarray]:
    """(estimate, status) of every fix of many vessels."""
    bounds = np.r_[0, np.flatnonzero(np.diff(fixes.mmsi)) + 1, len(fixes)]
    estimate, status = np.empty((len(fixes), OUTPUTS)), np.empty(len(fixes), np.uint8)
    _run(bounds, fixes.time, fixes.latitude, fixes.longitude, parameters, empty_bank(parameters), estimate, status)
    return estimate, status


@kernel
def _run(bounds, time, latitude, longitude, parameters, bank, estimate, status):
    for i in range(len(bounds) - 1):
        bank[:] = 0.0
        for k in range(bounds[i], bounds[i + 1]):
            elapsed = time[k] - time[k - 1] if k > bounds[i] else 0.0
            steps = int(np.ceil(elapsed)) if elapsed <= LONGEST_GAP else 1
            for _ in range(steps):
                advance(bank, elapsed / steps, parameters, bank[:0])
            accepted, _, _ = take_position(bank, latitude[k], longitude[k], True, 1.0, parameters)
            settle(bank, parameters)
            recentre(bank)
            status[k] = status_of(bank, True, accepted)
            write_output(bank[0], True, estimate[k])
