"""IGC text files of flight recorders. Fields: FAI technical specification for GNSS flight recorders, appendix A."""

import re
from collections import Counter

import numpy as np

from steerway.core.errors import InputError
from steerway.core.records import Fixes
from steerway.core.timestamps import unix_times
from steerway.formats.places import places
from steerway.formats.recording import Recording, placed

_DATE = re.compile(rb"^HFDTE(?:DATE:)?\s*(\d\d)(\d\d)(\d\d)", re.M)
_FIX = re.compile(
    rb"^B(?P<hour>\d\d)(?P<minute>\d\d)(?P<second>\d\d)(?P<lat>\d{7})(?P<ns>[NS])(?P<lon>\d{8})(?P<ew>[EW])(?P<valid>[AV])"
    rb"[^\r\n]*",
    re.M,
)
_EXTENSIONS = re.compile(rb"^I\d\d((?:\d{4}[A-Z]{3})+)", re.M)
_EXTENSION = re.compile(rb"(\d\d)(\d\d)(TDS|LAD|LOD)")
_DAY = 86400.0


def recognises(head: bytes) -> bool:
    """Whether the first bytes contain the date and a fix of an IGC file."""
    return head[:1] == b"A" and _DATE.search(head) is not None and _FIX.search(head) is not None


def read(data: bytes) -> Recording:
    """The source "IGC": fixes to 0.001′, or finer if the file declares more digits. InputError if it has no date."""
    skipped = Counter[str]()
    date = _DATE.search(data)
    if date is None:
        raise InputError("the file has no date, expected a line that begins with HFDTE")
    day, month, year = map(int, date.groups())
    century = 1900 if year >= 80 else 2000
    midnight = unix_times([f"{century + year:04d}-{month:02d}-{day:02d}T00:00:00Z"])[0]
    further = _places_of_extensions(data)
    rows, last = [], 0.0
    for fix in _FIX.finditer(data):
        if fix["valid"] != b"A":
            skipped["no fix"] += 1
            continue
        line, digits = fix.group(), {}
        for code, (first, end) in further.items():
            text = line[first:end]
            digits[code] = int(text) / 10.0 ** len(text) if text.isdigit() else 0.0
        clock = 3600.0 * int(fix["hour"]) + 60.0 * int(fix["minute"]) + int(fix["second"]) + digits.get("TDS", 0.0)
        if clock < last - 0.5 * _DAY:
            midnight += _DAY
        last = clock
        latitude = _degrees(fix["lat"], digits.get("LAD", 0.0), fix["ns"] == b"S")
        longitude = _degrees(fix["lon"], digits.get("LOD", 0.0), fix["ew"] == b"W")
        rows.append((midnight + clock, latitude, longitude))
    time, *degrees = np.array(rows).reshape(-1, 3).T
    fixes = Fixes(time, *places(*degrees), source="IGC")
    return Recording.of("IGC", (placed(fixes, skipped),), {"B fix": len(rows)}, skipped)


def _places_of_extensions(data: bytes) -> dict[str, tuple[int, int]]:
    """Columns (first, end) of the extra digits of time and position in a fix's line, by code of the extension."""
    found = _EXTENSIONS.search(data)
    declared = _EXTENSION.findall(found[1]) if found else []
    return {code.decode(): (int(first) - 1, int(end)) for first, end, code in declared}


def _degrees(text: bytes, further: float, negative: bool) -> float:
    """Degrees from DDMMmmm or DDDMMmmm; `further` is a fraction (0 to 1) of the last digit."""
    thousandths = int(text[-5:]) + further
    return (-1.0 if negative else 1.0) * (int(text[:-5]) + thousandths / 60000.0)
