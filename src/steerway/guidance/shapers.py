"""The reference filters that a scenario can name in `reference.kind`: a new one is its class, and one entry here."""

import math
from typing import Literal

from steerway.core.schema import Positive, Table
from steerway.guidance.reference import LowPass, ReferenceModel, TrackingFilter

SHAPERS = {
    "tracking": lambda keys: TrackingFilter(keys.bandwidth or 1.0, keys.damping),
    "model": lambda keys: ReferenceModel(keys.bandwidth or 0.5, keys.damping, math.radians(keys.max_rate_deg)),
    "low-pass": lambda keys: LowPass(keys.time_constant),
}
"""Each makes a filter of the table [reference]."""


class ReferenceTable(Table):
    """The filter between guidance and autopilot; its kind by default as the vessel declares."""

    kind: Literal[*SHAPERS] | None = None
    bandwidth: Positive | None = None
    damping: Positive = 1.0
    time_constant: Positive = 40.0
    max_rate_deg: Positive = 15.0
