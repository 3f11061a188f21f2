"""Any table with a header as a frame: Parquet, or text with commas, semicolons, tabs or bars between its cells."""

import re
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from steerway.core.errors import InputError
from steerway.formats.cells import DELIMITERS, parquet

_MISSING = ["", "nan", "NaN", "null", "NA", "-"]


def read_plain(path: str | PathLike[str], columns: str = "") -> pl.DataFrame:
    """The table in a file, (rows, columns) under the names of its header; lines that begin with # are comments.

    Decimal commas are read where the cells are not separated by commas. `columns` says in errors what is expected.
    Raises InputError for a file that cannot be read and for one that holds no table.
    """
    expected = f"expected a CSV or Parquet table{columns and f' with columns {columns}'}"
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({(error.strerror or 'not readable').lower()}), {expected}") from None
    if data.startswith(b"PAR1"):
        try:
            return parquet(data)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    header = next((line for line in data.splitlines() if line.strip() and not line.startswith(b"#")), b"")
    delimiter = max(DELIMITERS, key=header.decode("utf-8", "replace").count)
    commas = delimiter != "," and re.search(rb"\d,\d", data) is not None
    options: dict[str, Any] = {
        "comment_prefix": "#",
        "infer_schema_length": None,
        "null_values": _MISSING,
        "separator": delimiter,
    }
    try:
        frame = pl.read_csv(data, decimal_comma=commas, **options)
    except pl.exceptions.PolarsError:
        raise InputError(f"{path} is no table, {expected}") from None
    return frame.rename({name: name.strip() for name in frame.columns})


def numbers(frame: pl.DataFrame, name: str) -> np.ndarray:
    """A column as (n,) float; NaN for what is no number."""
    series = frame[name]
    if series.dtype == pl.String:
        series = series.str.strip_chars()
    return series.cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy()
