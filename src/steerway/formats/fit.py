"""FIT of sports watches and bicycle computers: the record messages, read by fitdecode, an optional package."""

from collections import Counter
from typing import Any

import numpy as np

from steerway.core.errors import InputError
from steerway.core.extras import require
from steerway.core.records import Fixes
from steerway.formats.columns import SEMICIRCLE
from steerway.formats.places import places
from steerway.formats.recording import Recording

_FIELDS = ("position_lat", "position_long", "enhanced_speed", "speed", "gps_accuracy")


def recognises(head: bytes) -> bool:
    """Whether the first bytes are the header of a FIT file."""
    return head[8:12] == b".FIT" and head[0] in (12, 14)


def read(data: bytes) -> Recording:
    """The source "FIT". Raises InputError where fitdecode is not installed, and for a file that it cannot read."""
    require("a FIT file", "logs")
    import fitdecode

    rows, counts, skipped = [], Counter[str](), Counter[str]()
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
        skipped["damaged from here on"] += 1
    table = np.array(rows, float).reshape(-1, 1 + len(_FIELDS)).T
    time, latitude, longitude, enhanced, plain, radius = table
    degrees = np.degrees(SEMICIRCLE)
    place = places(degrees * latitude, degrees * longitude)
    sog = np.where(np.isfinite(enhanced), enhanced, plain)
    fixes = Fixes(time, *place, position_std=radius / np.sqrt(2.0), sog=sog, source="FIT")
    if lost := int((~fixes.has_position).sum()):
        skipped["no position"] += lost
    fixes = fixes.rows(fixes.has_position).in_order()
    return Recording("FIT", {"FIT": fixes} if len(fixes) else {}, dict(counts), dict(skipped))


def _row(frame: Any) -> tuple[float, ...]:
    """Unix time and the fields, NaN for what it does not have."""
    values = (frame.get_value(name, fallback=None) for name in _FIELDS)
    return frame.get_value("timestamp").timestamp(), *(np.nan if each is None else each for each in values)
