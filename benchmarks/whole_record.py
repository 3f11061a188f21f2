"""A whole record in one call, 50 Hz rows with 5 Hz fixes: the kernel against C, and the public functions."""

import numpy as np

from benchmarks.support import by_hand, ours
from benchmarks.support.harness import Result, interleaved
from benchmarks.support.record import PROFILE, fixes_of, winding
from steerway import FiveStateFilter

_ROWS, _ROUNDS = 100_000, 15


def run():
    record = winding(_ROWS)
    fixes = fixes_of(record)
    estimator = FiveStateFilter(PROFILE)
    contenders = {
        "ours": lambda: ours.whole_record(record),
        "filter(fixes, rate=50)": lambda: estimator.filter(fixes, rate=50.0),
        "smooth(fixes, rate=50)": lambda: estimator.smooth(fixes, rate=50.0),
    }
    if by_hand.Library.available():
        library = by_hand.Library()
        output, theirs = ours.whole_record(record), library.whole_record(record)
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
