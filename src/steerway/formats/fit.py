"""FIT files of sports watches and bicycle computers: record messages, read by the optional package fitdecode.

CSV files that the FIT SDK's FitCSVTool makes from FIT are read too: a line per message, or a column per field.
"""

import csv
import io
from collections import Counter
from typing import Any

import numpy as np

from steerway.core.errors import InputError
from steerway.core.extras import require
from steerway.core.records import Fixes
from steerway.formats.columns import SEMICIRCLE
from steerway.formats.places import number, places
from steerway.formats.recording import Recording, placed

_TABLES = b"Type,Local Number,Message", b"record.timestamp[s]"
EPOCH = 631065600.0  # Unix s of 1989-12-31, the origin of FIT times
_FIELDS = ("position_lat", "position_long", "enhanced_speed", "speed", "gps_accuracy")


def recognises(head: bytes) -> bool:
    """Whether the first bytes are the header of a FIT file or of a FitCSVTool table."""
    return (head[8:12] == b".FIT" and head[0] in (12, 14)) or _is_table(head)


def _is_table(head: bytes) -> bool:
    return head.startswith(_TABLES)


def read(data: bytes) -> Recording:
    """The source "FIT". Raises InputError if fitdecode is not installed or cannot read the file."""
    counts, skipped = Counter[str](), Counter[str]()
    rows = _tabled(data, counts) if _is_table(data) else _decoded(data, counts, skipped)
    table = np.array(rows, float).reshape(-1, 1 + len(_FIELDS)).T
    time, latitude, longitude, enhanced, plain, radius = table
    degrees = np.degrees(SEMICIRCLE)
    place = places(degrees * latitude, degrees * longitude)
    sog = np.where(np.isfinite(enhanced), enhanced, plain)
    fixes = Fixes(time, *place, position_std=radius / np.sqrt(2.0), sog=sog, source="FIT")
    return Recording.of("FIT", (placed(fixes, skipped),), counts, skipped)


def _decoded(data: bytes, counts: Counter[str], skipped: Counter[str]) -> list[tuple[float, ...]]:
    require("a FIT file", "logs")
    import fitdecode

    rows = []
    try:
        reader = fitdecode.FitReader(data, check_crc=fitdecode.CrcCheck.DISABLED)
        for frame in reader:
            if isinstance(frame, fitdecode.FitDataMessage):
                counts[frame.name] += 1
                if frame.name == "record" and frame.has_field("timestamp"):
                    rows.append(_row(frame))
    except fitdecode.FitError as error:
        if not rows:
            raise InputError(f"the FIT file is damaged ({' '.join(str(error).split())})") from None
        skipped["rest of the file damaged"] += 1
    return rows


def _tabled(data: bytes, counts: Counter[str]) -> list[tuple[float, ...]]:
    """Rows of the record messages in a FitCSVTool table."""
    lines = csv.reader(io.StringIO(data.decode("utf-8", "replace")))
    head, rows = next(lines), []
    for line in lines:
        if head[0] == "Type":
            values = (
                dict(zip(line[3::3], line[4::3], strict=False)) if line[:1] + line[2:3] == ["Data", "record"] else {}
            )
        else:
            values = {
                name.removeprefix("record.").split("[")[0]: value for name, value in zip(head, line, strict=False)
            }
        numbers = [number(values.get(name)) for name in ("timestamp", *_FIELDS)]
        if np.isfinite(numbers[0]):
            counts["record"] += 1
            rows.append((numbers[0] + EPOCH, *numbers[1:]))
    return rows


def _row(frame: Any) -> tuple[float, ...]:
    """Unix time and `_FIELDS` of a record message, NaN for missing fields."""
    values = (frame.get_value(name, fallback=None) for name in _FIELDS)
    return frame.get_value("timestamp").timestamp(), *(np.nan if each is None else each for each in values)
