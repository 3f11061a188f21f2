"""When to begin a turn so that it ends on the next leg: by the boat's turn through the water, and the current."""

import math

from steerway.core.angles import wrap
from steerway.core.compiled import kernel
from steerway.guidance.reference import third_order


@kernel
def turn_displacement(
    heading: float,
    to: float,
    water_speed: float,
    current_north: float,
    current_east: float,
    bandwidth: float,
    max_rate: float,
    max_acceleration: float,
    lag: float,
) -> tuple[float, float, float]:
    """(north m, east m, s) over ground of a turn by the reference model of these limits, that lags by `lag` s.

    Until the heading is within 1° of the last.
    """
    dt = 0.02 / bandwidth
    angle, rate, acceleration = heading, 0.0, 0.0
    north, east, time = lag * (water_speed * math.cos(heading) + current_north), 0.0, lag
    east = lag * (water_speed * math.sin(heading) + current_east)
    for _ in range(3000):
        if abs(wrap(to - angle)) < 0.02:
            break
        angle, rate, acceleration = third_order(
            angle, rate, acceleration, to, bandwidth, 1.0, max_rate, max_acceleration, dt
        )
        north += dt * (water_speed * math.cos(angle) + current_north)
        east += dt * (water_speed * math.sin(angle) + current_east)
        time += dt
    return north, east, time


@kernel
def wheel_over(direction: float, following: float, north: float, east: float) -> float:
    """Distance (m) before a waypoint at which a turn of this displacement has to begin to end on the next leg.

    direction and following of the two legs, rad. 0 where the legs are (nearly) in line, as for turning round.
    """
    sine = math.sin(wrap(following - direction))
    if abs(sine) < 0.1:
        return 0.0
    across = east * math.cos(following) - north * math.sin(following)
    return max(0.0, -across / sine)
