"""AIS reports in tables of any size, as lazy polars frames with one set of columns.

Layouts: the Danish authority's, MarineCadastre's before and since 2025, GeoParquet with points, and any table with
columns for MMSI, time and position (see `formats.columns`). Values that mean "unknown" (91°, 181°, 102.3 kn, 360°,
511°) become null.
"""

import shutil
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import polars as pl

from steerway.core.earth import KNOT
from steerway.core.errors import InputError
from steerway.formats import packed
from steerway.formats.cells import header_of
from steerway.formats.columns import Column, plain_name, understood
from steerway.formats.units import unit_by_size

SCHEMA = pl.Schema(
    {
        "mmsi": pl.Int64,
        "time_s": pl.Float64,
        "lat_deg": pl.Float64,
        "lon_deg": pl.Float64,
        "sog_mps": pl.Float32,
        "cog_deg": pl.Float32,
        "heading_deg": pl.Float32,
        "mobile": pl.UInt8,
        "hull": pl.UInt32,
        "reason": pl.UInt8,
    }
)
"""Columns of `reports`. `mobile`: index into MOBILES. `hull`: code of the reported type and size, 0 if none. `reason`:
index into REASONS."""
MOBILES = ("unknown", "class A", "class B")
REASONS = (
    "",
    "no time",
    "no MMSI",
    "no position",
    "base station",
    "aid to navigation",
    "aircraft or search and rescue",
    "other station",
)
"""Reasons to leave out a row; "" for a row that is used."""

_TIMES = (
    "%d/%m/%Y %H:%M:%S",
    "%Y-%m-%dT%H:%M:%S",
    "%Y-%m-%d %H:%M:%S",
    "%Y-%m-%dT%H:%M:%S%.fZ",
    "%Y-%m-%d %H:%M:%S%.f",
)
_SIZES = ("length", "width")
_TYPES = ("ship_type", "vessel_type", "vesseltype", "shiptype", "ship_and_cargo_type")
_CLASSES = ("type_of_mobile", "transceiver_class", "transceiverclass", "transceiver", "class", "ais_class")
_OTHER_STATIONS = (("base", 4), ("aton", 5), ("sar", 6))
"""Text in the type of a station that is not a ship, and its index into REASONS."""
_SAMPLE = 2000


@contextmanager
def reports(path: Path, beside: Path) -> Iterator[pl.LazyFrame | None]:
    """The rows of a table as a lazy frame with SCHEMA, or None if the file has no MMSI, time and position columns.

    beside: directory for a temporary file, if the input is a ZIP. Raises InputError for a damaged file and for one
    that unpacks to far more than a table does.
    """
    unpacked = None
    try:
        packed.check(path)
        if zipfile.is_zipfile(path):
            unpacked = _unzipped(path, beside)
        yield _scanned(unpacked or path)
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError) as error:
        raise InputError(f"{path}: {str(error).splitlines()[0] or 'the table is damaged'}") from error
    finally:
        if unpacked is not None:
            unpacked.unlink(missing_ok=True)


def _unzipped(path: Path, beside: Path) -> Path:
    """Unpack the largest file in a ZIP, which can also contain a description; returns its path."""
    target = beside / f".{path.name}.unpacked.part"
    try:
        with packed.opened_zip(path) as archive:
            member = max(archive.infolist(), key=lambda each: each.file_size)
            with archive.open(member) as unpacked, open(target, "wb") as file:
                shutil.copyfileobj(unpacked, file, 1 << 20)
    except BaseException:
        target.unlink(missing_ok=True)
        raise
    return target


def _scanned(path: Path) -> pl.LazyFrame | None:
    with open(path, "rb") as file:
        head = file.read(1 << 16)
    if head.startswith(b"PK\x03\x04"):
        raise InputError(f"{path}: the ZIP archive is cut short")
    if head.startswith(b"PAR1"):
        frame = pl.scan_parquet(path, glob=False)
        names = frame.collect_schema().names()
    else:
        text = _first_text(path, head)
        header = header_of(text)
        if header is None or header[0] > 1 or not _is_ais(header[2]):
            return None
        _, separator, names, _ = header
        quote = '"' if b'"' in text else None
        options: dict[str, Any] = {"separator": separator, "quote_char": quote, "truncate_ragged_lines": True}
        frame = pl.scan_csv(path, glob=False, encoding="utf8-lossy", infer_schema=False, **options)
        found = frame.collect_schema().names()
        if len(found) != len(names):
            raise InputError(f"{path}: line 1 has an unbalanced quote, expected the names of columns")
        frame = frame.rename(dict(zip(found, names, strict=True)))
    return _canonical(frame, names) if _is_ais(names) else None


def _first_text(path: Path, head: bytes) -> bytes:
    """The first bytes of a file, unpacked."""
    if head.startswith(b"\x1f\x8b"):
        try:
            return zlib.decompressobj(wbits=31).decompress(head, 1 << 16)
        except zlib.error as error:
            raise InputError(f"{path}: the gzip archive is damaged from the beginning ({error})") from None
    if head.startswith(b"\x28\xb5\x2f\xfd"):
        lines = pl.read_csv(path, has_header=False, n_rows=1, separator="\x01", quote_char=None)
        return lines.item().encode()
    return head


def _is_ais(names: Sequence[str]) -> bool:
    known = understood(names)
    placed = {"latitude", "longitude"} <= known.keys() or "geometry" in map(plain_name, names)
    return placed and {"mmsi", "time"} <= known.keys()


def _canonical(frame: pl.LazyFrame, names: Sequence[str]) -> pl.LazyFrame:
    known, plain = understood(names), {plain_name(name): name for name in names}
    schema = frame.collect_schema()

    def number(meaning: str, dtype: type[pl.DataType] = pl.Float64) -> pl.Expr:
        if meaning not in known:
            return pl.lit(None, dtype=dtype)
        return pl.col(known[meaning].name).cast(dtype, strict=False)

    def first_of(spellings: Iterable[str], dtype: type[pl.DataType]) -> pl.Expr:
        found = next((plain[each] for each in spellings if each in plain), None)
        return pl.lit(None, dtype=dtype) if found is None else pl.col(found).cast(dtype, strict=False)

    if "latitude" in known:
        latitude, longitude = number("latitude"), number("longitude")
    else:  # well-known binary: byte order, type, x, y
        point = pl.col(plain["geometry"])
        latitude, longitude = (
            point.bin.slice(at, 8).bin.reinterpret(dtype=pl.Float64, endianness="little") for at in (13, 5)
        )
    on_earth = (latitude.abs() <= 90.0) & (longitude.abs() <= 180.0)
    sog, cog, heading = (number(each, pl.Float32) for each in ("sog", "cog", "heading"))
    factor = known["sog"].factor if "sog" in known else KNOT
    kind, size = first_of(_TYPES, pl.String), [first_of((each,), pl.Float64) for each in _SIZES]
    classes = first_of(_CLASSES, pl.String).map_batches(_described, return_dtype=pl.UInt8, is_elementwise=True)
    described = size[0].fill_null(0.0) > 0.0
    hull = pl.struct(kind=kind.fill_null(""), length=size[0].fill_null(0.0), width=size[1].fill_null(0.0))
    numbered = ((hull.hash(seed=1) % 0xFFFFFFFF) + 1).cast(pl.UInt32)
    mmsi = pl.col(known["mmsi"].name).cast(pl.Int64, strict=False)
    return (
        frame.select(
            mmsi=mmsi,
            time_s=_time(frame, known["time"], schema),
            lat_deg=pl.when(on_earth).then(latitude),
            lon_deg=pl.when(on_earth).then(pl.when(longitude == 180.0).then(-180.0).otherwise(longitude)),
            sog_mps=pl.when((sog >= 0.0) & (sog * factor < 102.25 * KNOT)).then(sog * factor).cast(pl.Float32),
            cog_deg=pl.when((cog >= 0.0) & (cog < 360.0)).then(cog),
            heading_deg=pl.when((heading >= 0.0) & (heading < 360.0)).then(heading),
            described=classes,
            hull=pl.when(described).then(numbered).otherwise(0).cast(pl.UInt32),
        )
        .with_columns(
            mobile=pl.when(pl.col("described") < len(MOBILES)).then(pl.col("described")).otherwise(0).cast(pl.UInt8),
            reason=_reason(),
        )
        .select(*SCHEMA)
    )


def _time(frame: pl.LazyFrame, column: Column, schema: pl.Schema) -> pl.Expr:
    dtype, named = schema[column.name], pl.col(column.name)
    if dtype.is_temporal():
        return named.cast(pl.Datetime("us")).to_physical() / 1e6
    sample = frame.select(named).head(_SAMPLE).collect().to_series()
    if dtype == pl.String:
        counts = {
            each: sample.str.to_datetime(each, strict=False, time_unit="us").is_not_null().sum() for each in _TIMES
        }
        best = max(counts, key=lambda each: counts[each])
        if counts[best]:
            moments = named.str.to_datetime(best, strict=False, time_unit="us").dt.replace_time_zone(None)
            return moments.to_physical() / 1e6
    median: Any = sample.cast(pl.Float64, strict=False).median()
    size = abs(float(median or 0.0))
    return named.cast(pl.Float64, strict=False) / round(1.0 / unit_by_size(size))


def _described(texts: pl.Series) -> pl.Series:
    """Codes of station types: an index into MOBILES for ships, into REASONS for other stations."""
    different = texts.unique()  # only a few
    return texts.replace_strict(different, [_type(text) for text in different], return_dtype=pl.UInt8)


def _type(text: str | None) -> int:
    plain = (text or "").strip().lower()
    if plain in ("a", "b", "class a", "class b"):
        return MOBILES.index(f"class {plain[-1].upper()}")
    return next((index for part, index in _OTHER_STATIONS if part in plain), 0)


def _first(*cases: tuple[pl.Expr, pl.Expr | int]) -> pl.Expr:
    """The number of the first case that holds, 0 if none does."""
    return pl.coalesce(*(pl.when(holds).then(number) for holds, number in cases), pl.lit(0))


def _station() -> pl.Expr:
    """Index into REASONS of a station that is not a ship, by its type or MMSI (ITU-R M.585); 0 for a ship."""
    mmsi, described = pl.col("mmsi"), pl.col("described")
    searching = mmsi.is_between(111_000_000, 111_999_999) | mmsi.is_between(970_000_000, 979_999_999)
    return _first(
        ((described == 4) | mmsi.is_between(1, 9_999_999), 4),
        ((described == 5) | mmsi.is_between(990_000_000, 999_999_999), 5),
        ((described == 6) | searching, 6),
        (mmsi.is_between(10_000_000, 79_999_999), 7),
    )


def _reason() -> pl.Expr:
    station, mmsi, time = _station(), pl.col("mmsi"), pl.col("time_s")
    return _first(
        (time.is_null() | time.is_nan(), 1),
        (mmsi.is_null() | ~mmsi.is_between(1, 9_999_999_999), 2),
        (station > 0, station),
        (pl.col("lat_deg").is_null() | pl.col("lon_deg").is_null(), 3),
    ).cast(pl.UInt8)
