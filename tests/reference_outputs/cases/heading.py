"""Heading from propellers and a compass with dynamics (P4): filters, banks, intervals, MPC and LQG."""

import math
from functools import cache, partial

import numpy as np

from steerway.control import BiasObserver, HeadingLqg, HeadingMpc, InputLimits, LinearPlant
from steerway.estimation.heading import (
    SCALE_ONLY,
    WEIGHTS,
    AidedHeadingFilter,
    CompositeFilter,
    IntervalFilter,
    LearnedHeading,
    ModelBank,
    box_of,
    composite_model,
    corners,
    outside,
)
from steerway.estimation.heading.testing import PRODUCT
from steerway.sensors import TCM2, TRUE_TCM2, DynamicCompass
from steerway.vessels import RPM, Springer, conditions
from steerway.vessels.testing import PAPER_YAW, PHYSICAL_YAW
from steerway_studies.testing import HInfinityFilter, PrintedIntervalFilter, largest_theta
from tests.reference_outputs.generated import columns
from tests.reference_outputs.tables import case


@cache
def weave(plant="paper", compass=TRUE_TCM2, seconds=120, bias=0.0, card=(0.0,) * 5):
    """[(difference, readings (40,), velocity)] of a boat that weaves, second by second."""
    chance = np.random.default_rng(6)
    boat, stream = Springer(plant, bias=bias), DynamicCompass(compass, card).start(0.0, chance)
    state, around, rows = boat.start(), conditions((0.05, 0.15)), []
    for k in range(seconds):
        difference = 80.0 * RPM * math.sin(k / 15.0)
        motion = boat.motion(state, around)
        noise = 0.1 * chance.standard_normal(2)
        velocity = motion.north_velocity + noise[0], motion.east_velocity + noise[1]
        rows.append((difference, stream.second(boat.heading(state)), velocity))
        state = boat.step(state, (difference,), around, 1.0)
    return rows


def output(estimator, rows, read):
    """`read(estimator)` after every second."""
    found = []
    for difference, readings, _ in rows:
        estimator.step(difference, readings)
        found.append(read(estimator))
    return found


@case("heading_composite")
def composite():
    columns_of = {}
    for name, yaw in (("paper", PAPER_YAW), ("physical", PHYSICAL_YAW)):
        estimator = CompositeFilter(composite_model(TCM2, yaw))
        rows = output(estimator, weave(name), lambda each: (each.heading, each.heading_std))
        columns_of |= columns(f"{name}_heading {name}_std", rows)
    return columns_of


def aided(tuning, rows, yaw):
    estimator, found = AidedHeadingFilter(tuning, yaw=yaw), []
    for k, (difference, readings, velocity) in enumerate(rows):
        silent = 60 <= k < 70
        estimator.step(difference, None if silent else readings, (math.nan, math.nan) if k % 7 == 3 else velocity)
        found.append(
            (
                estimator.heading,
                estimator.heading_std,
                estimator.scale,
                estimator.scale_std,
                estimator.bias,
                *estimator.deviation,
                *estimator.current,
                outside(estimator, 0.01),
            )
        )
    names = "heading std scale scale_std bias sine cosine current_north current_east outside"
    return columns(names, found)


@case("heading_aided")
def aided_product():
    card = tuple(np.radians([1.0, 3.0, -3.0, 1.0, 0.5]))
    return aided(PRODUCT, weave("physical", TRUE_TCM2, 120, 5.0 * RPM, card), PHYSICAL_YAW)


@case("heading_aided_scale_only")
def aided_scale():
    return aided(SCALE_ONLY, weave("paper", TCM2.scaled(0.985)), PAPER_YAW)


@case("heading_bank_of_corners")
def bank_of_corners():
    compasses = corners(0.01)

    def read(bank):
        return bank.low, bank.high, bank.nominal, bank.innovation, bank.heading, *bank.headings, *bank.weights

    rows = output(ModelBank(compasses), weave()[:60], read)
    members = range(len(compasses))
    names = "low high nominal innovation heading " + " ".join(
        f"{what}_{k}" for what in ("heading", "weight") for k in members
    )
    kept = [name for name in names.split() if not name[-1].isdigit() or int(name.rpartition("_")[2]) % 6 == 0]
    return {name: values for name, values in columns(names, rows).items() if name in kept}


@case("heading_h_infinity")
def h_infinity():
    model = composite_model(TCM2)
    largest = largest_theta(model, horizon=120)
    found = {"largest": np.full(120, largest)}
    for share in (0.0, 0.5, 0.9):
        estimator = HInfinityFilter(model, share * largest, horizon=120)
        found[f"heading_{share}"] = np.array(output(estimator, weave(), lambda each: each.heading))
    return found


def bounds(tolerance, filter_type=IntervalFilter, shift_too=False, seconds=60, **options):
    filter, rows = filter_type(box_of(composite_model(TCM2), tolerance, shift_too), **options), []
    for difference, readings, _ in weave()[:seconds]:
        rows.append((*filter.step(difference, readings), filter.width, filter.diverged))
    return columns("low high width diverged", rows)


case("heading_interval_sharpened")(partial(bounds, 0.01))
case("heading_interval_parts")(partial(bounds, 0.01, parts=3, seconds=20))
case("heading_interval_shift")(partial(bounds, 0.005, shift_too=True))
case("heading_interval_literal")(partial(bounds, 0.001, PrintedIntervalFilter, seconds=10))


@case("heading_learned")
def learned():
    found = {}
    for name in WEIGHTS:
        rows = output(LearnedHeading(name), weave(), lambda each: (each.heading, each.low, each.high))
        found |= columns(f"{name}_heading {name}_low {name}_high", rows)
    return found


def parts_of(yaw):
    plant = LinearPlant(*yaw.matrices())
    observer = BiasObserver(plant, 1e-12, 0.01 * RPM**2, 0.05 * math.radians(1.0) ** 2, (20.0 * RPM) ** 2)
    return plant, InputLimits(300.0 * RPM, 20.0 * RPM), observer


def steered(control, plant):
    boat, rows = Springer(plant, bias=8.0 * RPM), []
    state, chance = boat.start(), np.random.default_rng(8)
    for k in range(120):
        wanted = 0.0 if k < 10 else 1.2 if k < 60 else -2.5
        heading = boat.heading(state)
        difference = control.step(wanted, heading + 0.01 * chance.standard_normal())
        rows.append((heading, difference, control.observer.bias, *control.observer.state))
        state = boat.step(state, (difference,), conditions((0.0, 0.1)), 1.0)
    return columns("heading difference bias state_0 state_1 state_2", rows)


@case("heading_mpc")
def mpc():
    weights = {"output_weight": math.degrees(1.0) ** 2, "change_weight": 0.1 / RPM**2}
    return steered(HeadingMpc(*parts_of(PHYSICAL_YAW), **weights), "physical")


@case("heading_lqg")
def lqg():
    control = HeadingLqg(*parts_of(PHYSICAL_YAW), output_weight=math.degrees(1.0) ** 2, change_weight=0.1 / RPM**2)
    return steered(control, "physical")
