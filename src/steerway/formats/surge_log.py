"""A table of speed and shaft speed, for identification, with the columns time_s, speed_mps and shaft_rps.

The shaft's column may be another one, of a command in any unit to which thrust is quadratic.
"""

from pathlib import Path

import numpy as np

from steerway.core.errors import InputError
from steerway.formats.plain_table import numbers, read_plain

COLUMNS = ("time_s", "speed_mps", "shaft_rps")


def read_surge_log(path: str | Path, shaft: str | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) time s, speed m/s, shaft rev/s (or the column named `shaft`, as it stands); what is not a number is NaN.

    Raises InputError for a file that is no table and for missing columns.
    """
    names = (*COLUMNS[:2], shaft or COLUMNS[2])
    frame = read_plain(path, ", ".join(names))
    missing = [name for name in names if name not in frame.columns]
    if missing:
        raise InputError(f"{path} has no column {missing[0]}, expected {', '.join(names)}")
    return tuple(numbers(frame, name) for name in names)
