"""A table of the whole run, kept on the disk row by row while it grows."""

import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from steerway.core.errors import InputError
from steerway.core.records import Motion
from steerway.formats.nmea0183.writing import Leg
from steerway.formats.writing import write, writer
from steerway.live.autopilot.states import Order, State
from steerway.live.heard import Row
from steerway.live.links.speakers import FileSpeaker

_REASON = 160  # bytes kept of a reason
_ROW = struct.Struct(f"={len(Row._fields)}db{_REASON}s")
_KEPT = np.dtype([("row", np.float64, len(Row._fields)), ("state", np.int8), ("reason", f"S{_REASON}")])
_STATES = tuple(State)
_NO_AUTOPILOT = -1


class TableFile:
    """All rows in one file at the end of the run: a row a fix, or with `every_tick` a row a tick.

    With an autopilot aboard the tables have its `state` and `reason` too, of the tick before a fix. Until the end the
    rows lie in `PATH.part`, so that a long run takes no memory, and one that was cut off is continued. `patient`:
    nothing is lost however slow the disk is. Raises InputError where nothing can be written.
    """

    def __init__(self, path: str | Path, every_tick: bool = False, patient: bool = False):
        writer(path)
        self.path, self.every_tick, self.patient = Path(path), every_tick, patient
        if not os.access(self.path.parent, os.W_OK):
            raise InputError(f"{path}: its folder cannot be written, expected one that can")
        self._part = Path(f"{path}.part")
        self._speaker: FileSpeaker | None = None
        self._order: Order | None = None

    def fix(self, row: Row) -> None:
        """See Output."""
        if not self.every_tick:
            self._keep(row)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        self._order = order
        if self.every_tick and row.valid:
            self._keep(row)

    def close(self) -> None:
        """See Output."""
        if self._speaker is not None:
            self._speaker.close()
            self._speaker.file.close()
        kept = np.fromfile(self._part, _KEPT) if self._part.exists() else np.empty(0, _KEPT)
        write(_motion(kept), self.path)
        self._part.unlink(missing_ok=True)

    def _keep(self, row):
        if self._speaker is None:
            self._speaker = FileSpeaker(_whole_rows(self._part), self.patient)
        if not self._speaker.broken:
            order = self._order
            state, reason = (_NO_AUTOPILOT, "") if order is None else (_STATES.index(order.state), order.reason)
            self._speaker.send(_ROW.pack(*row, state, reason.encode()[:_REASON]))


def _whole_rows(part):
    """The file to go on writing to, without the piece of a row that a cut left."""
    file = open(part, "ab")
    file.truncate(file.tell() // _ROW.size * _ROW.size)
    return file


@dataclass(frozen=True, eq=False)
class SteeredMotion(Motion):
    """Motion with the autopilot's state at each row and its reason, None where there was none."""

    states: Sequence[str | None] = ()
    reasons: Sequence[str | None] = ()

    def to_frame(self):
        """As of `Motion`, with the columns `state` and `reason`."""
        import polars as pl

        said = (pl.Series("state", self.states, pl.String), pl.Series("reason", self.reasons, pl.String))
        return super().to_frame().with_columns(*said)


def _motion(kept) -> Motion:
    said = dict(zip(Row._fields, kept["row"].T, strict=True))
    said["status"] = said["status"].astype(np.uint8)
    if np.all(kept["state"] == _NO_AUTOPILOT):
        return Motion(**said)
    states = [None if each == _NO_AUTOPILOT else _STATES[each].value for each in kept["state"]]
    reasons = [each.decode(errors="ignore") or None for each in kept["reason"]]
    return SteeredMotion(**said, states=states, reasons=reasons)
