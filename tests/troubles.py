"""Troubles of a log: faults of its fixes, and unusual places on the Earth.

Every trouble takes (voyage, fixes, generator) and returns changed (voyage, fixes); faults begin at `BEGIN`.
"""

import math
from dataclasses import replace

import numpy as np

from steerway.core import Fixes, radii, wrap_array
from steerway_studies.testing import TrueMotion

BEGIN = 150.0
_POLAR_RADIUS = 6_399_593.6
"""Radius of curvature at the pole (WGS-84), m."""
_FROM_POLE = 1000.0


def _moved(fixes: Fixes, north, east) -> Fixes:
    meridian, prime_vertical = radii(0.0)
    return replace(fixes, latitude=fixes.latitude + north / meridian, longitude=fixes.longitude + east / prime_vertical)


def _rows(voyage: TrueMotion, fixes: Fixes, chosen) -> tuple[TrueMotion, Fixes]:
    columns = {name: getattr(voyage, name)[chosen] for name in voyage.__dataclass_fields__}
    return TrueMotion(**columns), fixes.rows(chosen)


def dropout(voyage, fixes, chance):
    """No fixes for 30 s."""
    return _rows(voyage, fixes, (voyage.time < BEGIN) | (voyage.time >= BEGIN + 30.0))


def jump(voyage, fixes, chance):
    """One fix 50 m off."""
    return voyage, _displaced(voyage, fixes, chance, 50.0, 0.1)


def burst(voyage, fixes, chance):
    """Fixes 50 m off for 5 s."""
    return voyage, _displaced(voyage, fixes, chance, 50.0, 5.0)


def step(voyage, fixes, chance):
    """Every later fix 10 m off."""
    return voyage, _displaced(voyage, fixes, chance, 10.0, math.inf)


def _displaced(voyage, fixes, chance, by, duration):
    direction = chance.uniform(-math.pi, math.pi)
    during = (voyage.time >= BEGIN) & (voyage.time < BEGIN + duration)
    return _moved(fixes, during * by * math.cos(direction), during * by * math.sin(direction))


def antimeridian(voyage, fixes, chance):
    """A track across 180° of longitude."""
    return voyage, replace(fixes, longitude=wrap_array(fixes.longitude + math.pi - fixes.longitude[len(fixes) // 2]))


def pole(voyage, fixes, chance):
    """A track a kilometre from the North Pole, where the direction of north changes along it."""
    meridian, prime_vertical = radii(0.0)
    away, aside = _FROM_POLE - fixes.latitude * meridian, fixes.longitude * prime_vertical
    there = replace(
        fixes, latitude=math.pi / 2.0 - np.hypot(away, aside) / _POLAR_RADIUS, longitude=np.arctan2(aside, away)
    )
    north_turned = np.unwrap(np.arctan2(voyage.east, _FROM_POLE - voyage.north))
    return replace(voyage, cog=voyage.cog + north_turned), there


TROUBLES = {each.__name__: each for each in (burst, step, jump, dropout, antimeridian, pole)}
