"""Survey patterns: parallel lines over an area, with room outside of it for the turns."""

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from steerway.core.arrays import Floats
from steerway.core.checks import not_negative, positive
from steerway.core.errors import InputError
from steerway.core.schema import NotNegative, Number, Positive, Table


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


class SurveyTable(Table):
    """Parallel lines as of `lawnmower`, of a file of settings: m, and degrees from true north."""

    direction_deg: Number = 0.0
    length: Positive
    spacing: Number
    lines: Annotated[int, Field(strict=True, ge=1, le=1000)]
    run_in: NotNegative = 0.0

    def offsets(self) -> Floats:
        """(2 · lines, 2) north and east of the waypoints from the beginning of the first line, m."""
        towards = math.radians(self.direction_deg)
        return lawnmower(0.0, 0.0, towards, self.length, self.spacing, self.lines, self.run_in)
