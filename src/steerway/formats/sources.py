"""From the sources of several logs to one record: joined across logs, the best chosen, others added."""

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
_OVERLAP = 2.0  # s that the end of one log and the beginning of the next may share
_FINE = 0.1  # m: a finer last digit is no better, the receiver's own noise is larger
_FAST = 20.0  # Hz
_SAMPLE = 500
OWN_SHARE = 0.5
"""Share of its fixes from which on the source of the positions gives an instrument's column itself."""


@dataclass(frozen=True)
class Quality:
    """Quality of the positions of a source."""

    rows: int
    fixes: int
    start: float  # of the rows, Unix s; NaN without rows
    stop: float
    rate: float  # Hz, from the median interval of fixes; NaN below two fixes
    gaps: int  # as of `core.gaps`
    longest_gap: float  # s, 0 for none
    resolution: float  # m: the last decimal of the positions; NaN when it is unknown
    roughness: float  # m: median distance of a fix from the line between its neighbours; NaN below three fixes
    says: tuple[str, ...]  # other columns with values
    vessels: int  # 0 for the own boat's log
    score: float  # rate × continuity over the whole record / (resolution + roughness); 0 without positions


def quality(fixes: Fixes, span: float | None = None) -> Quality:
    """The quality of a source, its continuity taken over `span` (s) or, without one, over its own length."""
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
    with_speed = np.isfinite(placed.sog).mean()  # of equal sources, the one that also reports speed
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
    """Positive intervals between fixes, vessel by vessel."""
    each = [np.diff(np.unique(track.time)) for _, track in placed.tracks()]
    intervals = np.concatenate(each) if each else np.empty(0)
    return intervals[intervals > _SAME_TIME]


def _resolution(placed: Fixes) -> float:
    """The last decimal in which the positions are written, of minutes or of degrees, m; NaN when there is none."""
    some = placed.rows(slice(None, None, max(1, len(placed) // _SAMPLE)))
    meridian, _ = radii(float(placed.latitude[0]))
    return last_digit(np.concatenate([some.latitude, some.longitude])) * meridian


def _roughness(placed: Fixes, usual: float) -> float:
    """Median distance (m) of a fix from where its neighbours put it: noise, uneven time stamps and late fixes."""
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
    """The sources of several logs, in time order each.

    One name in logs that follow one another, or in copies of one log, is one source. In logs of the same hours that
    differ it is two devices, named also by their log.
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
    """Whether parts of one name, sorted by their beginning, come from one device."""
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
    """(n,) bool: the rows that an earlier log also has, with the same values."""
    known = set(_keys(earlier).tolist())
    return np.array([key in known for key in _keys(fixes).tolist()], bool)


def joined(parts: Sequence[Fixes]) -> Fixes:
    """The rows of several parts in time order, without those that an earlier part has."""
    whole = parts[0]
    for part in parts[1:]:
        shares = len(part) and len(whole) and part.time.min() <= whole.time.max()
        fresh = part.rows(~_in_earlier(part, whole)) if shares else part
        whole = _stacked(whole, fresh)
    return whole.in_order()


def _stacked(first: Fixes, second: Fixes) -> Fixes:
    """One table under the other. Rows of a log with vessels and of one without never meet here."""
    names = first.columns() if first.mmsi is None or second.mmsi is not None else Fixes(*[np.empty(0)] * 3).columns()
    whole: dict[str, Any] = {name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in names}
    return replace(first, **whole)


def rank(name: str, wanted: Sequence[str]) -> int | None:
    """The place of a source among the wanted names, None when it is not wanted; without any, 0.

    A name also means the sources that it begins ("GP" for "GP RMC" and "GP in tcp://…"); case does not matter.
    """
    folded = name.casefold()
    begun = (k for k, each in enumerate(wanted) if f"{folded} ".startswith(f"{each.casefold()} "))
    return next(begun, None) if wanted else 0


def choose(sources: Mapping[str, Fixes], wanted: str | None = None) -> str:
    """The source whose positions are taken: the wanted one, else the one of the highest score; own boats before AIS.

    A wanted name also means the sources that it begins, see `rank`, unless one has just this name. Raises InputError
    when there is none such, or it has no positions.
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
    """The chosen source with measurements of other sources of the own boat, as rows without position between its fixes.

    One source a column, so that two compasses are never mixed: the chosen one when it reports the column at half of
    its fixes or more, else the one that reports it most often. SOG and COG come from another source only if it has no
    positions itself and the chosen source reports neither.
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
    """The other source that gives a column, or None."""
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
    """Columns of another source: into the rows of the same time, else as rows of their own within the record."""
    inside = giver.between(chosen.time.min() - _SAME_TIME, chosen.time.max() + _SAME_TIME)
    reporting = np.any([np.isfinite(getattr(inside, column)) for column in columns], axis=0)
    inside = inside.rows(reporting)
    at = np.clip(np.searchsorted(chosen.time, inside.time - _SAME_TIME), 0, len(chosen) - 1)
    meets = np.abs(chosen.time[at] - inside.time) <= _SAME_TIME
    given: dict[str, Any] = {column: getattr(inside, column) for column in columns}
    filled: dict[str, Any] = {column: np.full(len(chosen), np.nan) for column in columns}
    for column in columns:
        filled[column][at[meets][::-1]] = given[column][meets][::-1]  # of several at one time, the first
    alone = int((~meets).sum())
    rest = Fixes(
        time=inside.time[~meets],
        latitude=np.full(alone, np.nan),
        longitude=np.full(alone, np.nan),
        **{column: values[~meets] for column, values in given.items()},
    )
    return _stacked(replace(chosen, **filled), rest).in_order()


def described(name: str, fixes: Fixes) -> str:
    """A source in a few words: its name, number of fixes, rate and resolution."""
    found = quality(fixes)
    rate = f", {found.rate:.3g} Hz" if np.isfinite(found.rate) else ""
    fine = f", digits of {found.resolution:.2g} m" if np.isfinite(found.resolution) else ""
    return f"{name} ({found.fixes} fixes{rate}{fine})"
