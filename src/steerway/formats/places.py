"""Latitude and longitude as files give them, to the radians of `Fixes`."""

import math

import numpy as np

from steerway.core.angles import wrap


def on_earth(latitude: float, longitude: float) -> tuple[float, float]:
    """A place in rad, longitude in [−π, π); both NaN where the pair is not a place on earth."""
    if not (abs(latitude) <= 0.5 * math.pi and abs(longitude) <= 2.0 * math.pi):
        return math.nan, math.nan
    return latitude, wrap(longitude)


def places(latitude_deg, longitude_deg) -> tuple[np.ndarray, np.ndarray]:
    """Latitude and longitude (n,) in rad, longitude in [−π, π); both NaN where the pair is not a place on earth."""
    latitude, longitude = np.asarray(latitude_deg, dtype=float), np.asarray(longitude_deg, dtype=float)
    with np.errstate(invalid="ignore"):
        on_earth = (np.abs(latitude) <= 90.0) & (np.abs(longitude) <= 180.0)
    longitude = np.where(longitude == 180.0, -180.0, longitude)
    return np.radians(np.where(on_earth, latitude, np.nan)), np.radians(np.where(on_earth, longitude, np.nan))
