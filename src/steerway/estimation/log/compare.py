"""Comparison with the receiver's own SOG and COG, which are filtered, late and frozen at rest: not truth."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import NamedTuple, TypeVar

import numpy as np

from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats, Ints
from steerway.core.errors import InputError
from steerway.core.records import Fixes, Motion
from steerway.core.statistics import DEVIATION_OF_MEDIAN

Table = TypeVar("Table", Fixes, Motion)

STANDSTILL = 0.3
"""SOG of the receiver, m/s, below which it counts as at rest: the steerageway of the profiles."""
LEAST_SPEED = 1.0
"""SOG of the receiver, m/s, above which rows are compared. At low speed receivers filter COG harder or hold it (u-blox
UBX-18010854, UBX-CFG-ODO `cogMaxSpeed`)."""
SWING = 4.0
"""Time, s, of averaging velocity to remove the swing of a rolling antenna: craft under 15 m roll in 2 to 4 s."""
LONGEST_LAG = 5.0
"""Largest lag (s, either way) that is searched: receivers of recorded logs are late by 0.15 to 4 s."""
_LAGS = np.round(np.arange(-LONGEST_LAG, LONGEST_LAG + 0.05, 0.1), 1)
_COVERED = 0.9
"""Least number of rows of a lag, as a share of the largest number of any lag: a shift loses rows at the ends."""
_GROSS = 10.0
"""In the search for a lag, differences are clipped at this multiple of their median, because position or speed may
jump. In a recorded log, 20 of 20,000 rows jumped by 25 m/s and more, and moved the lag by 3 s."""
_NEAR = 2.0
"""Longest time, s, between a row and the estimate that it is compared with: two rows at 1 Hz."""


@dataclass(frozen=True)
class Agreement:
    """Differences, estimate minus receiver, without and with the lag that makes them smallest; m/s, rad and s.

    A lag is positive if the receiver is later than the estimate. Robust: 1.4826 times the median absolute deviation.
    """

    least_speed: float  # m/s of the receiver's SOG above which rows are compared
    fastest: float  # m/s, the receiver's largest SOG; NaN where it reports none
    compared: int  # rows of the receiver above `least_speed` with an estimate within 2 s
    sog_rms: float
    sog_robust: float
    sog_lag: float
    sog_rms_aligned: float
    cog_rms: float
    cog_robust: float
    cog_lag: float
    cog_rms_aligned: float
    standstill: int  # rows of the receiver below `STANDSTILL`
    standstill_sog_median: float  # of the estimate
    standstill_receiver_sog_median: float
    standstill_undefined: float  # share of the standstill rows in which the estimate has no course

    def as_dict(self) -> dict[str, float]:
        """The numbers by name and unit; angles in degrees, shares in per cent."""
        return {_with_unit(name): _in_units(name, value) for name, value in asdict(self).items()}

    def sentences(self) -> list[tuple[str, str]]:
        """The agreement as (what, value) pairs of text."""
        return [("rows compared", self._compared()), *self._under_way(), *self._at_rest()]

    def _compared(self) -> str:
        limit = f"receiver's SOG above {self.least_speed:g} m/s"
        if self.compared:
            return f"{self.compared} with the {limit}"
        reported = f"largest {self.fastest:.2f} m/s" if math.isfinite(self.fastest) else "none is reported"
        return f"none with the {limit}: {reported}"

    def _under_way(self) -> list[tuple[str, str]]:
        d, found = self.as_dict(), []
        for name, unit, digits in (("sog", "m/s", 3), ("cog", "°", 2)):
            rms, robust, aligned, lag = (
                d[f"{name}_{key}"]
                for key in (f"rms_{_UNIT[name]}", f"robust_{_UNIT[name]}", f"rms_aligned_{_UNIT[name]}", "lag_s")
            )
            if math.isfinite(rms):
                space = "" if unit == "°" else " "
                found += [
                    (name.upper(), f"{rms:.{digits}f}{space}{unit} RMS, {robust:.{digits}f}{space}{unit} robust"),
                    ("  aligned", f"{aligned:.{digits}f}{space}{unit} RMS; the receiver {_late(lag)}"),
                ]
        return found

    def _at_rest(self) -> list[tuple[str, str]]:
        if not self.standstill:
            return []
        return [
            ("at standstill", f"{self.standstill} rows with the receiver's SOG below {STANDSTILL} m/s"),
            (
                "  median SOG",
                f"estimate {self.standstill_sog_median:.3f}, receiver {self.standstill_receiver_sog_median:.3f} m/s",
            ),
            ("  course undefined", f"{100.0 * self.standstill_undefined:.1f} % of them"),
        ]


_UNIT = {"sog": "mps", "cog": "deg"}


def _with_unit(name: str) -> str:
    if name.endswith("lag"):
        return f"{name}_s"
    if name.startswith("cog"):
        return f"{name}_deg"
    if "sog" in name or name in ("least_speed", "fastest"):
        return f"{name}_mps"
    return {"standstill_undefined": "standstill_undefined_pct"}.get(name, name)


def _in_units(name: str, value: float) -> float:
    if name == "standstill_undefined":
        return 100.0 * value
    return math.degrees(value) if name.startswith("cog") and not name.endswith("lag") else value


def _late(lag: float) -> str:
    return f"{'lags' if lag >= 0.0 else 'leads'} the estimate by {abs(lag):.1f} s"


def compare(fixes: Fixes, motion: Motion, least_speed: float = LEAST_SPEED, swing: float = 0.0) -> Agreement:
    """Agreement of an estimate with the SOG and COG in the fixes it was made from (all vessels together).

    Rows with a SOG of the receiver above `least_speed` (m/s) are compared.

    swing: s over which both velocities are averaged first; 0 for none. Use `SWING` if the estimate is the hull's motion
        under a rolling antenna, because the receiver's velocity is the antenna's.
    """
    if swing > 0.0:
        fixes, motion = _averaged(fixes, swing), _averaged(motion, swing)
    pairs = [
        _paired(theirs, estimated, least_speed)
        for (_, theirs), (_, estimated) in zip(fixes.tracks(), motion.tracks(), strict=True)
    ]
    reported = fixes.sog[np.isfinite(fixes.sog)]
    sog, cog, rests = zip(*pairs, strict=True)
    compared = sum(len(each.now) for each in sog)
    rest = np.concatenate(rests, axis=1)
    sog_rms, sog_robust, sog_lag, sog_aligned = _figures(sog)
    cog_rms, cog_robust, cog_lag, cog_aligned = _figures(cog)
    return Agreement(
        least_speed=least_speed,
        fastest=float(reported.max()) if len(reported) else math.nan,
        compared=compared,
        sog_rms=sog_rms,
        sog_robust=sog_robust,
        sog_lag=sog_lag,
        sog_rms_aligned=sog_aligned,
        cog_rms=cog_rms,
        cog_robust=cog_robust,
        cog_lag=cog_lag,
        cog_rms_aligned=cog_aligned,
        standstill=rest.shape[1],
        standstill_sog_median=_median(rest[0]),
        standstill_receiver_sog_median=_median(rest[1]),
        standstill_undefined=float(np.isnan(rest[2]).mean()) if rest.shape[1] else math.nan,
    )


def _averaged(table: Table, span: float) -> Table:
    """Fixes or Motion with the velocity averaged over `span` s around every row that has SOG and COG."""
    columns = [table.time, table.sog, table.cog, table.time if table.mmsi is None else table.mmsi]
    if len(shapes := {np.shape(each) for each in columns}) > 1:
        raise InputError(f"columns of {type(table).__name__} have the shapes {sorted(shapes)}, expected one")
    sog, cog = table.sog.copy(), table.cog.copy()
    whole = np.ones(len(sog), bool)
    for vessel in [whole] if table.mmsi is None else [table.mmsi == each for each in np.unique(table.mmsi)]:
        known = np.flatnonzero(vessel & np.isfinite(sog) & np.isfinite(cog))
        time = table.time[known]
        total = np.append(0.0, np.cumsum(sog[known] * np.exp(1j * cog[known])))
        begin = np.searchsorted(time, time - 0.5 * span)
        end = np.searchsorted(time, time + 0.5 * span, side="right")
        mean = (total[end] - total[begin]) / (end - begin)
        sog[known], cog[known] = np.abs(mean), np.angle(mean)
    return replace(table, sog=sog, cog=cog)


class _Differences(NamedTuple):
    """For one vessel, at every lag (l,): number of known differences, sum of squares, sum of clipped squares; and the
    differences at lag 0 (k,)."""

    counts: Floats
    squares: Floats
    usual: Floats
    now: Floats


def _paired(fixes: Fixes, motion: Motion, least_speed: float) -> tuple[_Differences, _Differences, Floats]:
    """Differences of SOG and of COG; and (3, r) of rows at rest: estimated SOG, the receiver's SOG, estimated COG."""
    nearest = _nearest(motion.time, fixes.time)
    near = np.abs(motion.time[nearest] - fixes.time) < _NEAR if len(motion) else np.zeros(len(fixes), bool)
    fast = near & (fixes.sog > least_speed)
    sog = _differences(motion.time, motion.sog, fixes.time[fast], fixes.sog[fast])
    course = fast & np.isfinite(fixes.cog)
    known = np.isfinite(motion.cog)
    unwrapped = np.unwrap(motion.cog[known])
    cog = _differences(motion.time[known], unwrapped, fixes.time[course], fixes.cog[course], is_angle=True)
    slow = near & (fixes.sog < STANDSTILL)
    rest = np.stack([motion.sog[nearest[slow]], fixes.sog[slow], motion.cog[nearest[slow]]])
    return sog, cog, rest


def _nearest(time: Floats, moments: Floats) -> Ints:
    if not len(time):
        return np.zeros(len(moments), int)
    after = np.clip(np.searchsorted(time, moments), 1, max(len(time) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(time) - 1)
    return np.where(moments - time[before] <= time[after] - moments, before, after)


def _differences(
    time: Floats, values: Floats, moments: Floats, reported: Floats, is_angle: bool = False
) -> _Differences:
    """Differences of `values` at `moments` − lag from `reported`, for every lag; one lag at a time, to save memory."""
    counts, squares, usual = np.zeros((3, len(_LAGS)))

    def at(lag: float) -> Floats:
        difference = np.interp(moments - lag, time, values, left=np.nan, right=np.nan) - reported
        return wrap_array(difference) if is_angle else difference

    if not len(time):
        return _Differences(counts, squares, usual, np.full(len(moments), np.nan))
    now = at(0.0)
    gross = (_GROSS * _median(np.abs(now))) ** 2 or math.inf
    for k, lag in enumerate(_LAGS):
        square = at(lag) ** 2
        square = square[np.isfinite(square)]
        counts[k], squares[k], usual[k] = len(square), square.sum(), np.fmin(square, gross).sum()
    return _Differences(counts, squares, usual, now)


def _figures(vessels: Sequence[_Differences]) -> tuple[float, float, float, float]:
    """RMS and robust deviation without a lag, the best lag, and the RMS with it."""
    now = np.concatenate([each.now for each in vessels])
    if not len(now):
        return math.nan, math.nan, math.nan, math.nan
    counts = np.sum([each.counts for each in vessels], axis=0)
    rms, usual = (
        np.sqrt(sum(each) / np.maximum(counts, 1))
        for each in ([of.squares for of in vessels], [of.usual for of in vessels])
    )
    usual[counts < _COVERED * counts.max()] = np.inf
    best = int(np.argmin(usual))
    return (
        float(rms[len(_LAGS) // 2]),
        DEVIATION_OF_MEDIAN * _median(np.abs(now - _median(now))),
        float(_LAGS[best]),
        float(rms[best]),
    )


def _median(values: Floats) -> float:
    values = values[np.isfinite(values)]
    return float(np.median(values)) if len(values) else math.nan
