"""The guidance laws by name: the angle that each commands, and its gains for a look-ahead distance and speed.

A new law is a class of `line_of_sight` and a row here; the table [guidance] of scenarios reads its names from `LAWS`.
Default gains place both poles of the cross-track error at U/(2Δ): no overshoot in a steady current.
"""

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from steerway.core.errors import InputError
from steerway.core.settings import NotNegative, Positive, Table
from steerway.guidance.line_of_sight import (
    AdaptiveLineOfSight,
    GuidanceLaw,
    IntegralLineOfSight,
    LineOfSight,
    PurePursuit,
    VectorField,
)

Options = Mapping[str, float | None]


class LawKind(NamedTuple):
    """One law. `steers_by`: "course" or "heading"; `design`: (lookahead m, speed m/s, options in SI) → law."""

    steers_by: str
    design: Callable[[float, float, Options], GuidanceLaw]


def _given(options: Options, name: str, otherwise: float) -> float:
    value = options.get(name)
    return otherwise if value is None else value


LAWS = {
    "line-of-sight": LawKind("course", lambda lookahead, speed, options: LineOfSight(lookahead)),
    "pure-pursuit": LawKind("course", lambda lookahead, speed, options: PurePursuit()),
    "vector-field": LawKind(
        "course",
        lambda lookahead, speed, options: VectorField(1.0 / lookahead, _given(options, "approach", 0.5 * math.pi)),
    ),
    "integral-line-of-sight": LawKind(
        "heading",
        lambda lookahead, speed, options: IntegralLineOfSight(lookahead, _given(options, "integral_gain", speed / 4.0)),
    ),
    "adaptive-line-of-sight": LawKind(
        "heading",
        lambda lookahead, speed, options: AdaptiveLineOfSight(
            lookahead, _given(options, "adaptive_gain", speed / (2.0 * lookahead) ** 2)
        ),
    ),
}


def law(name: str, lookahead: float, speed: float, options: Options | None = None) -> GuidanceLaw:
    """The law called `name` for a look-ahead distance (m) and a speed (m/s). Raises InputError for an unknown name."""
    if name not in LAWS:
        raise InputError(f"guidance law is {name!r}, expected one of {', '.join(LAWS)}")
    return LAWS[name].design(lookahead, speed, options or {})


class GuidanceTable(Table):
    """The guidance law and its gains."""

    law: Literal[*LAWS] = "line-of-sight"  # type: ignore[valid-type]
    """Guidance law that steers the boat to its leg."""
    steer_by: Literal["course", "heading"] | None = None
    """Whether the law's angle is steered as a course or as a heading; by default the law decides."""
    lookahead: Annotated[Positive | None, "m"] = None
    """Look-ahead distance Δ along the leg; by default the boat's."""
    integral_gain: Annotated[NotNegative | None, "m/s"] = None
    """Integral gain of integral line of sight; by default a quarter of the cruise speed."""
    adaptive_gain: Annotated[NotNegative | None, "1/(m s)"] = None
    """Adaptation gain of adaptive line of sight; by default U/(2Δ)² at the cruise speed U."""
    approach_deg: Annotated[float, Field(strict=True, gt=0.0, le=90.0)] = 90.0
    """Largest angle between the leg and the commanded course, for the vector field."""

    @property
    def angle(self) -> str:
        """Whether the law commands a "course" or a "heading"."""
        return self.steer_by or LAWS[self.law].steers_by

    def design(self, lookahead: float, speed: float) -> GuidanceLaw:
        """The law for a look-ahead distance (m) and a speed (m/s)."""
        gains = {
            "integral_gain": self.integral_gain,
            "adaptive_gain": self.adaptive_gain,
            "approach": math.radians(self.approach_deg),
        }
        return law(self.law, lookahead, speed, gains)
