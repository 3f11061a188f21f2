"""A record in a plane: displacements from fix to fix laid out flat, and the way back to latitude and longitude.

The directions of the plane are carried along the track without a turn (parallel transport), as those of a
wander-azimuth frame are (P. D. Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd
ed., 2013, §5.3.4), so that neither an ocean nor a pole nor the antimeridian bends a straight course.
"""

import math
from typing import NamedTuple

import numpy as np

from steerway.core.angles import wrap
from steerway.core.arrays import Floats, Ints
from steerway.core.compiled import kernel, lean_kernel
from steerway.core.earth import ECCENTRICITY_SQUARED, SEMI_MAJOR_AXIS

LONG_STEP = 50e3
"""Least length, m, of a long step between fixes. A fix that returns near the place before a long step is placed from
there. Placed by way of an outlier in another ocean, it would be displaced by metres, since the angles of a triangle on
the Earth do not add up to π. An estimate farther than this from its fix is placed by the fix before the step: over 50
km the plane errs by 3 m, over an ocean by a degree."""


class Plane(NamedTuple):
    """Positions of fixes (n,): rad, then m in the plane, and azimuth of its first axis there (rad east of north).

    home: index of the fix before the last LONG_STEP, not counting fixes between two of them; 0 before any.
    """

    latitude: Floats
    longitude: Floats
    first: Floats
    second: Floats
    azimuth: Floats
    home: Ints


@lean_kernel
def step_between(
    latitude: float, longitude: float, latitude_there: float, longitude_there: float
) -> tuple[float, float, float]:
    """North and east (m) of a fix from the one before, and the convergence of meridians (rad).

    The step is the mean of the chord in the tangent planes of both ends: the step back has the same length.
    """
    if latitude == latitude_there and longitude == longitude_there:
        return 0.0, 0.0, 0.0  # exactly 0, which fused multiply–add operations would miss
    x, y, z = _place(latitude, longitude)
    x_there, y_there, z_there = _place(latitude_there, longitude_there)
    x, y, z = x_there - x, y_there - y, z_there - z
    north, east = _in_tangent_plane(latitude, longitude, x, y, z)
    north_there, east_there = _in_tangent_plane(latitude_there, longitude_there, x, y, z)
    turn = 0.5 * wrap(longitude_there - longitude)
    middle, apart = 0.5 * (latitude + latitude_there), 0.5 * (latitude_there - latitude)
    convergence = 2.0 * math.atan2(math.sin(turn) * math.sin(middle), math.cos(turn) * math.cos(apart))
    c, s = math.cos(convergence), math.sin(convergence)
    north = 0.5 * (north + c * north_there + s * east_there)
    east = 0.5 * (east + c * east_there - s * north_there)
    return north, east, convergence


@kernel
def steps_between(latitude: Floats, longitude: Floats) -> tuple[Floats, Floats, Floats]:
    """`step_between` of every fix (n ≥ 1, rad) from the one before: (n − 1,) each."""
    n = len(latitude) - 1
    north, east, convergence = np.empty(n), np.empty(n), np.empty(n)
    for k in range(n):
        north[k], east[k], convergence[k] = step_between(latitude[k], longitude[k], latitude[k + 1], longitude[k + 1])
    return north, east, convergence


@lean_kernel
def step_to(
    place: tuple[float, float], home: tuple[float, float], there: tuple[float, float]
) -> tuple[float, float, float, bool, bool]:
    """`step_between` the place of the last fix and a fix `there`; from home, if only the place is a LONG_STEP away.

    Positions are latitude and longitude, rad. Returns also whether the step from the place is long, and whether home is
    used.
    """
    north, east, convergence = step_between(*place, *there)
    if math.hypot(north, east) <= LONG_STEP:
        return north, east, convergence, False, False
    back_north, back_east, back = step_between(*home, *there)
    if math.hypot(back_north, back_east) <= LONG_STEP:
        return back_north, back_east, back, True, True
    return north, east, convergence, True, False


def laid_out(latitude: Floats, longitude: Floats) -> Plane:
    """The plane of a track of fixes (n,), rad. Its origin is the first fix, where its axes point north and east."""
    north, east, convergence, begin, home = _steps(latitude, longitude)
    azimuth = _summed(convergence, begin)
    c, s = np.cos(azimuth[begin]), np.sin(azimuth[begin])
    first, second = _summed(c * north + s * east, begin), _summed(c * east - s * north, begin)
    return Plane(latitude, longitude, first, second, azimuth, home)


@kernel
def _steps(latitude: Floats, longitude: Floats) -> tuple[Floats, Floats, Floats, Ints, Ints]:
    """`step_to` every fix (n ≥ 1, rad) from the one before: north, east, convergence, and the index of the fix at which
    it begins (n − 1,); and the index of every fix's home (n,)."""
    n = len(latitude)
    north, east, convergence = np.empty(n - 1), np.empty(n - 1), np.empty(n - 1)
    begin, home, astray = np.arange(n - 1), np.zeros(n, np.int64), False
    for k in range(n - 1):
        at = home[k]
        place, its_home = (latitude[k], longitude[k]), (latitude[at], longitude[at])
        there = latitude[k + 1], longitude[k + 1]
        north[k], east[k], convergence[k], is_long, from_home = step_to(place, its_home, there)
        begin[k] = at if from_home else k
        home[k + 1] = k if is_long and not astray else at
        astray = is_long and not from_home
    return north, east, convergence, begin, home


@kernel
def _summed(steps: Floats, begin: Ints) -> Floats:
    """(n,) sums of steps (n − 1,) from the fixes at which they begin."""
    total = np.zeros(len(steps) + 1)
    for k in range(len(steps)):
        total[k + 1] = total[begin[k]] + steps[k]
    return total


@kernel
def placed(plane: Plane, rows: Ints, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Latitude and longitude (rad) of points of the plane (k,), each near the fix with its index in `rows` (k,)."""
    n = len(rows)
    latitude, longitude = np.empty(n), np.empty(n)
    for k in range(n):
        i = rows[k]
        latitude[k], longitude[k] = place_near(
            plane.latitude[i],
            plane.longitude[i],
            plane.azimuth[i],
            first[k] - plane.first[i],
            second[k] - plane.second[i],
        )
    return latitude, longitude


@lean_kernel
def place_near(latitude: float, longitude: float, azimuth: float, ahead: float, aside: float) -> tuple[float, float]:
    """Latitude and longitude (rad) of the point `ahead` and `aside` (m) of a place along the plane's axes there."""
    north = math.cos(azimuth) * ahead - math.sin(azimuth) * aside
    east = math.sin(azimuth) * ahead + math.cos(azimuth) * aside
    c, s, a, b = math.cos(latitude), math.sin(latitude), math.cos(longitude), math.sin(longitude)
    w = 1.0 - ECCENTRICITY_SQUARED * s * s
    prime_vertical = SEMI_MAJOR_AXIS / math.sqrt(w)
    meridian = prime_vertical * (1.0 - ECCENTRICITY_SQUARED) / w
    v_n, v_e = north / meridian, east / prime_vertical
    angle = math.hypot(v_n, v_e)
    share = math.sin(angle) / angle if angle > 0.0 else 1.0
    up = math.cos(angle)
    x = up * c * a + share * (-s * a * v_n - b * v_e)
    y = up * c * b + share * (-s * b * v_n + a * v_e)
    z = up * s + share * c * v_n
    return math.atan2(z, math.hypot(x, y)), wrap(math.atan2(y, x))


def covariance_from_north(covariance: Floats, azimuth: float) -> Floats:
    """Covariance (2, 2) north and east from that along the axes of a plane, the first one at this azimuth (rad)."""
    c, s = math.cos(azimuth), math.sin(azimuth)
    turn = np.array([[c, -s], [s, c]])
    return turn @ covariance @ turn.T


@lean_kernel
def _place(latitude: float, longitude: float) -> tuple[float, float, float]:
    """Earth-centred coordinates (m) of a place on the ellipsoid."""
    c, s = math.cos(latitude), math.sin(latitude)
    curvature = SEMI_MAJOR_AXIS / math.sqrt(1.0 - ECCENTRICITY_SQUARED * s * s)
    return (
        curvature * c * math.cos(longitude),
        curvature * c * math.sin(longitude),
        (1.0 - ECCENTRICITY_SQUARED) * curvature * s,
    )


@lean_kernel
def _in_tangent_plane(latitude: float, longitude: float, x: float, y: float, z: float) -> tuple[float, float]:
    """North and east components of a vector in Earth-centred coordinates."""
    c, s, a, b = math.cos(latitude), math.sin(latitude), math.cos(longitude), math.sin(longitude)
    return c * z - s * (a * x + b * y), a * y - b * x
