"""Records of a weaving Springer with compass and velocities."""

import math

import numpy as np

from steerway.sensors import TRUE_TCM2, DynamicCompass
from steerway.vessels import RPM, Springer, conditions


def record(
    seconds=60, compass=TRUE_TCM2, plant="paper", current=(0.0, 0.15), seed=0, heading=0.0, card=(0.0,) * 5, **vessel
):
    """(propeller speed differences, compass readings, headings, velocities) of a weaving run, one per second."""
    rng = np.random.default_rng(seed)
    boat, stream = Springer(plant, **vessel), DynamicCompass(compass, card).start(heading, rng)
    state, around, rows = boat.start(heading=heading), conditions(current), []
    for k in range(seconds):
        difference = 60.0 * RPM * math.sin(k / 15.0)
        motion = boat.motion(state, around)
        velocity = (
            motion.north_velocity + 0.1 * rng.standard_normal(),
            motion.east_velocity + 0.1 * rng.standard_normal(),
        )
        rows.append((difference, stream.second(boat.heading(state)), boat.heading(state), velocity))
        state = boat.step(state, (difference,), around, 1.0)
    return tuple(zip(*rows, strict=True))
