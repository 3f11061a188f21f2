"""Parse numbers, and convert latitudes and longitudes in degrees to the radians of `Fixes`."""

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.angles import wrap
from steerway.core.interpreted import without_compiling

if TYPE_CHECKING:
    import polars as pl

_wrap = without_compiling(wrap)  # compiling takes longer than reading most logs
_MARKS = "[°º'′’\"″”]"
_NUMBER = r"([0-9]{1,2}(?:\.[0-9]*)?)"
_DEGREES = rf"^([NSEW])?\s*(-)?([0-9]{{1,3}}(?:\.[0-9]*)?)(?:\s+{_NUMBER})?(?:\s+{_NUMBER})?\s*([NSEW])?$"
"""Degrees, minutes and seconds, of which the last can have decimals, with a sign or the letter of a hemisphere."""


def number(text: str | None) -> float:
    """The finite number in a text; NaN if the text is anything else."""
    try:
        found = float(text or "nan")
    except ValueError:
        return math.nan
    return found if math.isfinite(found) else math.nan


def numbers(texts: Iterable[str | None]) -> np.ndarray:
    """The numbers (n,) in texts, NaN for other texts; see `number`."""
    return np.array([number(text) for text in texts], np.float64)


def on_earth(latitude: float, longitude: float) -> tuple[float, float]:
    """A position in rad with longitude in [−π, π); both are NaN if it is not on earth. Arguments in rad."""
    if not (abs(latitude) <= 0.5 * math.pi and abs(longitude) <= 2.0 * math.pi):
        return math.nan, math.nan
    return latitude, _wrap(longitude)


def places(latitude_deg: ArrayLike, longitude_deg: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Latitude and longitude (n,) in rad, longitude in [−π, π); both are NaN where the position is not on earth."""
    latitude, longitude = np.asarray(latitude_deg, dtype=float), np.asarray(longitude_deg, dtype=float)
    with np.errstate(invalid="ignore"):
        on_earth = (np.abs(latitude) <= 90.0) & (np.abs(longitude) <= 180.0)
    longitude = np.where(longitude == 180.0, -180.0, longitude)
    return np.radians(np.where(on_earth, latitude, np.nan)), np.radians(np.where(on_earth, longitude, np.nan))


def degrees(texts: "pl.Series", hemispheres: str) -> np.ndarray:
    """Degrees (n,) from texts such as 54°18.5'N, S 54 18 30 or 54.3N; NaN for other texts.

    hemispheres: "NS" or "EW", the letter of positive degrees first.
    """
    import polars as pl  # here, because live runs do not need it

    plain = texts.str.to_uppercase().str.replace_all(_MARKS, " ").str.strip_chars()
    groups = plain.str.extract_groups(_DEGREES).struct.unnest()
    whole, minutes, seconds = (groups[name].cast(pl.Float64).to_numpy() for name in ("3", "4", "5"))
    letter = (groups["1"].fill_null("") + groups["2"].fill_null("") + groups["6"].fill_null("")).to_numpy()
    size = whole + np.nan_to_num(minutes) / 60.0 + np.nan_to_num(seconds) / 3600.0
    with np.errstate(invalid="ignore"):
        broken = (whole % 1.0 > 0.0) & np.isfinite(minutes) | (minutes % 1.0 > 0.0) & np.isfinite(seconds)
        wrong = broken | (minutes >= 60.0) | (seconds >= 60.0) | ~np.isin(letter, ("", "-", *hemispheres))
    return np.where(wrong, np.nan, np.where(np.isin(letter, ("-", hemispheres[1])), -size, size))
