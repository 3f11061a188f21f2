"""A table of the whole run, written to disk row by row."""

import io
import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from steerway.core.errors import InputError
from steerway.core.leg import Leg
from steerway.core.records import Motion
from steerway.live.links.file import FileSink
from steerway.live.outputs.output import Output
from steerway.live.rows import Order, Row, State
from steerway.live.uri import LOG

if TYPE_CHECKING:
    import polars as pl

_REASON = 160  # longest stored reason, bytes
_ROW = struct.Struct(f"={len(Row._fields)}db{_REASON}s")
_KEPT = np.dtype([("row", np.float64, len(Row._fields)), ("state", np.int8), ("reason", f"S{_REASON}")])
_STATES = tuple(State)
_NO_AUTOPILOT = -1


class TableFile(Output):
    """Writes all rows to one file at the end of the run: a row per fix, or with `every_tick` a row per tick.

    With an autopilot the table also has `state` and `reason`; at a fix they are those of the last tick. Until the end
    of the run the rows are in `PATH.part`: a long run takes no memory, and the next run continues the table of a run
    that was cut off. `lossless`: wait for a slow disk. Raises InputError if the file cannot be written.
    """

    def __init__(self, path: str | Path, every_tick: bool = False, lossless: bool = False):
        from steerway.formats.writing import writer  # loads polars, which a run without a table does not need

        writer(path)
        self.path, self.every_tick, self.lossless = Path(path), every_tick, lossless
        if not os.access(self.path.parent, os.W_OK):
            raise InputError(f"{path}: its folder cannot be written to, expected a writable folder")
        self._part = Path(f"{path}.part")
        self._sink: FileSink | None = None
        self._order: Order | None = None

    def fix(self, row: Row) -> None:
        """See Output."""
        if not self.every_tick:
            self._store(row)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        self._order = order
        if self.every_tick and row.valid:
            self._store(row)

    def close(self) -> None:
        """See Output."""
        if self._sink is not None:
            self._sink.close()
            self._sink.file.close()
        from steerway.formats.writing import write

        kept = np.fromfile(self._part, _KEPT) if self._part.exists() else np.empty(0, _KEPT)
        try:
            write(_motion(kept), self.path)
        except InputError as error:
            LOG.error("%s; its rows are kept in %s", error, self._part)
        else:
            self._part.unlink(missing_ok=True)

    def _store(self, row: Row) -> None:
        if self._sink is None:
            self._sink = FileSink(_whole_rows(self._part), self.lossless, name=str(self._part))
        if not self._sink.broken:
            order = self._order
            state, reason = (_NO_AUTOPILOT, "") if order is None else (_STATES.index(order.state), order.reason)
            self._sink.send(_ROW.pack(*row, state, reason.encode()[:_REASON]))


def _whole_rows(part: Path) -> io.FileIO:
    """The file to append to, without the incomplete row of a run that was cut off."""
    file = open(part, "ab", buffering=0)
    file.truncate(file.tell() // _ROW.size * _ROW.size)
    return file


@dataclass(frozen=True, eq=False)
class SteeredMotion(Motion):
    """Motion with the autopilot's state at each row and its reason; None without an autopilot or a reason."""

    states: Sequence[str | None] = ()
    reasons: Sequence[str | None] = ()

    def to_frame(self) -> "pl.DataFrame":
        """The table of `Motion.to_frame`, with the columns `state` and `reason`."""
        import polars as pl

        texts = (pl.Series("state", self.states, pl.String), pl.Series("reason", self.reasons, pl.String))
        return super().to_frame().with_columns(*texts)


def _motion(kept: np.ndarray) -> Motion:
    columns = dict(zip(Row._fields, kept["row"].T, strict=True))
    columns["status"] = columns["status"].astype(np.uint8)
    if np.all(kept["state"] == _NO_AUTOPILOT):
        return Motion(**columns)
    states = [None if each == _NO_AUTOPILOT else _STATES[each].value for each in kept["state"]]
    reasons = [each.decode(errors="ignore") or None for each in kept["reason"]]
    return SteeredMotion(**columns, states=states, reasons=reasons)
