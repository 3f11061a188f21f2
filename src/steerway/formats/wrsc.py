"""Tracks of the World Robotic Sailing Championship: lines of hhmmssdd, latitude and longitude in 1e-7 degrees.

dd is the day of the month; the files contain neither month nor year.
"""

import re
from collections import Counter

import numpy as np

from steerway.core.records import Fixes
from steerway.formats.places import places
from steerway.formats.recording import Recording, placed

_LINE = re.compile(rb"^([0-2]\d[0-5]\d[0-5]\d[0-3]\d),(-?\d{7,9}),(-?\d{7,10})\s*$", re.M)
_DAY = 86400.0


def recognises(head: bytes) -> bool:
    """Whether the first line has this form."""
    return _LINE.match(head) is not None


def read(data: bytes) -> Recording:
    """The source "WRSC"; its days are counted as days of January 1970."""
    rows = [(*divmod(int(stamp), 100), int(lat), int(lon)) for stamp, lat, lon in _LINE.findall(data)]
    clock, day, latitude, longitude = np.array(rows).T
    steps = np.diff(day, prepend=day[:1])
    days = day[0] - 1 + np.cumsum(np.where(steps < 0, 1, steps))  # a smaller day begins the next month
    time = _DAY * days + 3600.0 * (clock // 10000) + 60.0 * (clock // 100 % 100) + clock % 100
    fixes = Fixes(time, *places(1e-7 * latitude, 1e-7 * longitude), source="WRSC")
    skipped = Counter({"line not understood": len(data.split()) - len(rows)})
    fixes = placed(fixes, skipped)
    notes = ("the log has no month and year: days are counted as days of January 1970",)
    return Recording.of("WRSC", (fixes,), {"lines": len(rows)}, +skipped, notes)
