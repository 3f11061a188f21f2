"""NMEA 0183: one incremental reader for files and for live links.

It accepts any talker, any prefix before the `$`, and noise, binary messages or spliced sentences in between. A talker's
sentences of one time become one row; every talker is a source. Rejected sentences are counted by reason.
"""

import re
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from steerway.core import magnetic
from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats
from steerway.core.interpreted import is_compiled, without_compiling
from steerway.core.records import Fixes
from steerway.formats.nmea0183 import epochs
from steerway.formats.nmea0183.fields import REASONS, VALUES
from steerway.formats.nmea0183.scan import SHORTEST, TALKERS, scan, talker_name
from steerway.formats.nmea0183.streams import POSITIONS, streams
from steerway.formats.recording import Recording

_FIELDS = {"latitude": epochs.LAT, "longitude": epochs.LON, "position_std": epochs.STD, "sog": epochs.SOG}
_FIELDS |= {"cog": epochs.COG, "water_speed": epochs.WATER, "yaw_rate": epochs.YAW, "bottom_speed": epochs.BOTTOM}
_FIELDS |= {"shaft": epochs.SHAFT}
"""Columns of rows by field of `Fixes`."""
_CHUNK = 1 << 20
_WORTH_COMPILING = 12e6
"""Bytes that the interpreter reads in 10 s, the time that compiling takes."""
_bytes_interpreted = 0  # total of this process, so that compiling starts after many short logs too
_HALF_DAY = 0.5 * epochs.DAY
_STRAY = 16  # rows that one damaged date can affect before the next date
_SENTENCE = re.compile(rb"\$(?:[A-Z0-9]{2}[A-Z]{3}|P[A-Z][A-Z0-9]{2,6}),[ -~]*[\r\n*]")

# Formatters of NMEA 0183 4.11 and of earlier versions still in use; any other one is a damaged header.
_STANDARD = frozenset(
    "AAM ABK ABM ACA ACK ACN ACS AIR AKD ALA ALC ALF ALM ALR APA APB ARC ASD BBM BEC BER BOD BWC BWR BWW CEK COP CUR "
    "DBK DBS DBT DCN DCR DDC DOR DPT DRU DSC DSE DSI DSR DTM ETL EVE EPV FIR FSI GAQ GBQ GBS GEN GFA GGA GLC GLL GLQ "
    "GMP GNQ GNS GPQ GQQ GRS GSA GST GSV GTD GXA HBT HCC HCD HCR HDG HDM HDT HFB HMR HMS HRM HSC HSS HTC HTD HTM HVD "
    "HVM IMA ITS LCD LR1 LR2 LR3 LRF LRI MDA MHU MMB MOB MSK MSS MTA MTW MWD MWV NAK NRM NRX NSR OSD POS PRC R00 RMA "
    "RMB RMC ROR ROT RPM RRT RSA RSD RTE SFI SM1 SM2 SM3 SM4 SMB SPW SSD STN TDS TFI THS TLB TLL TPC TPR TPT TRC TRD "
    "TRF TRL TTD TTM TUT TXT UID VBW VDM VDO VDR VER VHW VLW VPE VPW VSD VTA VTG VTI VWE VWR VWT WAT WCV WDC WDR WFM "
    "WNC WNR WPL XDR XTE XTR YWP YXS ZAA ZDA ZDL ZEV ZFI ZFO ZLZ ZPI ZTA ZTE ZTG ZTI ZWP ZZU".split()
)


class Sentences(NamedTuple):
    """The sentences of the kinds in FORMATTERS, in order of arrival.

    offset (n,): byte offset of the `$`. kind (n,): index into FORMATTERS. talker (n,): index for `talker_name`. values
    (n, VALUES): SI, with the columns of `fields`.
    """

    offset: np.ndarray
    kind: np.ndarray
    talker: np.ndarray
    values: np.ndarray


def recognises(head: bytes) -> bool:
    """Whether the beginning of a log contains an NMEA 0183 sentence that starts with `$` (AIS starts with `!`)."""
    return _SENTENCE.search(head) is not None


def read(data: bytes) -> Recording:
    """All sources of a log; damage is skipped and counted and raises no error."""
    reader = SentenceReader(interpreted=_is_short(len(data)))
    view = memoryview(data)
    for start in range(0, len(view), _CHUNK):
        reader.feed(view[start : start + _CHUNK])
    reader.finish()
    return reader.recording()


def _is_short(size: int) -> bool:
    """Whether to read without compiling: the kernels are not compiled, and compiling takes longer than reading."""
    global _bytes_interpreted
    if is_compiled(scan) and is_compiled(epochs.assemble):
        return False
    _bytes_interpreted += size
    return _bytes_interpreted < _WORTH_COMPILING


def sentences(data: bytes) -> Sentences:
    """The single sentences of a log, before dates are completed and rows assembled."""
    return SentenceReader(_is_short(len(data)))._scan(bytes(data), final=True, received=None)[0]


class SentenceReader:
    """Reads a stream of bytes in pieces of any size: call `feed`, then `recording` or `take`.

    A log can contain receive times in its lines. A live link passes receive times from a steady clock to `feed`, to
    date sentences without a time. interpreted: read without compiled kernels, about forty times slower.
    """

    def __init__(self, interpreted: bool = False):
        self._find = without_compiling(scan) if interpreted else scan
        self._assemble = without_compiling(epochs.assemble) if interpreted else epochs.assemble
        self._tail = b""
        self._carry = np.full(1, np.nan)
        self._with_checksum = np.zeros(TALKERS, np.bool_)
        self._headers: dict[int, int] = {}
        self._skipped = np.zeros(len(REASONS), np.int64)
        self._made = epochs.new_assembly()
        self._n = 0  # number of its rows
        self._place = np.full(2, np.nan)  # last position before these rows
        self._has_news = self._has_waiting = False

    def feed(self, chunk: bytes | memoryview, received: float | None = None, now: float = np.nan) -> None:
        """Read the sentences that a piece of the stream completes. received: Unix s; now: s, clock of the link."""
        self._made.memory[epochs.NOW] = now
        self._read(chunk, False, received)

    def finish(self) -> None:
        """End the stream: read a last sentence without line end."""
        self._read(b"", True, None)

    def recording(self) -> Recording:
        """Everything read so far; reading can continue."""
        return self._recording(self._made.rows[: self._n], np.arange(self._n))

    def holds(self, settled: bool = True) -> bool:
        """Whether `take` may return rows."""
        return self._has_news or (settled and self._has_waiting)

    @property
    def skipped(self) -> dict[str, int]:
        """The number of rejected sentences by reason."""
        return self._account()[1]

    def take(self, settled: bool = True) -> Recording:
        """Everything read since the last call. Memory does not grow, so a live link can run for ever.

        Without `settled` the newest epoch of every talker is held back, because more of its sentences may follow. With
        it, an epoch can be output before its last sentence. Its position is output once; later sentences of the epoch
        give a row with the same time and no position.
        """
        self._has_news, self._has_waiting = False, not settled
        rows = self._made.rows[: self._n]
        waiting = np.zeros(self._n, bool)
        if not settled:
            newest = self._made.newest[:, 0]
            waiting[newest[newest >= 0]] = True
        given = rows[:, epochs.GIVEN] == 1.0
        fresh = rows.copy()
        fresh[given, epochs.LAT : epochs.LON + 1] = np.nan
        useful = np.isfinite(fresh[:, epochs.LAT : epochs.MAGNETIC + 1]).any(axis=1) & ~waiting
        taken = self._recording(fresh[useful], np.flatnonzero(useful))
        for place in rows[np.isfinite(rows[:, epochs.LAT])][-1:, epochs.LAT : epochs.LON + 1]:
            self._place = place.copy()
        self._forget_all_but_open(waiting)
        return taken

    def _scan(self, data: bytes, final: bool, received: float | None) -> tuple[Sentences, int]:
        most = len(data) // SHORTEST + 1
        headers, offsets = np.empty(most, np.int64), np.empty(most, np.int64)
        kinds, talkers = np.empty(most, np.int64), np.empty(most, np.int64)
        values = np.empty((most, VALUES))
        arrived = np.nan if received is None else received
        n_sound, n, repeat = self._find(
            data, final, arrived, self._carry, self._with_checksum,
            headers, offsets, kinds, talkers, values, self._skipped,
        )  # fmt: skip
        for code, count in zip(*np.unique(headers[:n_sound], return_counts=True), strict=True):
            self._headers[int(code)] = self._headers.get(int(code), 0) + int(count)
        return Sentences(offsets[:n], kinds[:n], talkers[:n], values[:n]), repeat

    def _read(self, chunk: bytes | memoryview, final: bool, received: float | None) -> None:
        data = self._tail + bytes(chunk)
        found, repeat = self._scan(data, final, received)
        self._tail = data[repeat:]
        if not len(found.kind):
            return
        self._has_news = True
        self._make_room(len(found.kind))
        self._n = self._assemble(found.kind, found.talker, found.values, self._made, self._n)

    def _make_room(self, more: int) -> None:
        made = self._made
        lacking = self._n + more - len(made.rows)
        if lacking > 0:
            grown = max(lacking, len(made.rows))
            rows = np.concatenate([made.rows, np.empty((grown, epochs.COLUMNS))])
            seen, owners = (np.concatenate([each, np.empty(grown, np.int64)]) for each in (made.seen, made.owners))
            self._made = made._replace(rows=rows, seen=seen, owners=owners)

    def _forget_all_but_open(self, waiting: NDArray[np.bool_]) -> None:
        made = self._made
        kept = np.unique(made.newest[made.newest >= 0])
        newest = np.where(made.newest >= 0, np.searchsorted(kept, made.newest), -1)
        rows, output = made.rows[kept], ~waiting[kept]
        rows[output, epochs.GIVEN] = np.isfinite(rows[output, epochs.LAT])
        rows[output, epochs.STD : epochs.MAGNETIC + 1] = np.nan
        self._made = made._replace(newest=newest, rows=rows, seen=made.seen[kept], owners=made.owners[kept])
        self._n = len(kept)

    def _recording(self, rows: Floats, kept: NDArray[np.int64]) -> Recording:
        owners, seen = self._made.owners[kept], self._made.seen[kept]
        time, notes = _mended_times(rows, self._made.memory)
        heading, heading_notes, homeless = self._true_headings(rows, time)
        counts, skipped = self._account()
        if homeless:
            skipped["magnetic heading without variation or position"] = homeless
        sources, formatters = {}, {}
        for talker in np.unique(owners):
            mine = np.flatnonzero(owners == talker)
            mine = mine[np.argsort(time[mine], kind="stable")]
            for name, chosen in streams(talker_name(int(talker)), time, rows, seen, mine):
                columns: dict[str, Any] = {field: rows[chosen, column] for field, column in _FIELDS.items()}
                sources[name] = Fixes(time[chosen], **columns, heading=heading[chosen], source=name)
                formatters[name] = seen[chosen] & POSITIONS
        return Recording("NMEA 0183", sources, counts, skipped, tuple(notes + heading_notes), formatters)

    def _account(self) -> tuple[dict[str, int], dict[str, int]]:
        counts, skipped = {}, dict(zip(REASONS, self._skipped.tolist(), strict=True))
        skipped |= dict(zip(epochs.LOST, self._made.lost.tolist(), strict=True))
        damaged = 0
        for code, count in self._headers.items():
            name = code.to_bytes(8, "big").lstrip(b"\0").decode()
            if name[0] == "P" or (len(name) == 5 and name[2:] in _STANDARD):
                counts[name] = count
            else:
                damaged += count
        skipped["unknown sentence type"] = damaged
        ordered = dict(sorted(counts.items(), key=lambda each: -each[1]))
        return ordered, {reason: count for reason, count in skipped.items() if count}

    def _true_headings(self, rows: Floats, time: Floats) -> tuple[Floats, list[str], int]:
        """(true headings (n,), notes, number of headings left out).

        Headings still magnetic are corrected by the first variation in RMC, else by the World Magnetic Model.
        """
        heading = rows[:, epochs.HEADING].copy()
        waiting = np.flatnonzero(np.isnan(heading) & np.isfinite(rows[:, epochs.MAGNETIC]))
        memory, notes, homeless = self._made.memory, [], 0
        by_rmc = int(memory[epochs.RMC_VARIATION])
        if len(waiting) and np.isfinite(memory[epochs.FIRST_VARIATION]):
            heading[waiting] = rows[waiting, epochs.MAGNETIC] + memory[epochs.FIRST_VARIATION]
            by_rmc += len(waiting)
        elif len(waiting):
            dated = np.where(rows[:, epochs.UNDATED] == 1.0, np.nan, time)
            turned, model_note = _by_model(rows[:, epochs.LAT : epochs.LON + 1], dated, waiting, self._place)
            heading[waiting] = rows[waiting, epochs.MAGNETIC] + turned
            homeless = int(np.isnan(turned).sum())
            notes += model_note
        if memory[epochs.OWN_VARIATION]:
            own = int(memory[epochs.OWN_VARIATION])
            notes.append(f"{own} magnetic headings made true by the variation in their own sentence")
        if by_rmc:
            notes.append(f"{by_rmc} magnetic headings made true by the variation in RMC")
        return wrap_array(heading), notes, homeless


def _by_model(places: Floats, time: Floats, waiting: NDArray[np.int64], before: Floats) -> tuple[Floats, list[str]]:
    """Variation (rad) by the World Magnetic Model for each row in `waiting`, with a note; NaN without a position.

    The position is that of the last fix before the row, else `before` (2,) of earlier rows, else that of the first fix.
    """
    fixes = np.flatnonzero(np.isfinite(places[:, 0]))
    known = np.concatenate([before[None], places[fixes]])
    if np.isnan(before[0]):
        if not len(fixes):
            return np.full(len(waiting), np.nan), []
        known[0] = known[1]
    at = known[np.searchsorted(fixes, waiting, side="right")]
    turned = magnetic.variation(at[:, 0], at[:, 1], time[waiting])
    low, high = np.degrees(turned.min()), np.degrees(turned.max())
    model = magnetic.model_of(time[waiting[0]])
    note = (
        f"{len(waiting)} magnetic headings made true by the World Magnetic Model {model} ({low:+.1f} to {high:+.1f}°)"
    )
    return turned, [note]


def _mended_times(rows: Floats, memory: Floats) -> tuple[Floats, list[str]]:
    """Unix time of every row in order of arrival, and a note for each kind of correction.

    Rows that are whole GPS week rollovers behind the newest are corrected. Up to _STRAY successive rows with another
    date than the rows before and after get the date of those rows.
    """
    notes = []
    time = rows[:, epochs.TIME].copy()
    if rows[:, epochs.UNDATED].any():
        notes.append("the log has no date: days are counted from 1970-01-01")
    if memory[epochs.LOCAL]:
        hours, minutes = divmod(int(abs(memory[epochs.AHEAD])) // 60, 60)
        zone = f"{'-' if memory[epochs.AHEAD] < 0.0 else '+'}{hours:02d}:{minutes:02d}"
        local = int(memory[epochs.LOCAL])
        notes.append(f"{local} sentences without a date were in local time ({zone}) and have been converted to UTC")
    moved = int(memory[epochs.ROLLOVERS])
    if len(time) > 1:
        behind = np.round((time.max() - time) / epochs.ROLLOVER)
        early = (behind >= 1.0) & (np.abs(time.max() - time - behind * epochs.ROLLOVER) < epochs.NEAR)
        time[early] += behind[early] * epochs.ROLLOVER
        moved += int(early.sum())
    if moved:
        notes.append(f"GPS week rollover: {moved} dates were 1024 weeks (or a multiple) early and have been corrected")
    strays = _mend_strays(time) if len(time) > 1 else 0
    if strays:
        notes.append(f"{strays} rows had a date unlike that of the rows before and after and have been corrected")
    return time, notes


def _mend_strays(time: Floats) -> int:
    """Correct short runs of rows with another date, in place; returns their number."""
    jumps = np.flatnonzero(np.abs(np.diff(time)) > _HALF_DAY)
    mended = 0
    for before, last in pairwise(jumps):
        if last - before <= _STRAY and abs(time[last + 1] - time[before]) < _HALF_DAY:
            stray = slice(before + 1, last + 1)
            time[stray] += epochs.DAY * np.round((time[before] - time[stray]) / epochs.DAY)
            mended += int(last - before)
    return mended
