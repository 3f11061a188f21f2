"""The papers' rules for switching waypoints as printed; corrected with `printed=False`. For studies and tests.

P1 (45)–(46), and P4 (22) with its missed-waypoint test (Motwani, Sharma, Sutton and Culverhouse: weighted interval
Kalman filter on Springer).
"""

import math


def along_track(north, east, north_0, east_0, direction, printed=True):
    """P1 (46): along-track error x_e (m) from a leg's beginning; printed with sine and cosine exchanged."""
    c, s = math.cos(direction), math.sin(direction)
    if printed:
        c, s = s, c
    return (north - north_0) * c + (east - east_0) * s


def switches(length, along, radius, printed=True):
    """P1 (45): whether the next waypoint is taken; printed with |x_e|, so that a ship behind the leg switches."""
    return length - (abs(along) if printed else along) <= radius


class RangeRateTest:
    """P4's missed-waypoint test: missed when the distance to the waypoint turns from falling to rising.

    As printed it also fires at the start and after a switch, whenever the boat has yet to turn towards its goal. Pass
    its word on to `Mission.skip`; begin anew with every waypoint.
    """

    def __init__(self):
        self._last = math.inf
        self._falling = False

    def step(self, distance: float) -> bool:
        """True when the waypoint at this distance (m) counts as missed."""
        rises = distance > self._last
        missed = rises and self._falling
        self._falling = not rises
        self._last = distance
        return missed
