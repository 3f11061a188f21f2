"""A table of speed and shaft speed, for identification: CSV with the columns time_s, speed_mps and shaft_rps."""

from pathlib import Path

import numpy as np

from steerway.core.errors import InputError

COLUMNS = ("time_s", "speed_mps", "shaft_rps")


def read_surge_log(path: str | Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) time s, speed m/s, shaft rev/s; what is not a number is NaN.

    Raises InputError for a file that cannot be read as CSV and for missing columns.
    """
    import polars as pl

    try:
        table = pl.read_csv(path, infer_schema=False)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise InputError(f"{path} cannot be read as CSV: {str(error).splitlines()[0]}") from error
    missing = [name for name in COLUMNS if name not in table.columns]
    if missing:
        raise InputError(f"{path} has no column {missing[0]}, expected {', '.join(COLUMNS)}")
    numbers = (table[name].str.strip_chars().cast(pl.Float64, strict=False) for name in COLUMNS)
    return tuple(column.fill_null(np.nan).to_numpy() for column in numbers)
