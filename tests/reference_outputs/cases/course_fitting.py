"""Comparison with a receiver, its lateness, and profiles fitted to short records."""

from dataclasses import asdict, replace
from functools import cache

import numpy as np

import steerway
from steerway import FiveStateFilter, Fixes
from steerway.estimation import choose_profile
from steerway.estimation.testing import compare, lateness, on_time
from tests.reference_outputs.sorties import (
    AIDS,
    ONE,
    instruments,
    motion_columns,
    standstill,
    traffic,
    weaving,
    weaving_fixes,
    wrapped,
)
from tests.reference_outputs.tables import case
from tests.scenes import sailed, turning


@cache
def late_receiver() -> Fixes:
    """Own SOG and COG come 1.2 s late."""
    scene = weaving()
    then = scene.time - 1.2
    noise = np.random.default_rng(14).standard_normal((2, len(then)))
    sog = np.interp(then, scene.time, scene.sog) + 0.02 * noise[0]
    cog = wrapped(np.interp(then, scene.time, np.unwrap(scene.cog)) + 0.01 * noise[1])
    return replace(weaving_fixes(), sog=sog, cog=cog)


def agreement(fixes, motion):
    return asdict(compare(fixes, motion))


case("course-comparison-late-receiver")(
    lambda: agreement(late_receiver(), FiveStateFilter(ONE).smooth(late_receiver()))
)
case("course-comparison-many-vessels")(lambda: agreement(traffic(), FiveStateFilter("ais").filter(traffic())))
case("course-comparison-standstill")(
    lambda: agreement(
        replace(standstill(), sog=np.zeros(96), cog=np.zeros(96)), FiveStateFilter(ONE).filter(standstill())
    )
)
case("course-lateness")(lambda: asdict(lateness(late_receiver())))
case("course-latency-taken-out")(
    lambda: motion_columns(FiveStateFilter(ONE, AIDS).filter(on_time(instruments(), 0.3)), 60)
)


@cache
def short_sailing() -> Fixes:
    """A minute and a half at 2 Hz: turns, and a receiver with white noise."""
    return sailed(np.full(180, 2.0), 0.4 + np.cumsum(np.tile(np.r_[np.zeros(40), np.full(20, 0.06)], 3)), 2.0).fixes(
        0.2, 31
    )


@cache
def short_wander() -> Fixes:
    """Two minutes at 1 Hz of a receiver that errs slowly."""
    walk = np.cumsum(np.random.default_rng(33).normal(0.0, 0.15, (2, 120)), axis=1)
    return turning(3.0, 1.0, 119.0, rate=1.0, seed=6).fixes(0.05, 32, lambda time: walk)


def expected(profile, name) -> float:
    """Weighted mean over the structures of a number that all of them have."""
    return sum(each.weight * each.values[name] for each in profile.structures)


def tuned(fixes) -> dict[str, float]:
    found = steerway.tune(fixes)
    counts = {name: getattr(found, name) for name in ("fixes", "moving", "rejected", "held_back", "nis_mean")}
    return counts | {"fix_std": expected(found.profile, "fix_std")}


for log in (short_sailing, short_wander):
    name = log.__name__.replace("_", "-")
    case(f"course-tuned-{name}", rtol=0.05)(lambda log=log: tuned(log()))


@case("course-inferred-aided", rtol=0.05)
def inferred_aided():
    """What this log determines."""
    profile = choose_profile(instruments(), aid=("sog", "yaw_rate"))
    return {name: expected(profile, name) for name in ("fix_std", "sog_std", "yaw_rate_std")}


# A fit ends within a tenth of a standard deviation of its parameters, where depends on rounding.
case("course-estimate-without-profile", rtol=1e-2, atol=1e-2)(
    lambda: motion_columns(steerway.estimate(short_sailing()), 50)
)
