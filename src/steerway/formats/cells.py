"""The cells of a table, read by polars: typed from Parquet, text from CSV (comma, semicolon, tab or bar).

`read_plain` reads any table with a header, whatever its columns.
"""

import contextlib
import io
import os
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from steerway.core.errors import InputError
from steerway.formats import parquet_structure
from steerway.formats.columns import EXPECTED, spelled, understood

DELIMITERS = (",", ";", "\t", "|")
_UNKNOWN = ["", "nan", "NaN", "null", "NA", "-"]
_MOST_COLUMNS = 2000  # a line with more columns is not a header
_MOST_ABOVE = 5  # lines above the header, besides comments
_MOST_ROWS, _MOST_ROWS_OF_SMALL = 8, 100_000  # row limits: per byte of a Parquet file; of a small file
_LEAST_ROW = 8  # least average bytes per row of a larger table: even an empty row takes memory


def parquet(data: bytes) -> pl.DataFrame:
    """The frame of a Parquet file. Raises InputError if it is damaged or declares more rows than it can hold."""
    parquet_structure.check(data)
    try:
        with _quiet():
            declared = pl.scan_parquet(io.BytesIO(data)).select(pl.len()).collect().item()
            if declared <= max(_MOST_ROWS * len(data), _MOST_ROWS_OF_SMALL):
                return pl.read_parquet(io.BytesIO(data))
    except (pl.exceptions.PolarsError, OSError, ValueError) as error:
        raise InputError(f"the Parquet file is damaged: {str(error).splitlines()[0]}") from error
    except pl.exceptions.PanicException as error:
        raise InputError("the Parquet file is damaged, expected one that polars reads") from error
    raise InputError(f"the Parquet file declares {declared} rows, expected at most {_MOST_ROWS} a byte")


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Hold back standard error, and drop it if the block fails: polars prints 27 lines before its exception."""
    sys.stderr.flush()
    try:
        kept = os.dup(2)
    except OSError:  # a service without standard error
        yield
        return
    with tempfile.TemporaryFile() as written:
        os.dup2(written.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
        written.seek(0)
        sys.stderr.write(written.read().decode(errors="replace"))


def header_of(text: bytes) -> tuple[int, str, list[str], int] | None:
    """(line number, delimiter, names, where the next line begins) of the header; None without a header.

    Comment lines can precede the header, and the header can itself be a comment, as in tables of the Danish authority.
    A few other lines can precede it too, such as a title or a number of rows.
    """
    above = 0
    start = 3 if text.startswith(b"\xef\xbb\xbf") else 0
    for number in range(1, 100):
        stop = text.find(b"\n", start)
        stop = len(text) if stop < 0 else stop
        line = text[start:stop].decode("utf-8", "replace").strip()
        commented = line.startswith(("#", "%"))
        plain = line.lstrip("#% ")
        delimiter = max(DELIMITERS, key=plain.count)
        if plain.count(delimiter) > _MOST_COLUMNS:
            return None
        names = [name.strip().strip('"').strip() for name in plain.split(delimiter)]
        known = {"time", "latitude", "longitude"} & understood(names).keys()
        is_header = len(known) > 1 or (known and len(names) > 1 and not commented and not _is_sentence(names))
        if is_header and (not above or len(known) == 3):
            return number, delimiter, names, stop + 1
        above += bool(line) and not commented
        if above > _MOST_ABOVE or stop == len(text):
            return None
        start = stop + 1
    return None


def _is_sentence(names: Sequence[str]) -> bool:
    """Whether a line is an NMEA sentence, in which T between commas means true and not a column of times."""
    return "$" in names[0] or "!" in names[0] or "t" in map(str.lower, names)


def csv(
    data: bytes, skipped: Counter[str], vessel_column: str | None = None
) -> tuple[pl.DataFrame, list[str], int, str]:
    """(frame of text with the known columns, column names, line number of the first row, delimiter).

    Raises InputError for a table without a known column, or with far too many short lines.
    """
    header = header_of(data)
    if header is None:
        first = data.split(b"\n", 1)[0][:100].decode("utf-8", "replace").strip()
        raise InputError(f"line 1 of the table is {first!r}, expected names of columns: {EXPECTED}")
    number, delimiter, names, start = header
    body = data[start:]
    rows = body.count(b"\n")
    if rows > max(len(body) / _LEAST_ROW, _MOST_ROWS_OF_SMALL):
        raise InputError(
            f"the table has {rows} lines of {len(body) / rows:.1f} bytes on average, expected {_LEAST_ROW} or more"
        )
    quoted = b'"' in body
    if quoted:
        body = _without_stray_quotes(body, skipped)
    schema = {f"{index}": pl.String for index in range(len(names))}
    body = delimiter.encode() * (len(names) - 1) + b"\n" + body  # polars counts columns in the first row
    known = {column.index for column in spelled(names)}
    wanted = sorted(known | {index for index, name in enumerate(names) if name == vessel_column})
    options: dict[str, Any] = {"has_header": False, "schema": schema, "columns": wanted, "separator": delimiter}
    options |= {"truncate_ragged_lines": True, "encoding": "utf8-lossy"}
    try:
        frame = pl.read_csv(body, quote_char='"' if quoted else None, **options)
    except pl.exceptions.PolarsError:
        frame = pl.read_csv(body, quote_char=None, **options)
    return frame, names, number, delimiter


def _without_stray_quotes(body: bytes, skipped: Counter[str]) -> bytes:
    """The body with lines of unbalanced quotes made empty. Cells never span lines, so a stray quote costs one line."""
    lines = body.split(b"\n")
    stray = [row for row, line in enumerate(lines) if line.count(b'"') % 2]
    for row in stray:
        lines[row] = b""
    if stray:
        skipped["unbalanced quote"] += len(stray)
    return b"\n".join(lines)


def read_plain(path: str | PathLike[str], columns: str = "") -> pl.DataFrame:
    """The table in a file, with the column names of its header; lines that begin with # are comments.

    Decimal commas are read unless commas separate the cells. columns: the expected columns, for error messages. Raises
    InputError for a file that cannot be read or is not a table.
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
        "null_values": _UNKNOWN,
        "separator": delimiter,
    }
    try:
        frame = pl.read_csv(data, decimal_comma=commas, **options)
    except pl.exceptions.PolarsError:
        raise InputError(f"{path}: not a table, {expected}") from None
    return frame.rename({name: name.strip() for name in frame.columns})


def numbers(frame: pl.DataFrame, name: str) -> np.ndarray:
    """A column as (n,) float; NaN where a cell is not a number."""
    series = frame[name]
    if series.dtype == pl.String:
        series = series.str.strip_chars()
    return series.cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy()
