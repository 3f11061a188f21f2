"""ULog of PX4 (.ulg): the fixes of each receiver, read by the optional package pyulog."""

import contextlib
import io
from collections import Counter
from typing import Any

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.errors import InputError
from steerway.core.extras import require
from steerway.core.records import Fixes
from steerway.core.slow_error import SLOW_STD
from steerway.formats.dilution import OF_FIX_TYPE
from steerway.formats.places import places
from steerway.formats.recording import Recording

_MAGIC = b"ULog\x01\x12\x35"
_TOPICS = ("sensor_gps", "vehicle_gps_position")
_LEAST_FIX = 2  # a fix in two dimensions


def recognises(head: bytes) -> bool:
    """Whether the first bytes are the magic number of ULog."""
    return head.startswith(_MAGIC)


def read(data: bytes) -> Recording:
    """The sources "sensor_gps 0", …, "vehicle_gps_position 0", … of a log.

    Raises InputError if pyulog is not installed or cannot read the file.
    """
    require("a ULog file", "logs")
    from pyulog import ULog

    try:
        with contextlib.redirect_stdout(io.StringIO()):
            log = ULog(io.BytesIO(data), list(_TOPICS))
    except Exception as error:  # pyulog checks little: damage raises errors of many types
        raise InputError(f"the ULog file is damaged ({' '.join(str(error).split()) or type(error).__name__})") from None
    skipped = Counter[str]()
    topics = {f"{topic.name} {topic.multi_id}": topic.data for topic in log.data_list}
    counts = {name: len(columns["timestamp"]) for name, columns in topics.items()}
    return Recording.of("ULog", [_fixes(name, each, skipped) for name, each in topics.items()], counts, skipped)


def _fixes(name: str, columns: dict[str, Any], skipped: Counter[str]) -> Fixes:
    def column(*names: str) -> Floats:
        found = next((columns[each] for each in names if each in columns), None)
        return np.full(len(columns["timestamp"]), np.nan) if found is None else np.asarray(found, float)

    factor = 1.0 if "latitude_deg" in columns else 1e-7
    place = places(factor * column("latitude_deg", "lat"), factor * column("longitude_deg", "lon"))
    kind, radius = column("fix_type"), column("eph")
    of_kind = [SLOW_STD[OF_FIX_TYPE[int(each)]] if each in OF_FIX_TYPE else np.nan for each in kind]
    std = np.where(radius > 0.0, radius / np.sqrt(2.0), of_kind)
    time, cog = 1e-6 * column("time_utc_usec"), column("cog_rad")
    sog = column("vel_m_s")
    fixes = Fixes(time, *place, position_std=std, sog=sog, cog=cog, source=name)
    for reason, good in (("no fix", ~(kind < _LEAST_FIX) & fixes.has_position), ("no time in UTC", time > 0.0)):
        if lost := int((~good).sum()):
            skipped[reason] += lost
    return fixes.rows(~(kind < _LEAST_FIX) & fixes.has_position & (time > 0.0)).in_order()
