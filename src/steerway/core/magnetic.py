"""Magnetic variation from the World Magnetic Model, for compass headings in logs that do not record the variation.

The models of NOAA and BGS, WMM2010 to WMM2025, come with `pygeomag`. Their declination is accurate to about half a
degree outside the polar caps (the error model of the WMM reports). The boat's own magnetic deviation is not included.
"""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from steerway.core.arrays import Floats

if TYPE_CHECKING:
    from pygeomag import GeoMag

_EPOCHS = {2010: "WMM_2010", 2015: "WMM_2015v2", 2020: "WMM_2020", 2025: "WMM_2025"}
_EARLIEST, _LATEST = 2005.0, 2035.0  # years; outside, the nearest year is used: models are valid for a few years
_YEAR = 365.2425 * 86400.0
_CELL_DEG = 0.1  # the field turns by less than 0.1° over this distance outside the polar caps
_CELL_YEARS = 0.25


@cache
def _model(epoch: int) -> "GeoMag":
    from pygeomag import GeoMag

    return GeoMag(coefficients_file=f"wmm/{_EPOCHS[epoch]}.COF")


def model_of(time: float) -> int:
    """The epoch (year) of the model for a Unix time; the newest one if the time is unknown."""
    year = 1970.0 + time / _YEAR
    return max((epoch for epoch in _EPOCHS if epoch <= year), default=min(_EPOCHS)) if year == year else max(_EPOCHS)


def variation(latitude: ArrayLike, longitude: ArrayLike, time: ArrayLike) -> Floats:
    """Magnetic variation (declination), east positive, rad: true = magnetic + variation.

    Shapes: all (n,), latitude and longitude in rad, Unix time (NaN: the newest model's first year). The model runs once
    per cell of 0.1° and a quarter of a year. NaN where the position is unknown.
    """
    latitude, longitude, time = np.broadcast_arrays(*np.atleast_1d(latitude, longitude, time))
    years = 1970.0 + np.where(np.isnan(time), (max(_EPOCHS) - 1970.0) * _YEAR, time) / _YEAR
    years = np.clip(years, _EARLIEST, _LATEST)
    cells = np.column_stack(
        [
            np.round(np.degrees(latitude) / _CELL_DEG),
            np.round(np.degrees(longitude) / _CELL_DEG),
            np.round(years / _CELL_YEARS),
        ]
    )
    known = np.isfinite(cells).all(axis=1)
    result = np.full(len(cells), np.nan)
    distinct, cell_of = np.unique(cells[known], axis=0, return_inverse=True)
    values = [_in_cell(*cell) for cell in distinct.tolist()]
    result[known] = np.array(values)[cell_of.reshape(-1)] if values else np.nan
    return result


def _in_cell(north: float, east: float, quarter: float) -> float:
    year = quarter * _CELL_YEARS
    model = _model(model_of((year - 1970.0) * _YEAR))
    field = model.calculate(north * _CELL_DEG, east * _CELL_DEG, 0.0, year, allow_date_outside_lifespan=True)
    return np.radians(field.d)
