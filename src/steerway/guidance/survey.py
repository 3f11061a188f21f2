"""Survey patterns: parallel lines over an area, with room outside of it for the turns."""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.errors import InputError


def lawnmower(
    north: float, east: float, direction: float, length: float, spacing: float, lines: int, run_in: float = 0.0
) -> Floats:
    """(2 · lines, 2) waypoints, north and east in m, of lines to and fro.

    The first line begins at (north, east) and runs `length` m in a `direction` (rad); the next ones lie `spacing` m to
    starboard of it, to port where it is negative. Every line is sailed `run_in` m longer at both ends, so that the
    turns and what they leave of a distance from the line lie outside of the area.
    Raises InputError for less than one line, a length that is not positive, and a spacing of 0.
    """
    positive("survey.length", length)
    not_negative("survey.run_in", run_in)
    if lines < 1:
        raise InputError(f"survey.lines is {lines}, expected at least 1")
    if not math.isfinite(spacing) or spacing == 0.0:
        raise InputError(f"survey.spacing is {spacing:g} m, expected a number other than 0")
    ahead = np.array([math.cos(direction), math.sin(direction)])
    abeam = np.array([-ahead[1], ahead[0]])
    points = []
    for k in range(lines):
        ends = (-run_in, length + run_in)
        for along in ends if k % 2 == 0 else reversed(ends):
            points.append(np.array([north, east]) + along * ahead + k * spacing * abeam)
    return np.array(points)
