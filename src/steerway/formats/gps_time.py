"""GPS time: weeks and seconds since 6 January 1980, ahead of UTC by the leap seconds added since then."""

import datetime

import numpy as np

_EPOCH = 315964800.0  # Unix s
_WEEK = 604800.0
_LEAPS = (
    "1981-07-01 1982-07-01 1983-07-01 1985-07-01 1988-01-01 1990-01-01 1991-01-01 1992-07-01 1993-07-01 1994-07-01 "
    "1996-01-01 1997-07-01 1999-01-01 2006-01-01 2009-01-01 2012-07-01 2015-07-01 2017-01-01"
)
"""Dates from which one more leap second applies (IERS Bulletin C); none was added after the last one up to 2026."""
_SINCE = np.array([datetime.datetime.fromisoformat(f"{each}T00:00:00+00:00").timestamp() for each in _LEAPS.split()])


def utc_of_week(week: np.ndarray, seconds: np.ndarray) -> np.ndarray:
    """Unix s (n,) of GPS weeks (without rollover) and seconds of the week."""
    return utc_of_gps(_EPOCH + _WEEK * np.asarray(week, float) + np.asarray(seconds, float))


def utc_of_gps(time: np.ndarray) -> np.ndarray:
    """Unix s (n,) of times in the GPS scale, which are given as Unix s without leap seconds removed."""
    time = np.asarray(time, float)
    return time - np.searchsorted(_SINCE + np.arange(1, len(_SINCE) + 1), time, side="right")
