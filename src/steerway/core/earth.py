"""The WGS-84 ellipsoid: radii of curvature and the tangent plane around a point.

Constants: NIMA TR 8350.2, third edition, table 3.1.
"""

import math

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats
from steerway.core.compiled import kernel
from steerway.core.interpreted import part_of_kernels

SEMI_MAJOR_AXIS = 6378137.0
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)

NAUTICAL_MILE = 1852.0
KNOT = NAUTICAL_MILE / 3600.0
STANDARD_GRAVITY = 9.80665
"""m/s², by definition (3rd CGPM, 1901)."""


@part_of_kernels
def radii(latitude: float) -> tuple[float, float]:
    """Radii of curvature (meridian R_M, prime vertical R_N), m; P0 (33) and the corrected (34). Latitude in rad."""
    w = 1.0 - ECCENTRICITY_SQUARED * math.sin(latitude) ** 2
    prime_vertical = SEMI_MAJOR_AXIS / math.sqrt(w)
    return prime_vertical * (1.0 - ECCENTRICITY_SQUARED) / w, prime_vertical


@kernel
def displacement(latitude: float, longitude: float, latitude_0: float, longitude_0: float) -> tuple[float, float]:
    """North and east (m) of a point in the tangent plane at (latitude_0, longitude_0). All angles in rad.

    First order in the distance: exact to the mm within 100 m, to 0.1 m within 500 m at 80° N. The filter moves the
    origin of its plane at every fix, so distances in it are those sailed between two fixes.
    """
    meridian, prime_vertical = radii(latitude_0)
    north = (latitude - latitude_0) * meridian
    east = wrap(longitude - longitude_0) * prime_vertical * math.cos(latitude_0)
    return north, east


@kernel
def displaced(latitude_0: float, longitude_0: float, north: float, east: float) -> tuple[float, float]:
    """Latitude and longitude (rad, longitude in [−π, π)) of the point north and east (m) of another."""
    meridian, prime_vertical = radii(latitude_0)
    latitude = latitude_0 + north / meridian
    return latitude, wrap(longitude_0 + east / (prime_vertical * math.cos(latitude_0)))


@kernel
def displaced_all(latitude_0: float, longitude_0: float, north: Floats, east: Floats) -> tuple[Floats, Floats]:
    """`displaced` for arrays (n,) of north and east from one point."""
    latitude, longitude = np.empty(len(north)), np.empty(len(north))
    for k in range(len(north)):
        latitude[k], longitude[k] = displaced(latitude_0, longitude_0, north[k], east[k])
    return latitude, longitude
