"""Make one record from the sources of several logs: join logs, choose the best source, add other instruments."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from steerway.core.arrays import Floats
from steerway.core.earth import radii
from steerway.core.errors import InputError
from steerway.core.gaps import GAP_INTERVALS, shortest_gap
from steerway.core.records import INSTRUMENT_COLUMNS, REPORTED, Fixes
from steerway.core.statistics import last_digit

_SAME_TIME = 1e-3
_OVERLAP = 2.0  # s by which consecutive logs may overlap
_FINE = 0.1  # m, added to the resolution: finer digits are no better, because receiver noise is larger
_FAST = 20.0  # Hz; a higher rate does not raise the score
_SAMPLE = 500
OWN_SHARE = 0.5
"""The source of the positions keeps its own values of an instrument if at least this share of its fixes has them."""


@dataclass(frozen=True)
class Quality:
    """Quality of the positions of a source."""

    rows: int
    fixes: int
    start: float  # first time of the rows, Unix s; NaN without rows
    stop: float  # last time of the rows
    rate: float  # Hz, from the median interval of fixes; NaN below two fixes
    gaps: int  # number of intervals longer than `core.gaps.shortest_gap`
    longest_gap: float  # s, 0 for none
    resolution: float  # m, last decimal of the positions; NaN if unknown
    roughness: float  # m, median distance of a fix from the line between its neighbours; NaN below three fixes
    says: tuple[str, ...]  # other columns with values
    vessels: int  # number of vessels; 0 in the own boat's log
    score: float  # rate × continuity over the whole record / (resolution + roughness); 0 without positions


def quality(fixes: Fixes, span: float | None = None) -> Quality:
    """The quality of a source; its continuity is relative to `span` (s), by default its own length."""
    reported = tuple(name for name in REPORTED if np.isfinite(getattr(fixes, name)).any())
    ends = (float(fixes.time.min()), float(fixes.time.max())) if len(fixes) else (np.nan, np.nan)
    placed = fixes.rows(fixes.has_position)
    vessels = 0 if fixes.mmsi is None else len(np.unique(fixes.mmsi))
    intervals = _intervals(placed)
    if not len(intervals):
        score = 1e-9 if len(placed) else 0.0
        return Quality(len(fixes), len(placed), *ends, np.nan, 0, 0.0, np.nan, np.nan, reported, vessels, score)
    usual = float(np.median(intervals))
    gaps = intervals[intervals > shortest_gap(intervals, fixes.mmsi is not None)]
    own = float(intervals.sum())
    covered = np.minimum(intervals, usual).sum() / max(own, span or 0.0)
    resolution = _resolution(placed)
    roughness = _roughness(placed, usual)
    fineness = 1.0 / (_FINE + np.nan_to_num(resolution) + np.nan_to_num(roughness))
    with_speed = np.isfinite(placed.sog).mean()  # among equal sources, prefers the one that also reports speed
    score = min(1.0 / usual, _FAST) * covered * fineness * (1.0 + 0.1 * with_speed)
    longest = float(gaps.max()) if len(gaps) else 0.0
    return Quality(
        len(fixes),
        len(placed),
        *ends,
        1.0 / usual,
        len(gaps),
        longest,
        resolution,
        roughness,
        reported,
        vessels,
        float(score),
    )


def _intervals(placed: Fixes) -> Floats:
    """Intervals (s) between fixes of the same vessel, without those below 1 ms."""
    each = [np.diff(np.unique(track.time)) for _, track in placed.tracks()]
    intervals = np.concatenate(each) if each else np.empty(0)
    return intervals[intervals > _SAME_TIME]


def _resolution(placed: Fixes) -> float:
    """The last decimal (of degrees or minutes) of the positions, in m; NaN if they have none."""
    some = placed.rows(slice(None, None, max(1, len(placed) // _SAMPLE)))
    meridian, _ = radii(float(placed.latitude[0]))
    return last_digit(np.concatenate([some.latitude, some.longitude])) * meridian


def _roughness(placed: Fixes, usual: float) -> float:
    """Median distance (m) of a fix from the line between its neighbours: noise, uneven time stamps and late fixes."""
    time, first = np.unique(placed.time, return_index=True)
    if len(time) < 3 or placed.mmsi is not None:
        return np.nan
    meridian, prime_vertical = radii(float(placed.latitude[0]))
    scale = np.array([meridian, prime_vertical * np.cos(placed.latitude[0])])
    place = np.column_stack([placed.latitude[first], np.unwrap(placed.longitude[first])]) * scale
    share = (time[1:-1] - time[:-2]) / (time[2:] - time[:-2])
    between = place[:-2] + share[:, None] * (place[2:] - place[:-2])
    close = time[2:] - time[:-2] < 2.0 * GAP_INTERVALS * usual
    return float(np.median(np.hypot(*(place[1:-1] - between)[close].T))) if close.any() else np.nan


def gather(logs: Sequence[tuple[str, Mapping[str, Fixes]]]) -> dict[str, Fixes]:
    """The sources of several logs, each in time order.

    A name in consecutive logs, or in copies of one log, is one source. In different logs of the same hours it belongs
    to two devices, so the name of the log is added.
    """
    parts_of: dict[str, list[tuple[str, Fixes]]] = {}
    for log, sources in logs:
        for name, fixes in sources.items():
            if len(fixes):
                parts_of.setdefault(name, []).append((log, fixes))
    gathered = {}
    for name, parts in parts_of.items():
        parts.sort(key=lambda part: part[1].time.min())
        if _are_one(parts):
            gathered[name] = joined([fixes for _, fixes in parts])
        else:
            for log, fixes in parts:
                label = f"{name} in {log}"
                gathered[label] = joined([gathered[label], fixes]) if label in gathered else fixes
    return {name: replace(fixes, source=name) for name, fixes in gathered.items()}


def _are_one(parts: Sequence[tuple[str, Fixes]]) -> bool:
    """Whether parts with one name, sorted by their beginning, come from one device."""
    for k in range(1, len(parts)):
        earlier, later = parts[k - 1][1], parts[k][1]
        if later.mmsi is not None or later.time.min() > earlier.time.max() - _OVERLAP:
            continue
        shared = later.between(later.time.min(), earlier.time.max())
        if np.mean(_in_earlier(shared, earlier)) < 0.5:
            return False
    return True


def _keys(fixes: Fixes) -> np.ndarray:
    mmsi = np.zeros(len(fixes)) if fixes.mmsi is None else fixes.mmsi
    values = np.column_stack([mmsi, fixes.time, fixes.latitude, fixes.longitude, fixes.heading])
    return np.ascontiguousarray(np.nan_to_num(values, nan=1e9)).view("V40").reshape(-1)


def _in_earlier(fixes: Fixes, earlier: Fixes) -> NDArray[np.bool_]:
    """(n,) bool: whether an earlier log contains the row with the same values."""
    known = set(_keys(earlier).tolist())
    return np.array([key in known for key in _keys(fixes).tolist()], bool)


def joined(parts: Sequence[Fixes]) -> Fixes:
    """The rows of several parts in time order, without rows that an earlier part contains."""
    whole = parts[0]
    for part in parts[1:]:
        shares = len(part) and len(whole) and part.time.min() <= whole.time.max()
        fresh = part.rows(~_in_earlier(part, whole)) if shares else part
        whole = _stacked(whole, fresh)
    return whole.in_order()


def _stacked(first: Fixes, second: Fixes) -> Fixes:
    """The rows of both tables. Tables with and without MMSI are never combined here."""
    names = first.columns() if first.mmsi is None or second.mmsi is not None else Fixes(*[np.empty(0)] * 3).columns()
    whole: dict[str, Any] = {name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in names}
    return replace(first, **whole)


def rank(name: str, wanted: Sequence[str]) -> int | None:
    """Index of a source among the wanted names; None if it is not wanted, 0 if no names are given.

    A name also matches sources that begin with it ("GP" matches "GP RMC" and "GP in tcp://…"); case does not matter.
    """
    folded = name.casefold()
    begun = (k for k, each in enumerate(wanted) if f"{folded} ".startswith(f"{each.casefold()} "))
    return next(begun, None) if wanted else 0


def choose(sources: Mapping[str, Fixes], wanted: str | None = None) -> str:
    """Name of the source whose positions are used: the wanted one, else that with the highest score.

    The own boat comes before AIS. A wanted name also matches sources that begin with it (see `rank`), unless one has
    exactly this name. Raises InputError if no source matches or has positions.
    """
    placed = {name: fixes for name, fixes in sources.items() if fixes.has_position.any()}
    named = placed
    if wanted is not None:
        exact = {name for name in sources if name.casefold() == wanted.casefold()}
        meant = exact or {name for name in sources if rank(name, (wanted,)) is not None}
        named = {name: placed[name] for name in placed if name in meant}
        if not named:
            what = "has no position" if meant else "is not in the log"
            there = ", ".join(repr(name) for name in placed)
            raise InputError(f"source {wanted!r} {what}; the sources with positions are {there}")
    span = max(fixes.time.max() for fixes in placed.values()) - min(fixes.time.min() for fixes in placed.values())
    scores = {name: quality(fixes, span).score for name, fixes in named.items()}
    return max(named, key=lambda name: (named[name].mmsi is None, scores[name]))


def with_instruments(name: str, sources: Mapping[str, Fixes]) -> tuple[Fixes, list[str]]:
    """(chosen source with other instruments of the own boat, in its rows or in rows without a position; notes).

    Each column comes from one source, so that two compasses are never mixed: from the chosen source if it reports the
    column in at least half of its fixes, else from the source that reports it most often. SOG or COG come from another
    source only if that has no positions and the chosen source does not report the column.
    """
    chosen = sources[name]
    notes: list[str] = []
    if chosen.mmsi is not None:
        return chosen, notes
    gifts: dict[str, list[str]] = {}
    for column in (*INSTRUMENT_COLUMNS, "sog", "cog"):
        giver = _giver(name, sources, column)
        if giver is not None:
            gifts.setdefault(giver, []).append(column)
    for giver, columns in gifts.items():
        chosen = _merged(chosen, sources[giver], columns)
        notes.append(f"{', '.join(columns)} from {giver}")
    return chosen, notes


def _giver(name: str, sources: Mapping[str, Fixes], column: str) -> str | None:
    """Name of the other source from which a column is taken; None if the chosen one keeps its own."""
    chosen = sources[name]
    own = np.isfinite(getattr(chosen, column)).sum()
    if own >= OWN_SHARE * chosen.has_position.sum() or (own and column not in INSTRUMENT_COLUMNS):
        return None
    fit = {}
    for other, fixes in sources.items():
        if other == name or fixes.mmsi is not None or (column not in INSTRUMENT_COLUMNS and fixes.has_position.any()):
            continue
        inside = fixes.between(chosen.time.min(), np.nextafter(chosen.time.max(), np.inf))
        fit[other] = np.isfinite(getattr(inside, column)).sum()
    best = max(fit, key=lambda each: fit[each], default=None)
    return best if best is not None and fit[best] > own else None


def _merged(chosen: Fixes, giver: Fixes, columns: Sequence[str]) -> Fixes:
    """Add columns of another source: in rows of the same time, else as new rows within the span of the record."""
    inside = giver.between(chosen.time.min() - _SAME_TIME, chosen.time.max() + _SAME_TIME)
    reporting = np.any([np.isfinite(getattr(inside, column)) for column in columns], axis=0)
    inside = inside.rows(reporting)
    at = np.clip(np.searchsorted(chosen.time, inside.time - _SAME_TIME), 0, len(chosen) - 1)
    meets = np.abs(chosen.time[at] - inside.time) <= _SAME_TIME
    given: dict[str, Any] = {column: getattr(inside, column) for column in columns}
    filled: dict[str, Any] = {column: np.full(len(chosen), np.nan) for column in columns}
    for column in columns:
        filled[column][at[meets][::-1]] = given[column][meets][::-1]  # reversed: the first of several at one time stays
    alone = int((~meets).sum())
    rest = Fixes(
        time=inside.time[~meets],
        latitude=np.full(alone, np.nan),
        longitude=np.full(alone, np.nan),
        **{column: values[~meets] for column, values in given.items()},
    )
    return _stacked(replace(chosen, **filled), rest).in_order()


def described(name: str, fixes: Fixes) -> str:
    """A short description of a source: name, number of fixes, rate and resolution."""
    found = quality(fixes)
    rate = f", {found.rate:.3g} Hz" if np.isfinite(found.rate) else ""
    fine = f", digits of {found.resolution:.2g} m" if np.isfinite(found.resolution) else ""
    return f"{name} ({found.fixes} fixes{rate}{fine})"
