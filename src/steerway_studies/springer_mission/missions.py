"""Estimators of Springer's heading, and the missions in which they are tried: the paper's, random circuits with unseen
compasses, harder worlds. Each mission is a function of its seed.
"""

import math
from dataclasses import dataclass

import numpy as np

from steerway.core import rms
from steerway.estimation.heading import (
    SCALE_ONLY,
    AidedHeadingFilter,
    CompositeFilter,
    HeadingTuning,
    IntervalFilter,
    LearnedHeading,
    ModelBank,
    box_of,
    composite_model,
    corners,
    ideal_weight,
    weighted,
)
from steerway.sensors import TCM2, TRUE_TCM2, CompassModel, random_compass
from steerway.vessels import RPM, HeadingModel
from steerway.vessels import SPRINGER_PAPER_YAW as PAPER_YAW
from steerway.vessels import SPRINGER_PHYSICAL_YAW as PHYSICAL_YAW
from steerway_studies.papers.course_autopilot import RangeRatePassing
from steerway_studies.springer_mission.world import (
    PAPER_CIRCUIT,
    Blind,
    World,
    random_circuit,
    replayed,
    sail,
    turnless_deg,
)
from steerway_studies.study import over_cases


def ideal(compass: CompassModel, yaw: HeadingModel = PAPER_YAW) -> Blind:
    """The filter with the model of the true compass."""
    return Blind(CompositeFilter(composite_model(compass, yaw)))


def nominal(yaw: HeadingModel = PAPER_YAW) -> Blind:
    """The filter with the nominal compass of P4 (7)."""
    return Blind(CompositeFilter(composite_model(TCM2, yaw)))


class WeightedBounds:
    """P4's estimate: the bounds of an interval filter, with a weight from the ideal filter (20) or a fixed one.

    Once the bounds have diverged the estimate is NaN, and the autopilot continues by prediction.
    """

    def __init__(self, bounds: IntervalFilter, compass: CompassModel | None = None, weight: float = 0.5):
        self.bounds = bounds
        self.ideal = None if compass is None else CompositeFilter(composite_model(compass))
        self._fixed = weight
        self.heading = 0.0
        self.record = []

    def step(self, difference, readings, velocity) -> float:
        low, high = self.bounds.step(difference, readings)
        weight, truth = self._fixed, math.nan
        if self.ideal is not None:
            truth = self.ideal.step(difference, readings)
            weight = ideal_weight(low, high, truth)
        self.heading = weighted(low, high, weight)
        self.record.append((low, high, weight, truth))
        return self.heading


class HalfBank(Blind):
    """The middle of the hull of a bank of filters."""

    def __init__(self):
        super().__init__(ModelBank(corners(0.01)))

    @property
    def heading(self) -> float:
        return 0.5 * (self.estimator.low + self.estimator.high)


def interval_box(tolerance: float, shift_too: bool = False):
    return box_of(composite_model(), tolerance, shift_too)


def scale_state() -> Blind:
    """The aided filter with the compass's scale as its only unknown, without GNSS velocity."""
    return Blind(AidedHeadingFilter(SCALE_ONLY, TCM2, PAPER_YAW))


KNOWN_SPEED = HeadingTuning(current=(0.3, 2e-3), water_speed=(0.0, 0.0))
"""Tuning for worlds (a) to (c), in which the speed through the water is known."""


class ByBearing:
    """The aided filter with known speed through the water, for steering by the bearing of a waypoint."""

    def __init__(self, has_compass: bool = True):
        self.estimator, self._has_compass = AidedHeadingFilter(KNOWN_SPEED), has_compass

    @property
    def heading(self) -> float:
        return self.estimator.heading

    def step(self, difference, readings, velocity) -> float:
        return self.estimator.step(difference, readings if self._has_compass else None, velocity)


RIVALS = {
    "nominal": nominal,
    "weight_net": lambda: Blind(LearnedHeading("weight")),
    "innovations_net": lambda: Blind(LearnedHeading("innovations")),
    "half_bank": HalfBank,
    "scale_state": scale_state,
}
"""Estimators that are given the box of compasses, not the compass, by the prefix of their keys."""


@dataclass(frozen=True)
class MissionResult:
    """The results of one mission."""

    reached: int
    legs: int
    time_s: float
    distance_m: float
    deviation_m: float
    deviation_printed_m: float
    cross_track_rms_m: float
    energy_rps2: float
    heading_rms_deg: float
    heading_median_deg: float

    @classmethod
    def of(cls, voyage) -> "MissionResult":
        log = voyage.log
        return cls(
            voyage.reached,
            len(voyage.circuit),
            float(len(voyage.heading)),
            log.distance,
            voyage.deviation,
            voyage.deviation_printed,
            log.cross_track_rms,
            log.mean_effort,
            voyage.heading_rms_deg,
            voyage.heading_median_deg,
        )

    @property
    def all(self) -> bool:
        return self.reached == self.legs


def paper_mission(seed: int) -> dict[str, MissionResult]:
    """P4's mission with the ideal and the nominal filter, the latter with both tests for missed waypoints."""
    world = World()
    return {
        "ideal": MissionResult.of(sail(world, ideal(TRUE_TCM2), seed)),
        "nominal": MissionResult.of(sail(world, nominal(), seed)),
        "nominal_printed_test": MissionResult.of(sail(world, nominal(), seed, passing=RangeRatePassing())),
    }


def unseen_mission(seed: int) -> dict[str, tuple[MissionResult, float]]:
    """A random compass and circuit, by estimator: its own mission, its RMS error (°) on the ideal filter's voyage."""
    rng = np.random.default_rng(seed)
    compass = random_compass(rng)
    circuit, world = random_circuit(rng), World(compass=compass)
    reference = sail(world, ideal(compass), seed, circuit)
    out = {"ideal": (MissionResult.of(reference), reference.heading_rms_deg)}
    for name, make in RIVALS.items():
        headings = replayed(reference, make())
        error = rms(np.degrees(headings - reference.heading))
        out[name] = MissionResult.of(sail(world, make(), seed, circuit)), error
    return out


def real_world(kind: str, seed: int) -> World:
    """A harder world: (a) propellers not as modelled, (b) also a deviation card, (c) as (a) with a varying current."""
    rng = np.random.default_rng((seed, 4))
    card = (0.0,) * 5
    effectiveness, bias = rng.uniform(0.85, 1.15), rng.uniform(-15.0, 15.0) * RPM
    compass = random_compass(rng)
    if kind == "b":
        card = tuple(np.radians(rng.standard_normal(5) * (1.0, 3.0, 3.0, 1.0, 0.5)).tolist())
    return World(
        compass,
        "physical",
        effectiveness,
        bias,
        card,
        waves=1e-4,
        current_std=0.05 if kind == "c" else 0.0,
        current_time=900.0 if kind == "c" else 600.0,
    )


BOXED = ("weight_net", "half_bank")
"""Estimators whose box contains the compasses of world (a)."""


def real_mission(kind: str, seed: int) -> dict[str, object]:
    """One harder world: aided filter, nominal filter and GNSS alone in the loop; GNSS alone on the aided's voyage."""
    world, circuit = real_world(kind, seed), PAPER_CIRCUIT
    voyage = sail(world, ByBearing(), seed, circuit)
    alone = np.abs(turnless_deg(replayed(voyage, ByBearing(has_compass=False)), voyage.heading))
    boxed = (
        {name: MissionResult.of(sail(world, RIVALS[name](), seed, circuit)) for name in BOXED} if kind == "a" else {}
    )
    return boxed | {
        "product": MissionResult.of(voyage),
        "nominal": MissionResult.of(sail(world, nominal(PHYSICAL_YAW), seed, circuit)),
        "gnss": MissionResult.of(sail(world, ByBearing(has_compass=False), seed, circuit)),
        "errors": np.abs(turnless_deg(voyage.estimate, voyage.heading)),
        "gnss_median": float(np.median(alone)),
    }


def many(run, seeds, progress=None) -> dict[str, list] | list:
    """Results of many seeds; lists by name if each result is a dict."""
    out = over_cases(run, seeds, progress=progress)
    return {name: [each[name] for each in out] for name in out[0]} if isinstance(out[0], dict) else out


def mean(runs, field) -> float:
    """Mean of a field of `MissionResult` over runs."""
    return float(np.mean([getattr(each, field) for each in runs]))


def world_numbers(worlds) -> dict[str, float]:
    """Numbers of the aided filter, the nominal filter and GNSS alone in harder worlds; of filters with a box in (a)."""
    n = {}
    for kind, runs in worlds.items():
        errors, own = np.concatenate(runs["errors"]), np.array([np.median(each) for each in runs["errors"]])
        n |= {
            f"product_s2_{kind}_reached_all_pct": 100.0 * sum(each.all for each in runs["product"]) / len(own),
            f"product_s2_{kind}_heading_median_deg": float(np.median(errors)),
            f"product_s2_{kind}_heading_p95_deg": float(np.quantile(errors, 0.95)),
            f"product_s2_{kind}_worse_than_gnss_deg": float(np.max(own - np.array(runs["gnss_median"]))),
            f"nominal_s2_{kind}_mean_reached": mean(runs["nominal"], "reached"),
            f"gnss_s2_{kind}_heading_median_deg": float(np.median(runs["gnss_median"])),
            f"gnss_s2_{kind}_mean_reached": mean(runs["gnss"], "reached"),
        }
    n["product_s2_reached_all_pct"] = min(n[f"product_s2_{kind}_reached_all_pct"] for kind in "abc")
    n["product_s2_heading_median_deg"] = max(n[f"product_s2_{kind}_heading_median_deg"] for kind in "abc")
    n |= {f"{name}_s2_a_mean_reached": mean(worlds["a"][name], "reached") for name in (*BOXED, "product")}
    return n
