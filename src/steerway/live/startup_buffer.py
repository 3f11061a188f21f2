"""Holds the rows of the first seconds of a live run until the best source is chosen.

The choice is the one that `estimate` makes on a log of these seconds, with the same division of talkers into streams
and the same measure of quality. The held rows then pass on in their order of arrival.
"""

import math
from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np

from steerway.core.records import Fixes
from steerway.formats.nmea0183.epochs import DAY
from steerway.formats.nmea0183.streams import FEW, Division, division
from steerway.formats.sources import choose, rank
from steerway.live.rows import InputRow

LONGEST = 10.0
"""Longest time from the first position to the choice of a source, s."""
_ALONE, _ALONE_SPAN = 3, 0.5  # number of epochs (the last may be incomplete) and s needed from an only source
_COMPARED = 10  # number of epochs needed from each of several sources
_HALF_DAY = 0.5 * DAY
_REMEMBERED = 40  # number of newest rows of a talker that show its streams


class Streams:
    """Divides talkers into streams of positions and names rows by stream; see `formats.nmea0183.streams`."""

    def __init__(self) -> None:
        self._newest: dict[str, deque[tuple[int, InputRow]]] = {}
        self._divisions: dict[str, Division] = {}
        self._tracks: dict[str, list[InputRow]] = {}
        self._placed: dict[str, InputRow] = {}  # the last row with a position of a talker divided by formatters
        self._count = 0

    def learn(self, row: InputRow) -> bool:
        """Remember a row; return whether its talker is now found to have two streams."""
        self._count += 1
        if not (row.has_position and row.formatters):
            return False
        newest = self._newest.setdefault(row.source, deque(maxlen=_REMEMBERED))
        newest.append((self._count, row))
        return row.source not in self._divisions and self.divide(row.source)

    def divide(self, source: str) -> bool:
        """Divide a talker if its newest rows show two streams; return whether they do."""
        newest = self._newest.get(source, ())
        divided = None
        if len(newest) >= FEW and self.is_double(source):
            divided = _division(sorted(newest, key=lambda each: each[1].time))
        if divided is not None:
            self._divisions[source] = divided
        return divided is not None

    def newest(self, source: str) -> list[InputRow]:
        """The last rows of a talker, in order of arrival."""
        return [row for _, row in self._newest[source]]

    def is_double(self, source: str) -> bool:
        """Whether a talker has sent two positions for one time."""
        rows = [row for _, row in self._newest.get(source, ())]
        places = {(row.time, row.latitude, row.longitude) for row in rows}
        return len({time for time, *_ in places}) < len(places)

    def all_names(self, row: InputRow) -> list[str]:
        """The names of all streams that a row with a position belongs to."""
        divided = self._divisions.get(row.source)
        if divided is None or not divided.formatters:
            return [self.named(row).source]
        names = zip(divided.formatters, divided.names(row.source), strict=True)
        return [name for kind, name in names if row.formatters >> kind & 1]

    def lesser(self) -> set[str]:
        """The casefolded names of streams divided by formatter, except the stream of each talker's best formatter."""
        divided = ((source, each) for source, each in self._divisions.items() if each.formatters)
        return {name.casefold() for source, each in divided for name in each.names(source)[1:]}

    def named(self, row: InputRow, present: str = "") -> InputRow:
        """The row with its stream as source: `present` if that is one of its streams."""
        divided = self._divisions.get(row.source)
        if divided is None:
            return row
        names = divided.names(row.source)
        if divided.formatters:
            row = self._completed(row, present)
            mine = self.all_names(row) or names[:1]
            return row._replace(source=present if present in mine else mine[0])
        return row._replace(source=names[self._track(row)] if row.has_position else names[0])

    def _completed(self, row: InputRow, present: str) -> InputRow:
        """The row with its epoch's position if another formatter gave it: decoders give one position per epoch, even
        if a pause splits the epoch before the formatter in use arrives.
        """
        before = self._placed.get(row.source)
        if row.has_position:
            self._placed[row.source] = row
        elif before is not None and before.time == row.time and present in self.all_names(row):
            if present not in self.all_names(before):
                return row._replace(
                    latitude=before.latitude, longitude=before.longitude, position_std=before.position_std
                )
        return row

    def _track(self, row: InputRow) -> int:
        """Index (0 or 1) of the receiver whose track a row continues; a receiver gives one position per epoch."""
        newest = self._tracks.setdefault(row.source, [])
        if len(newest) < 2:
            if newest and newest[0].time != row.time:
                newest.clear()
            newest.append(row)
            return len(newest) - 1
        apart = [_apart(row, each) for each in newest]
        track = int(apart[1] < apart[0])
        track = 1 - track if newest[track].time == row.time else track
        newest[track] = row
        return track


class StartupBuffer:
    """Holds rows until a source can be chosen. `wanted` as in `SourceChoice`; `chosen` is "" until then.

    `refusal` is "", unless no wanted source has given a position within `LONGEST`. It then names those that have.
    """

    def __init__(self, wanted: tuple[str, ...] = ()):
        self.names = wanted
        self.chosen = self.refusal = ""
        self.streams = Streams()
        self._held: list[tuple[InputRow, float]] = []
        self._begun = math.nan  # arrival of the first position

    def add_rows(self, rows: Iterable[InputRow], arrived: float) -> list[tuple[InputRow, float]]:
        """The rows to use now, each with its arrival: none until a source is chosen, then the held and the new rows."""
        for row in rows:
            if math.isnan(self._begun) and not row.has_position:
                continue
            self._begun = arrived if math.isnan(self._begun) else self._begun
            if self._held and abs(row.time - self._held[-1][0].time) > _HALF_DAY:
                self._date_all(row.time)
            self._held.append((row, arrived))
            if self.streams.learn(row) and self.chosen == row.source:
                self.chosen = self._best(self._named(self.streams.newest(row.source))) or self.chosen
        return self.take_ready(arrived)

    def _date_all(self, time: float) -> None:
        """Replace the computer's date in buffered rows by the receiver's."""
        held, self._held = self._held, []
        self.streams = Streams()
        for row, arrived in held:
            time_of_day = round(row.time % DAY, 6)
            dated = row._replace(time=time_of_day + DAY * round((time - time_of_day) / DAY))
            self.streams.learn(dated)
            self._held.append((dated, arrived))

    def take_ready(self, now: float) -> list[tuple[InputRow, float]]:
        """As `add_rows`, without new rows."""
        if not self._held or not (self.chosen or self._choose(now)):
            return []
        held, self._held = self._held, []
        return [(self.streams.named(row, self.chosen), arrived) for row, arrived in held]

    def _choose(self, now: float) -> bool:
        sources = self._named(row for row, _ in self._held)
        wanted = {name: rows for name, rows in sources.items() if rank(name, self.names) is not None}
        if self._is_decided(wanted or sources, now, bool(wanted)):
            for talker in {row.source for row, _ in self._held}:
                self.streams.divide(talker)
            self.chosen = self._best(sources)
            if not self.chosen:
                names = ", ".join(map(repr, self.names))
                there = ", ".join(map(repr, sources))
                self.refusal = f"source {names} sends no position; the sources with positions are {there}"
        return bool(self.chosen)

    def _best(self, sources: dict[str, list[InputRow]]) -> str:
        """The source that `estimate` chooses among those of the best rank; "" if no wanted one is there."""
        # A few epochs do not show which formatter is better.
        lesser = self.streams.lesser() - {name.casefold() for name in self.names}
        places = {name: rank(name, self.names) for name in sources if name.casefold() not in lesser}
        ranks = {name: place for name, place in places.items() if place is not None}
        first = min(ranks.values(), default=0)
        tables = {name: fixes_of(sources[name]) for name, place in ranks.items() if place == first}
        return choose(tables) if tables else ""

    def _named(self, rows: Iterable[InputRow]) -> dict[str, list[InputRow]]:
        """The rows with positions by source; a row whose position two formatters gave is in both sources."""
        sources: dict[str, list[InputRow]] = {}
        for row in rows:
            if row.has_position:
                for name in self.streams.all_names(row):
                    sources.setdefault(name, []).append(row)
        return sources

    def _is_decided(self, sources: dict[str, list[InputRow]], now: float, is_wanted: bool) -> bool:
        times = {name: {row.time for row in rows} for name, rows in sources.items()}
        span = max(max(each) - min(each) for each in times.values())
        if now - self._begun >= LONGEST or span >= LONGEST:
            return True
        if not is_wanted:
            return False
        if len(times) == 1 and not any(self.streams.is_double(row.source) for row in next(iter(sources.values()))[-1:]):
            return all(len(each) >= _ALONE for each in times.values()) and span >= _ALONE_SPAN
        return all(len(each) >= _COMPARED for each in times.values())


def fixes_of(rows: Iterable[InputRow]) -> Fixes:
    """The positions of rows, with SOG and COG, in time order."""
    columns = np.array([(row.time, row.latitude, row.longitude, row.sog, row.cog) for row in rows]).T
    time, latitude, longitude, sog, cog = columns
    return Fixes(time=time, latitude=latitude, longitude=longitude, sog=sog, cog=cog).in_order()


def _division(newest: Sequence[tuple[int, InputRow]]) -> Division | None:
    columns = [(row.time, row.latitude, row.longitude, row.formatters, row.sog, arrival) for arrival, row in newest]
    time, latitude, longitude, formatters, sog, arrival = np.array(columns).T
    return division(time, latitude, longitude, formatters.astype(np.int64), sog, arrival)


def _apart(row: InputRow, other: InputRow) -> float:
    return abs(row.latitude - other.latitude) + abs(row.longitude - other.longitude)
