"""Course estimation over records, causal and smoothed: profiles, aids, troubles, predictions."""

from functools import partial

import numpy as np

import steerway
from steerway import FiveStateFilter, Profile
from steerway.estimation import predict
from tests.reference_outputs.sorties import (
    AIDS,
    KINDS,
    MODES,
    MOTION,
    ONE,
    TWO,
    alternating_fixes,
    burst,
    fast_start,
    fixes_of,
    gaps,
    instruments,
    motion_columns,
    outliers,
    placed,
    standstill,
    weaving_fixes,
)
from tests.reference_outputs.tables import case
from tests.scenes import sailed

SMOOTHED_ROWS = 40


def run(profile, fixes, smooth, aid=(), rate=None, rows=None):
    filter = FiveStateFilter(profile, aid)
    return motion_columns(filter.smooth(fixes, rate) if smooth else filter.filter(fixes, rate), rows)


def register(name, profile, fixes, rows=None, **options):
    """The case causal, and smoothed in fewer rows, each of which knows all; `fixes` is a function of nothing."""
    for how, smooth, shown in (("causal", False, rows), ("smoothed", True, SMOOTHED_ROWS)):
        case(f"course-{name}-{how}")(
            lambda smooth=smooth, shown=shown: run(profile, fixes(), smooth, rows=shown, **options)
        )


for kind, parameters in KINDS.items():
    register(f"kind-{kind}", Profile(**parameters), partial(fixes_of, Profile(**parameters)), rows=60)

for built_in in ("otter", "mariner-usv", "small-usv", "sailing-yacht", "swell", "ship", "ais"):
    register(f"built-in-{built_in}", Profile.named(built_in), weaving_fixes, rows=50)


for modes, profile in MODES.items():
    for aid in AIDS:
        case(f"course-aid-{aid.replace('_', '-')}-{modes}")(
            lambda profile=profile, aid=aid: run(profile, instruments(), smooth=False, aid=(aid,), rows=60)
        )
    register(f"aid-all-{modes}", profile, instruments, rows=60, aid=AIDS)
    register(f"aid-sog-cog-{modes}", profile, instruments, rows=40, aid=("sog", "cog"))

register("aid-all-errors", Profile(**KINDS["acceleration-errors"]), instruments, rows=60, aid=AIDS)
register("aid-all-two-modes-errors", Profile(**KINDS["two-modes-errors"]), instruments, rows=60, aid=AIDS)
register("aid-all-oscillating", Profile(**KINDS["oscillating"]), instruments, rows=60, aid=AIDS)
WITHOUT_BIAS = Profile(**MOTION, crab_std=0.0, stream_std=0.0, gyro_bias_std=0.0)
register("aid-without-bias", WITHOUT_BIAS, instruments, rows=60, aid=AIDS)


for trouble in (outliers, burst, gaps, standstill, fast_start):
    for modes, profile in MODES.items():
        register(f"trouble-{trouble.__name__.replace('_', '-')}-{modes}", profile, trouble)
for trouble in (burst, gaps, standstill):
    for kind in ("two-errors", "acceleration", "oscillating", "two-modes-error"):
        register(f"trouble-{trouble.__name__}-{kind}", Profile(**KINDS[kind]), trouble, rows=60)


for modes, profile in MODES.items():
    register(f"rate-higher-{modes}", profile, lambda: alternating_fixes().rows(slice(40)), rows=80, rate=4.0)
    register(f"rate-lower-{modes}", profile, gaps, rate=0.7, rows=60)
register("rate-aided", TWO, instruments, rows=60, rate=3.0, aid=("heading", "yaw_rate"))
register(
    "rate-errors-oscillating", Profile(**KINDS["oscillating-error-acceleration"]), weaving_fixes, rows=60, rate=5.0
)


def predicted(fixes, profile, aid=None):
    found = predict(fixes, (10.0, 60.0, 300.0, 1500.0), profile, aid)
    longer, shorter, _ = found.ellipse
    return placed(found.columns()) | {"longer": longer, "shorter": shorter}


for kind in ("white", "no-rate-decay", "speed-decay", "two-errors", "acceleration", "oscillating", "two-modes"):
    profile = Profile(**KINDS[kind])
    case(f"course-prediction-{kind}")(lambda profile=profile: predicted(fixes_of(profile), profile))
case("course-prediction-low-speed")(lambda: predicted(standstill().rows(slice(70)), ONE))
case("course-prediction-starting")(lambda: predicted(fast_start().rows(slice(2)), ONE))
case("course-prediction-aided")(lambda: predicted(instruments(), TWO, AIDS))


@case("course-estimate-without-profile", rtol=1e-2, atol=1e-2)
def without_profile():
    """A fit ends within a tenth of a standard deviation of its parameters, where depends on rounding."""
    course = 0.4 + np.cumsum(np.tile(np.r_[np.zeros(40), np.full(20, 0.06)], 3))
    return motion_columns(steerway.estimate(sailed(np.full(180, 2.0), course, 2.0).fixes(0.2, 31), causal=True), 50)
