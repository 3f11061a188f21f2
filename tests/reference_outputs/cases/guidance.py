"""Guidance: every law on a leg and on a route, waypoints and voyages."""

import math

from steerway.guidance import (
    AdaptiveLineOfSight,
    IntegralLineOfSight,
    LineOfSight,
    Mission,
    Passing,
    Phase,
    PurePursuit,
    Route,
    VectorField,
)
from steerway.guidance.testing import Voyage
from tests.reference_outputs.tables import case, columns

NORTH, EAST = [0.0, 80.0, 80.0, 20.0, 60.0], [0.0, 0.0, 60.0, 90.0, 150.0]
PHASES = list(Phase)


def sailed(law, mission, current=(0.0, 0.25), rate=0.4, north=-5.0, east=12.0):
    """A point that turns towards what is asked for at most at `rate`, 1.2 m/s through the water, 1 s a step."""
    course, rows = 0.3, []
    for k in range(240):
        leg = mission.step(math.nan if k in (50, 51) else north, east, 1.0, 0.5)
        velocity = 1.2 * math.cos(course) + current[0], 1.2 * math.sin(course) + current[1]
        over_ground = math.atan2(velocity[1], velocity[0])
        asked = law.step(leg, over_ground if k % 40 else math.nan, math.hypot(*velocity), 1.0)
        rows.append((north, east, *asked, *leg, PHASES.index(mission.phase)))
        if math.isfinite(asked.angle):
            course += max(-rate, min(rate, math.remainder(asked.angle - course, 2.0 * math.pi)))
        north, east = north + velocity[0], east + velocity[1]
    names = "north east angle rate acceleration target direction along cross remaining distance bearing speed phase"
    return columns(names, rows, 4)


for name, compute in {
    "line_of_sight": lambda: sailed(LineOfSight(12.0), Mission(Route(NORTH, EAST, 5.0, 1.2))),
    "pure_pursuit": lambda: sailed(
        PurePursuit(), Mission(Route(NORTH, EAST, 5.0), Passing("circle"), start="point", at_end="hold")
    ),
    "vector_field": lambda: sailed(VectorField(0.08), Mission(Route(NORTH, EAST, [1, 2, 3, 4, 5]), at_end="continue")),
    "integral": lambda: sailed(
        IntegralLineOfSight(12.0, 0.3, integral=2.0), Mission(Route(NORTH, EAST, 5.0, [1.0, 1.1, 1.2, 1.3, 1.4]))
    ),
    "adaptive": lambda: sailed(
        AdaptiveLineOfSight(12.0, 2e-3, crab_angle=0.1), Mission(Route(NORTH, EAST), Passing("circle"))
    ),
    "voyage_with_stays": lambda: sailed(
        LineOfSight(12.0), Voyage(Route(NORTH, EAST, 6.0, 1.2), [0, 20, 0, 15, 0], at_end="hold")
    ),
}.items():
    case(f"guidance_{name}")(compute)
