"""Latitude and longitude as files give them, to the radians of `Fixes`."""

import numpy as np


def places(latitude_deg, longitude_deg) -> tuple[np.ndarray, np.ndarray]:
    """Latitude and longitude (n,) in rad, longitude in [−π, π); both NaN where the pair is not a place on earth."""
    latitude, longitude = np.asarray(latitude_deg, dtype=float), np.asarray(longitude_deg, dtype=float)
    with np.errstate(invalid="ignore"):
        on_earth = (np.abs(latitude) <= 90.0) & (np.abs(longitude) <= 180.0)
    longitude = np.where(longitude == 180.0, -180.0, longitude)
    return np.radians(np.where(on_earth, latitude, np.nan)), np.radians(np.where(on_earth, longitude, np.nan))
