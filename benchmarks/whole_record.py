"""A record at once: the compiled pass over 50 Hz rows with 5 Hz fixes, against C, and what a user's call adds."""

import numpy as np

from benchmarks.support import by_hand, ours
from benchmarks.support.harness import Result, interleaved
from benchmarks.support.record import PROFILE, STEPS_A_FIX, winding
from steerway import FiveStateFilter, Fixes
from steerway.core.earth import radii

_ROWS, _ROUNDS = 100_000, 15


def run():
    record = winding(_ROWS)
    fixes = _fixes(record)
    estimator = FiveStateFilter(PROFILE)
    contenders = {
        "ours": lambda: ours.whole_record(record),
        "filter(fixes, rate=50)": lambda: estimator.filter(fixes, rate=50.0),
        "smooth(fixes, rate=50)": lambda: estimator.smooth(fixes, rate=50.0),
    }
    if by_hand.Library.available():
        library = by_hand.Library()
        output, theirs = np.column_stack(ours.whole_record(record)), library.whole_record(record)
        assert np.array_equal(np.isnan(output), np.isnan(theirs))
        yield Result("largest difference to C", float(np.nanmax(np.abs(output - theirs))), "", at_most=1e-9)
        contenders["C"] = lambda: library.whole_record(record)
    taken = interleaved(contenders, _ROUNDS)
    for name, seconds in taken.items():
        yield Result(name, 1e9 * seconds / _ROWS, "ns a row")
    if "C" in taken:
        yield Result("ours / C", taken["ours"] / taken["C"], "times", at_most=1.5, note=" ".join(by_hand.FLAGS))
        yield Result("filter(fixes, rate=50) / C", taken["filter(fixes, rate=50)"] / taken["C"], "times")
    else:
        yield Result("ours / C", None, note="no gcc on this machine")


def _fixes(record) -> Fixes:
    """The record's fixes around a place at 59° N."""
    latitude, longitude = np.radians(59.0), np.radians(10.5)
    meridian, prime_vertical = radii(latitude)
    chosen = slice(0, None, STEPS_A_FIX)
    return Fixes(
        time=1.7e9 + record.time[chosen],
        latitude=latitude + record.north[chosen] / meridian,
        longitude=longitude + record.east[chosen] / (prime_vertical * np.cos(latitude)),
    )
