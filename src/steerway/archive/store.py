"""The directory of an archive: manifest, staged reports, result tables and states.

    manifest.json                                  inputs and settings
    .lock                                          held by the writing process; contains its number and start
    staged/INPUT/day=N/bucket=N/…parquet           reports of an input by day and bucket of vessels
    estimate|events|trips/day=YYYY-MM-DD/bucket=NN.parquet
    state/day=YYYY-MM-DD/bucket=NN.npz             filters after the day; if it exists, the unit is done

Every file is complete or absent. The state of a unit is written last.
"""

import datetime
import json
import math
import shutil
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent
from steerway.formats.ais_tables import SCHEMA

DAY = 86_400
TABLES = ("estimate", "events", "trips")
_EPOCH = datetime.date(1970, 1, 1)


def date_of(day: int) -> str:
    """YYYY-MM-DD of a day, counted from 1970-01-01 as 0."""
    return (_EPOCH + datetime.timedelta(days=day)).isoformat()


def day_of(date: str) -> int:
    """The inverse of `date_of`: days since 1970-01-01."""
    return (datetime.date.fromisoformat(date) - _EPOCH).days


def left_out_of(manifest: dict[str, Any]) -> Counter[str]:
    """Number of rows left out of all inputs of an archive, by reason."""
    return sum((Counter(each["left_out"]) for each in manifest["inputs"].values()), Counter[str]())


@dataclass(frozen=True)
class BucketState:
    """State of a bucket after a day: its vessels, sorted by MMSI, and the histories of their tracks."""

    mmsi: np.ndarray  # (v,)
    tracks: np.ndarray  # (t, 2) MMSI and number, sorted
    carry: np.ndarray  # (t,) histories.HISTORY
    vessels: np.ndarray  # from here on the arrays of `association.Fleet`: vessels, tracks, fields of State
    slots: np.ndarray
    x: np.ndarray
    p: np.ndarray
    probability: np.ndarray
    run: np.ndarray

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """The arrays of `association.Fleet`."""
        return self.vessels, self.slots, self.x, self.p, self.probability, self.run


@dataclass(frozen=True)
class Store:
    """The files of an archive."""

    root: Path

    @classmethod
    def opened(cls, directory: str | Path) -> "Store":
        """The archive in a directory. Raises InputError for a directory without an archive."""
        store = cls(Path(directory))
        if not store.manifest_path.is_file():
            raise InputError(f"{directory} holds no archive, expected a directory made by `steerway archive run`")
        return store

    @property
    def manifest_path(self) -> Path:
        return self.root / "manifest.json"

    def manifest(self) -> dict[str, Any]:
        """Inputs and settings. Raises InputError if the file is damaged."""
        try:
            return json.loads(self.manifest_path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{self.manifest_path}: cannot be read ({error}), expected the manifest") from None

    def write_manifest(self, manifest: dict[str, Any]) -> None:
        with complete_or_absent(self.manifest_path) as file:
            file.write((json.dumps(manifest, indent=1, ensure_ascii=False) + "\n").encode())

    def names(self) -> dict[int, str]:
        """Names of the named vessels, by ID."""
        return {number: name for each in self.manifest()["inputs"].values() for name, number in each["vessels"].items()}

    def staged_directory(self, key: str) -> Path:
        """Directory with the reports of an input. key: first 16 digits of the input's SHA-256."""
        return self.root / "staged" / key

    def staged_units(self) -> list[tuple[int, int]]:
        """(day, bucket) of all staged reports, in order."""
        return sorted(unit for unit in units_in(self.root.glob("staged/*/day=*/bucket=*")) if unit[1] >= 0)

    def staged(self, day: int, bucket: int, digits: dict[str, float], until: float = math.inf) -> pl.DataFrame:
        """The reports of a unit before a time (Unix s). digits: position resolution (°) by key of the input."""
        files = sorted((self.root / "staged").glob(f"*/day={day}/bucket={bucket}/*.parquet"))
        if not files:
            return pl.DataFrame(schema={**SCHEMA, "digit": pl.Float64}).drop("reason")
        of_files = [
            pl.scan_parquet(file, glob=False).with_columns(digit=pl.lit(digits[file.parts[-4]])) for file in files
        ]
        return pl.concat(of_files).filter(pl.col("time_s") < until).drop("reason").collect()

    def path(self, table: str, day: int, bucket: int) -> Path:
        """Path of a unit's file in a table; creates the directory."""
        ending = "npz" if table == "state" else "parquet"
        path = self.root / table / f"day={date_of(day)}" / f"bucket={bucket:02d}.{ending}"
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def done(self) -> set[tuple[int, int]]:
        """(day, bucket) of the units that are done."""
        found = (self.root / "state").glob("day=*/bucket=*.npz")
        return {(day_of(each.parent.name[4:]), int(each.stem[7:])) for each in found}

    def files(self, table: str, buckets: Iterable[int] | None = None) -> list[Path]:
        """The files of a table, of finished units only, sorted by day and bucket."""
        done = self.done()
        chosen = sorted(unit for unit in done if buckets is None or unit[1] in set(buckets))
        return [path for unit in chosen if (path := self.path(table, *unit)).is_file()]

    def finish(self, day: int, bucket: int, state: BucketState, numbers: dict[str, Any]) -> None:
        """Write the state and the counts of a unit, which marks it as done; its tables must be written before."""
        text = np.frombuffer(json.dumps(numbers).encode(), np.uint8)
        with complete_or_absent(self.path("state", day, bucket)) as file:
            np.savez_compressed(file, numbers=text, **vars(state))

    def state(self, day: int, bucket: int) -> BucketState:
        """The state of a bucket after a day."""
        with np.load(self.path("state", day, bucket)) as arrays:
            return BucketState(**{name: arrays[name] for name in BucketState.__dataclass_fields__})

    def numbers(self, day: int, bucket: int) -> dict[str, Any]:
        """The counts of a unit."""
        with np.load(self.path("state", day, bucket)) as arrays:
            return json.loads(arrays["numbers"].tobytes())

    def undo(self, day: int, bucket: int) -> None:
        """Delete the files of a unit: its state first, because the state marks the unit as done."""
        for table in ("state", *TABLES):
            self.path(table, day, bucket).unlink(missing_ok=True)

    def remove_unfinished(self) -> None:
        """Delete unfinished files that a killed run left behind."""
        for part in (*self.root.glob("*/day=*/.*.part"), *self.root.glob(".*.part"), *self.root.glob("staged/.*.part")):
            if part.is_dir():
                shutil.rmtree(part, ignore_errors=True)
            else:
                part.unlink(missing_ok=True)


def units_in(directories: Iterable[Path]) -> set[tuple[int, int]]:
    """The (day, bucket) pairs of directories day=…/bucket=…."""
    return {(int(each.parent.name[4:]), int(each.name[7:])) for each in directories}
