"""A record in a plane: the way from fix to fix laid out flat, and back.

The directions of the plane are carried along the track without a turn (parallel transport), as those of a
wander-azimuth frame are (P. D. Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd
ed., 2013, §5.3.4), so that neither an ocean nor a pole nor the antimeridian bends a straight course.
"""

from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats
from steerway.core.earth import ECCENTRICITY_SQUARED, SEMI_MAJOR_AXIS

_STARTS, _ENDS = slice(None, -1), slice(1, None)


class Plane(NamedTuple):
    """Places of fixes (n,): rad, then m in the plane, and the direction of its first axis there (rad east of north)."""

    latitude: Floats
    longitude: Floats
    first: Floats
    second: Floats
    azimuth: Floats


def steps_between(latitude: Floats, longitude: Floats) -> tuple[Floats, Floats, Floats]:
    """North and east (m) of every fix (n ≥ 1, rad) from the one before, and the convergence of meridians (rad).

    Each (n − 1,). The chord in the tangent planes of both ends: the same there and back.
    """
    axes = _axes(latitude, longitude)
    curvature = SEMI_MAJOR_AXIS / np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(latitude) ** 2)
    place = curvature * axes[2]
    place[2] *= 1.0 - ECCENTRICITY_SQUARED
    chord = np.diff(place)
    (north, east), (north_there, east_there) = ((axes[:2, :, ends] * chord).sum(axis=1) for ends in (_STARTS, _ENDS))
    turn = 0.5 * wrap_array(np.diff(longitude))
    middle, apart = 0.5 * (latitude[1:] + latitude[:-1]), 0.5 * np.diff(latitude)
    convergence = 2.0 * np.arctan2(np.sin(turn) * np.sin(middle), np.cos(turn) * np.cos(apart))
    c, s = np.cos(convergence), np.sin(convergence)
    north = 0.5 * (north + c * north_there + s * east_there)
    east = 0.5 * (east + c * east_there - s * north_there)
    return north, east, convergence


def laid_out(latitude: Floats, longitude: Floats) -> Plane:
    """The plane of a track of fixes (n,), rad, from its first fix, where its axes point north and east."""
    north, east, convergence = steps_between(latitude, longitude)
    azimuth = np.concatenate([[0.0], np.cumsum(convergence)])
    c, s = np.cos(azimuth[:-1]), np.sin(azimuth[:-1])
    first = np.concatenate([[0.0], np.cumsum(c * north + s * east)])
    second = np.concatenate([[0.0], np.cumsum(c * east - s * north)])
    return Plane(latitude, longitude, first, second, azimuth)


def placed(plane: Plane, rows, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Latitude and longitude (rad) of points of the plane, each (k,) near the fix of its number in `rows`."""
    azimuth = plane.azimuth[rows]
    ahead, aside = first - plane.first[rows], second - plane.second[rows]
    north = np.cos(azimuth) * ahead - np.sin(azimuth) * aside
    east = np.sin(azimuth) * ahead + np.cos(azimuth) * aside
    w = 1.0 - ECCENTRICITY_SQUARED * np.sin(plane.latitude[rows]) ** 2
    prime_vertical = SEMI_MAJOR_AXIS / np.sqrt(w)
    meridian = prime_vertical * (1.0 - ECCENTRICITY_SQUARED) / w
    to_north, to_east, up = _axes(plane.latitude[rows], plane.longitude[rows])
    tilt = north / meridian * to_north + east / prime_vertical * to_east
    angle = np.sqrt((tilt**2).sum(axis=0))
    x, y, z = np.cos(angle) * up + np.sinc(angle / np.pi) * tilt
    return np.arctan2(z, np.hypot(x, y)), wrap_array(np.arctan2(y, x))


def _axes(latitude, longitude):
    """Unit vectors north, east and up (3, 3, n) on the axes of the Earth."""
    c, s, a, b = np.cos(latitude), np.sin(latitude), np.cos(longitude), np.sin(longitude)
    zero = np.zeros_like(c)
    return np.array([[-s * a, -s * b, c], [-b, a, zero], [c * a, c * b, s]])
