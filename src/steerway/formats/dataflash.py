"""ArduPilot's data flash log, binary or as text (Mission Planner, mavlogdump): the fixes of each receiver.

The FMT messages of a log declare its fields. Source of their meaning: ArduPilot, "Onboard message log messages" and
LogStructure.h.
"""

import re
import struct
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.core.records import Fixes
from steerway.formats import dilution
from steerway.formats.gps_time import utc_of_week
from steerway.formats.places import number, places
from steerway.formats.recording import Recording, placed

_FORMAT = re.compile(rb"^FMT,\s*\d+,\s*\d+,\s*(GPS\d?),\s*\w+,\s*([\w,]+)", re.M)
_LINE = re.compile(rb"^(GPS\d?),([^\r\n]*)", re.M)
_NEEDED = ("Status", "GMS", "GWk", "Lat", "Lng", "Spd", "GCrs")
_OLDER = {"TimeMS": "GMS", "Week": "GWk"}
"""Names of columns before 2014, and their present names."""
_DUMPED = re.compile(rb"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d+: (GPS\d?) \{([^}]*)\}", re.M)
"""A message as mavlogdump prints it."""
_LEAST_STATUS = 2  # a fix in two dimensions
_HEAD, _FMT = b"\xa3\x95", 128
_FMT_LAYOUT = struct.Struct("<BB4s16s64s")
_CODES = dict(b="b", B="B", h="h", H="H", i="i", I="I", f="f", n="4s", N="16s", Z="64s", c="h", C="H", e="i", E="I")
_CODES |= dict(L="i", M="B", q="q", Q="Q", d="d", a="64s", g="e")
_FACTORS = dict(c=1e-2, C=1e-2, e=1e-2, E=1e-2, L=1e-7)
_DECLARED = _HEAD + bytes([_FMT, _FMT, _FMT_LAYOUT.size + 3]) + b"FMT\0"
"""The first message of a binary log: FMT declares itself."""


def recognises(head: bytes) -> bool:
    """Whether the first bytes declare messages of a GNSS receiver, or begin a binary log."""
    return any(each.search(head) for each in (_FORMAT, _DUMPED)) or _DECLARED in head[:4096]


def read(data: bytes) -> Recording:
    """The sources "GPS", "GPS2", … or "GPS 0", "GPS 1", … of a log. Raises InputError if a needed column is missing."""
    skipped, rows = Counter[str](), defaultdict(list)
    for kind, row in _binary(data, skipped) if _DECLARED in data[:4096] else _text(data, skipped):
        if not row["Status"] >= _LEAST_STATUS:  # NaN if damaged
            skipped["no fix"] += 1
            continue
        instance = f" {row['I']:.0f}" if "I" in row else ""
        rows[kind + instance].append([row[name] for name in _NEEDED] + [row.get("HDop", np.nan)])
    counts = {name: len(each) for name, each in sorted(rows.items())}
    sources = [_fixes(name, np.array(each, float), skipped) for name, each in sorted(rows.items())]
    return Recording.of("ArduPilot log", sources, counts, skipped)


def _names(text: str) -> list[str]:
    """The columns that a message declares, with old names updated. Raises InputError if a needed one is missing."""
    names = [_OLDER.get(each, each) for each in text.strip().split(",")]
    _expect_columns(names)
    return names


def _expect_columns(names: Collection[str]) -> None:
    if missing := [each for each in _NEEDED if each not in names]:
        raise InputError(f"GPS messages have no {missing[0]}, found {', '.join(names)}")


def _text(data: bytes, skipped: Counter[str]) -> Iterator[tuple[str, dict[str, float]]]:
    """(kind, fields) of the receivers' messages in a text log."""
    columns = {kind: _names(names.decode()) for kind, names in _FORMAT.findall(data)}
    dumped = [(kind.decode(), _pairs(text.decode("ascii", "replace"))) for kind, text in _DUMPED.findall(data)]
    if dumped:
        _expect_columns({name for _, row in dumped for name in row})
    for name, row in dumped:
        if row.keys() >= set(_NEEDED):
            yield name, row
        else:
            skipped["line not understood"] += 1
    for kind, text in _LINE.findall(data):
        values = text.decode("ascii", "replace").split(",")
        try:
            yield kind.decode(), {n: float(v) for n, v in zip(columns.get(kind, []), values, strict=True)}
        except ValueError:
            skipped["line not understood"] += 1


def _pairs(text: str) -> dict[str, float]:
    pairs = (each.partition(":") for each in text.split(","))
    return {name.strip(): number(value) for name, _, value in pairs}


def _binary(data: bytes, skipped: Counter[str]) -> Iterator[tuple[str, dict[str, float]]]:
    """(kind, fields) of the receivers' messages in a binary log; damaged messages are skipped and counted."""
    sizes, layouts = {_FMT: _FMT_LAYOUT.size + 3}, {}
    at = data.find(_DECLARED)
    while 0 <= at < len(data) - 3:
        kind = data[at + 2]
        size = sizes.get(kind)
        if data[at : at + 2] != _HEAD or size is None or at + size > len(data):
            skipped["message damaged"] += 1
            at = data.find(_HEAD, at + 1)
            continue
        if kind == _FMT:
            message, length, *texts = _FMT_LAYOUT.unpack_from(data, at + 3)
            name, codes, names = (each.rstrip(b"\0").decode("ascii", "replace") for each in texts)
            sizes[message] = max(length, 3)
            if re.fullmatch(r"GPS\d?", name) and set(codes) <= _CODES.keys():
                layouts[message] = (
                    name,
                    codes,
                    _names(names),
                    struct.Struct("<" + "".join(_CODES[each] for each in codes)),
                )
        elif kind in layouts and layouts[kind][3].size + 3 <= size:
            name, codes, names, layout = layouts[kind]
            values = zip(names, codes, layout.unpack_from(data, at + 3), strict=False)
            yield (
                name,
                {n: value * _FACTORS.get(code, 1.0) for n, code, value in values if not isinstance(value, bytes)},
            )
        at += size


def _fixes(name: str, table: Floats, skipped: Counter[str]) -> Fixes:
    status, milliseconds, week, latitude, longitude, sog, course, hdop = table.T
    quality = [dilution.OF_FIX_TYPE.get(int(each), dilution.ALONE) for each in np.nan_to_num(status)]
    std = np.array([dilution.deviation(*each) for each in zip(hdop, quality, strict=True)])
    time = utc_of_week(week, 1e-3 * milliseconds)
    place = places(latitude, longitude)
    fixes = Fixes(time, *place, position_std=std, sog=sog, cog=np.radians(course), source=name)
    return placed(fixes, skipped)
