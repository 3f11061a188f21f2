"""The guidance laws that a scenario can name in `guidance.law`: a new one is its file, and one entry here.

Gains that are left out make both poles of the path error U/(2Δ): no overshoot in a steady current.
"""

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field

from steerway.core.schema import NotNegative, Positive, Table
from steerway.guidance.adaptive_line_of_sight import AdaptiveLineOfSight
from steerway.guidance.integral_line_of_sight import IntegralLineOfSight
from steerway.guidance.line_of_sight import LineOfSight, PurePursuit
from steerway.guidance.vector_field import VectorField


class Law(NamedTuple):
    """`build` makes a law of the table [guidance], the lookahead distance (m) and the cruise speed (m/s)."""

    build: Callable[["GuidanceTable", float, float], Any]
    steers_by: Literal["course", "heading"] = "course"


def _integral(keys, lookahead, cruise):
    gain = cruise / 4.0 if keys.integral_gain is None else keys.integral_gain
    return IntegralLineOfSight(lookahead, gain)


def _adaptive(keys, lookahead, cruise):
    gain = cruise / (2.0 * lookahead) ** 2 if keys.adaptive_gain is None else keys.adaptive_gain
    return AdaptiveLineOfSight(lookahead, gain)


LAWS = {
    "line-of-sight": Law(lambda keys, lookahead, cruise: LineOfSight(lookahead)),
    "pure-pursuit": Law(lambda keys, lookahead, cruise: PurePursuit()),
    "vector-field": Law(lambda keys, lookahead, cruise: VectorField(1.0 / lookahead, math.radians(keys.approach_deg))),
    "integral-line-of-sight": Law(_integral, "heading"),
    "adaptive-line-of-sight": Law(_adaptive, "heading"),
}


class GuidanceTable(Table):
    """The law and its gains; `steer_by` where it is not the law's own."""

    law: Literal[*LAWS] = "line-of-sight"
    steer_by: Literal["course", "heading"] | None = None
    lookahead: Positive | None = None
    integral_gain: NotNegative | None = None
    adaptive_gain: NotNegative | None = None
    approach_deg: Annotated[float, Field(gt=0.0, le=90.0)] = 90.0

    @property
    def angle(self) -> Literal["course", "heading"]:
        """What the law commands."""
        return self.steer_by or LAWS[self.law].steers_by
