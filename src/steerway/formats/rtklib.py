"""RTKLIB solutions (.pos): a line per fix, with its accuracy. Fields: manual of RTKLIB 2.4.2, appendix B.1."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.core.records import Fixes
from steerway.core.timestamps import unix_times
from steerway.formats.gps_time import utc_of_gps, utc_of_week
from steerway.formats.places import places
from steerway.formats.recording import Recording, placed

_HEAD = re.compile(rb"^%\s+(GPST|UTC|JST)[\s,;]+(latitude\S*.*)$", re.M)
_JST = 9.0 * 3600.0
QUALITIES = {1: "fixed", 2: "float", 3: "SBAS", 4: "DGPS", 5: "single", 6: "PPP"}


def recognises(head: bytes) -> bool:
    """Whether the first bytes contain the header of a solution in latitude and longitude."""
    return _HEAD.search(head) is not None


def read(data: bytes) -> Recording:
    """The source "RTKLIB", with SOG and COG if the solution has velocities. Raises InputError for other columns."""
    head = _HEAD.search(data)
    if head is None:
        raise InputError("the file has no header of a solution, expected one with latitude and longitude")
    system, titles = head[1].decode(), head[2].decode("ascii", "replace")
    names = [re.sub(r"\(.*?\)", "", each) for each in re.split(r"[\s,;]+", titles)]
    names = [each for each in names if each]
    in_minutes = b"d'" in head[2]
    skipped, rows, clocks = Counter[str](), [], []
    for line in data[head.end() :].splitlines():
        if not line.strip() or line.startswith(b"%"):
            continue
        cells = re.split(r"[\s,;]+", line.decode("ascii", "replace").strip())
        values = _numbers(cells[2:])
        if in_minutes and values is not None and len(values) >= 6:
            values = [_of_minutes(values[:3]), _of_minutes(values[3:6]), *values[6:]]
        if values is None or len(values) < min(len(names), 4):
            skipped["line not understood"] += 1
            continue
        clocks.append(cells[:2])
        rows.append((values + [np.nan] * len(names))[: len(names)])
    columns = dict(zip(names, np.array(rows).T.reshape(len(names), -1), strict=True))
    if not {"latitude", "longitude"} <= columns.keys():
        raise InputError(f"the solution has the columns {', '.join(names)}, expected latitude and longitude")
    time = _times(clocks, system)
    latitude, longitude = places(columns["latitude"], columns["longitude"])
    reported = {}
    if {"sdn", "sde"} <= columns.keys():
        reported["position_std"] = np.sqrt(0.5 * (columns["sdn"] ** 2 + columns["sde"] ** 2))
    if {"vn", "ve"} <= columns.keys():
        reported["sog"] = np.hypot(columns["vn"], columns["ve"])
        reported["cog"] = np.arctan2(columns["ve"], columns["vn"])
    fixes = Fixes(time, latitude, longitude, **reported, source="RTKLIB")
    fixes = placed(fixes, skipped)
    quality = columns.get("Q", np.zeros(0))
    counts = Counter({f"{words} solution": int((quality == kind).sum()) for kind, words in QUALITIES.items()})
    notes = [] if system == "UTC" else [f"times in {system} have been converted to UTC"]
    return Recording.of("RTKLIB", (fixes,), +counts, skipped, notes)


def _numbers(cells: Iterable[str]) -> list[float] | None:
    try:
        return [float(each) for each in cells if each]
    except ValueError:
        return None


def _of_minutes(parts: Sequence[float]) -> float:
    """Degrees from (degrees, minutes, seconds); the sign of the degrees applies to all."""
    degrees, minutes, seconds = parts
    return math.copysign(abs(degrees) + minutes / 60.0 + seconds / 3600.0, degrees)


def _times(clocks: Sequence[Sequence[str]], system: str) -> Floats:
    """Unix s (n,) of pairs (date, time of day) or (GPS week, seconds of the week)."""
    if not clocks:
        return np.zeros(0)
    if "/" not in clocks[0][0] and "-" not in clocks[0][0]:
        weeks = np.array([_numbers(each) or [np.nan, np.nan] for each in clocks])
        return utc_of_week(*weeks.T)
    time = unix_times([" ".join(each) for each in clocks])
    return utc_of_gps(time) if system == "GPST" else time - (_JST if system == "JST" else 0.0)
