"""A table of speed and shaft speed, for identification: CSV with the columns time_s, speed_mps and shaft_rps.

The shaft's column may be another one, of a command in any unit to which thrust is quadratic.
"""

from pathlib import Path

import numpy as np

from steerway.core.errors import InputError

COLUMNS = ("time_s", "speed_mps", "shaft_rps")


def read_surge_log(path: str | Path, shaft: str | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) time s, speed m/s, shaft rev/s (or the column named `shaft`, as it stands); what is not a number is NaN.

    Raises InputError for a file that cannot be read as CSV and for missing columns.
    """
    import polars as pl

    try:
        table = pl.read_csv(Path(path).read_bytes(), infer_schema=False)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}), expected a CSV table") from None
    except pl.exceptions.PolarsError:
        expected = ", ".join((*COLUMNS[:2], shaft or COLUMNS[2]))
        raise InputError(f"{path} is no table, expected CSV with columns {expected}") from None
    names = (*COLUMNS[:2], shaft or COLUMNS[2])
    missing = [name for name in names if name not in table.columns]
    if missing:
        raise InputError(f"{path} has no column {missing[0]}, expected {', '.join(names)}")
    numbers = (table[name].str.strip_chars().cast(pl.Float64, strict=False) for name in names)
    return tuple(column.fill_null(np.nan).to_numpy() for column in numbers)
