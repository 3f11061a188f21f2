"""ArduPilot's data flash log as text, as Mission Planner and mavlogdump write it: the fixes of each receiver.

Fields: the FMT lines of the log itself; their meaning: ArduPilot, "Onboard message log messages".
"""

import re
from collections import Counter, defaultdict

import numpy as np

from steerway.core.errors import InputError
from steerway.core.records import Fixes
from steerway.formats import dilution
from steerway.formats.gps_time import utc_of_week
from steerway.formats.places import places
from steerway.formats.recording import Recording

_FORMAT = re.compile(rb"^FMT,\s*\d+,\s*\d+,\s*(GPS\d?),\s*\w+,\s*([\w,]+)", re.M)
_LINE = re.compile(rb"^(GPS\d?),([^\r\n]*)", re.M)
_NEEDED = ("Status", "GMS", "GWk", "Lat", "Lng", "Spd", "GCrs")
_LEAST_STATUS = 2  # a fix in two dimensions


def recognises(head: bytes) -> bool:
    """Whether the first bytes declare the messages of a receiver."""
    return _FORMAT.search(head) is not None


def read(data: bytes) -> Recording:
    """The sources "GPS", "GPS2", … or "GPS 0", "GPS 1", … of a log. Raises InputError for one without the columns."""
    columns = {kind: names.decode().strip().split(",") for kind, names in _FORMAT.findall(data)}
    for names in columns.values():
        if missing := [each for each in _NEEDED if each not in names]:
            raise InputError(f"GPS messages have no {missing[0]}, found {', '.join(names)}")
    skipped, rows = Counter(), defaultdict(list)
    for kind, text in _LINE.findall(data):
        values = text.decode("ascii", "replace").split(",")
        names = columns.get(kind, [])
        try:
            row = {name: float(value) for name, value in zip(names, values, strict=True)}
        except ValueError:
            skipped["line not understood"] += 1
            continue
        if row["Status"] < _LEAST_STATUS:
            skipped["no fix"] += 1
            continue
        instance = f" {row['I']:.0f}" if "I" in row else ""
        rows[kind.decode() + instance].append([row[name] for name in _NEEDED] + [row.get("HDop", np.nan)])
    counts = {name: len(each) for name, each in sorted(rows.items())}
    sources = {name: _fixes(name, np.array(each), skipped) for name, each in sorted(rows.items())}
    return Recording("ArduPilot log", {n: f for n, f in sources.items() if len(f)}, counts, dict(skipped))


def _fixes(name, table, skipped) -> Fixes:
    _, milliseconds, week, latitude, longitude, sog, course, hdop = table.T
    std = np.array([dilution.deviation(each) for each in hdop])
    time = utc_of_week(week, 1e-3 * milliseconds)
    place = places(latitude, longitude)
    fixes = Fixes(time, *place, position_std=std, sog=sog, cog=np.radians(course), source=name)
    if not fixes.has_position.all():
        skipped["no position"] += int((~fixes.has_position).sum())
    return fixes.rows(fixes.has_position).in_order()
