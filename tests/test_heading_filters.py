"""P4's heading filters: composite, aided, bank and intervals, rigorous against 400-bit numbers; and any readings."""

import math
from decimal import Context, Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steerway.core import InputError, rms
from steerway.estimation.heading import (
    START_VARIANCE,
    AidedHeadingFilter,
    CompositeFilter,
    DeviationBounds,
    IntervalFilter,
    box_of,
    composite_model,
)
from steerway.estimation.testing import PRODUCT, HeadingAboard, arithmetic, heading_model_of
from steerway.live.testing import InputRow, MeasuredSpeed
from steerway.sensors import TCM2, TRUE_TCM2, DynamicCompass, random_compass
from steerway.vessels import RPM, HeadingModel
from steerway.vessels.testing import PAPER_YAW, PHYSICAL_YAW
from steerway_studies.testing import PrintedCompassKalman, PrintedIntervalFilter
from tests.scenes import record


def by_matrices(compass, yaw, differences, readings):
    """P4 (11)–(15) on point values with NumPy's matrices."""
    a, b, c = yaw.matrices()
    tick, second = np.eye(4), np.eye(4)
    tick[2] = [*(compass.b * np.degrees(c)), compass.a1, compass.a2]
    tick[3] = [0.0, 0.0, compass.shift, 0.0]
    second[:2, :2] = a
    h = np.array([0.0, 0.0, compass.k, 0.0])
    x, p = np.zeros(4), np.diag([1e-12, 1e-12, 1.0, 1.0])
    headings = []
    for u, zs in zip(differences, readings, strict=True):
        for z in np.degrees(zs):
            x, p = tick @ x, tick @ p @ tick.T + np.diag([0.0, 0.0, 1.0, 1.0])
            gain = p @ h / (h @ p @ h + 2.0)
            x, p = x + gain * (z - h @ x), p - np.outer(gain, h @ p)
        x = second @ x + np.array([*b, 0.0, 0.0]) * u
        p = second @ p @ second.T + np.diag([1e-14, 1e-14, 0.0, 0.0])
        headings.append(c @ x[:2])
    return np.array(headings), c @ p[:2, :2] @ c


@pytest.mark.parametrize("compass", [TCM2, TRUE_TCM2])
@pytest.mark.parametrize("yaw", [PAPER_YAW, PHYSICAL_YAW])
def test_composite_is_the_kalman_filter(compass, yaw):
    differences, readings, _, _ = record()
    estimator = CompositeFilter(composite_model(compass, yaw))
    headings = [estimator.step(u, z) for u, z in zip(differences, readings, strict=True)]
    expected, variance = by_matrices(compass, yaw, differences, readings)
    np.testing.assert_allclose(headings, expected, rtol=1e-9, atol=1e-12)
    assert estimator.heading_std == pytest.approx(math.sqrt(variance), rel=1e-6)


def printed(rate, knows_heading):
    """Errors (deg) of the readings, and of the printed filter, in a steady turn (deg/s), from 20 s on."""
    true = rate * np.arange(60 * 40) / 40
    compass = DynamicCompass(TCM2).start(0.0, np.random.default_rng(1))
    readings = np.degrees([compass.readings(np.radians(each), 1)[0] for each in true])
    estimator, estimated = PrintedCompassKalman(), [0.0]
    for heading, reading in zip(true, readings, strict=True):
        estimated.append(estimator.step(heading if knows_heading else estimated[-1], reading))
    return ((each - true)[20 * 40 :] for each in (readings, np.array(estimated[1:])))


def test_the_printed_filter_of_the_compass_takes_the_heading_that_is_sought():
    """P4 (5)–(7): told the true heading it smooths the readings; told its own estimate it lags further in a turn."""
    readings, told = printed(0.0, knows_heading=True)
    assert rms(told) < 0.5 * rms(readings)
    (_, told), (_, alone) = (printed(5.0, knows_heading) for knows_heading in (True, False))
    assert abs(alone.mean()) > 1.5 * abs(told.mean())


def test_product_filter_finds_bias_scale_and_current():
    compass = random_compass(np.random.default_rng(0))
    data = record(900, compass, "physical", (0.1, -0.15), effectiveness=1.1, bias=10.0 * RPM)
    estimator, errors = AidedHeadingFilter(PRODUCT), []
    for u, z, heading, velocity in zip(*data, strict=True):
        errors.append(estimator.heading - heading)
        estimator.step(u, z, velocity)
    assert np.degrees(np.median(np.abs(errors[100:]))) < 2.0
    assert estimator.bias == pytest.approx(10.0 * RPM, abs=4.0 * RPM)
    assert estimator.scale == pytest.approx(compass.gain / TCM2.gain, abs=0.1)
    assert np.hypot(*np.subtract(estimator.current, (0.1, -0.15))) < 0.08
    course = 0.9
    heading, speed = estimator.heading_for(course), estimator.water_speed
    made = np.add(estimator.current, (speed * math.cos(heading), speed * math.sin(heading)))
    assert math.atan2(made[1], made[0]) == pytest.approx(course, abs=1e-9)


def test_readings_may_be_wrapped_unknown_or_missing():
    differences, readings, _, velocities = record(40, TCM2, "physical")
    one, other, blind = (AidedHeadingFilter() for _ in range(3))
    for k, (u, z, velocity) in enumerate(zip(differences, readings, velocities, strict=True)):
        turned = z + (k % 3 - 1) * 2.0 * np.pi
        assert one.step(u, z, velocity) == pytest.approx(other.step(u, turned, velocity), abs=1e-9)
        blind.step(u, None if k % 2 else np.full(40, np.nan), velocity)
    assert math.isfinite(blind.heading) and blind.scale == pytest.approx(1.0)
    assert blind.heading_std > one.heading_std


@pytest.mark.parametrize("first_deg", [0, 90, 180, -90, 315])
def test_an_unknown_first_heading_is_found(first_deg):
    seed = 40 + first_deg // 45
    compass = random_compass(np.random.default_rng(seed))
    data = record(300, compass, "physical", (0.1, -0.15), seed, heading=math.radians(first_deg))
    estimator, errors = AidedHeadingFilter(heading=None), []
    assert math.isnan(estimator.heading)
    for u, z, heading, velocity in zip(*data, strict=True):
        estimator.step(u, z, velocity)
        errors.append(math.remainder(estimator.heading - heading, 2.0 * math.pi))
    assert np.degrees(np.abs(errors[150:])).max() < 12.0


MODEL = composite_model()


@pytest.mark.parametrize(("step", "rate"), [(0.1, 40), (0.02, 10), (3.0, 7), (1.0, 160)])
def test_other_steps_and_rates_estimate_the_same_heading(step, rate):
    """Held against the filter of P4's 40 readings a second; the input changes every 30 s, so that any step holds it."""
    rng = np.random.default_rng(2)
    compass_gain, seconds = TCM2.gain, 120
    differences = np.repeat([3.0, -2.0, 1.0, -4.0], 30)
    usual, headings = CompositeFilter(MODEL), [0.0]
    plant = CompositeFilter(MODEL)
    for u in differences:
        headings.append(plant.step(u))  # without readings the filter is its vehicle model
    for k, u in enumerate(differences):
        usual.step(u, compass_gain * headings[k] + 0.02 * rng.standard_normal(40))
    other = CompositeFilter(MODEL)
    for k in range(round(seconds / step)):
        begin = k * step
        n = round(step * rate * (k + 1)) - round(step * rate * k)
        times = np.sort(rng.uniform(0.0, step, n))
        truth = np.interp(begin + times, np.arange(seconds + 1), headings)
        other.step(
            differences[int(begin + 1e-9)], compass_gain * truth + 0.02 * rng.standard_normal(n), dt=step, times=times
        )
    assert usual.heading == pytest.approx(headings[-1], abs=math.radians(0.1))
    assert other.heading == pytest.approx(headings[-1], abs=math.radians(0.1))


NUMBERS = st.floats(-1e9, 1e9).filter(lambda x: x == 0.0 or abs(x) > 1e-9)
INTERVALS = st.tuples(NUMBERS, NUMBERS).map(lambda pair: (min(pair), max(pair)))


@settings(max_examples=100, deadline=None)
@given(INTERVALS, INTERVALS, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_every_operation_holds_what_exact_numbers_give(a, b, s, t):
    x = min(max(a[0] + s * (a[1] - a[0]), a[0]), a[1])
    y = min(max(b[0] + t * (b[1] - b[0]), b[0]), b[1])
    exact_x, exact_y = Fraction(x), Fraction(y)
    cases = [
        (arithmetic.add(a, b), exact_x + exact_y),
        (arithmetic.subtract(a, b), exact_x - exact_y),
        (arithmetic.multiply(a, b), exact_x * exact_y),
        (arithmetic.scale(x, b), exact_x * exact_y),
        (arithmetic.square(a), exact_x * exact_x),
    ]
    if y != 0.0:
        cases += [(arithmetic.divide(a, b), exact_x / exact_y), (arithmetic.reciprocal(b), 1 / exact_y)]
    for (low, high), exact in cases:
        assert low == -math.inf or Fraction(low) <= exact
        assert high == math.inf or exact <= Fraction(high)
    if x >= 0.0:
        low, high = arithmetic.root(a)
        assert Fraction(low) ** 2 <= exact_x <= Fraction(high) ** 2


def exact_headings(model, differences, readings) -> list[Decimal]:
    """Headings (rad) of the ordinary composite filter from the same doubles, nothing rounded before the 125th digit."""
    exact = np.vectorize(lambda number: Decimal(float(number)), otypes=[object])
    with localcontext(Context(prec=125)):  # 415 bits
        p1, p2, push1, push2, o1, o2, a1, a2, b, k, shift, waves, noise, spread = exact(model)
        f, x, headings = exact(np.eye(4)), exact(np.zeros(4)), []
        f[2], f[3] = (b * o1, b * o2, a1, a2), shift * f[2]
        p = np.diag(exact([START_VARIANCE, START_VARIANCE, 1.0, 1.0]))
        decay = np.diag([p1, p2, *exact([1.0, 1.0])])
        for difference, second in zip(exact(differences), exact(np.degrees(readings)), strict=True):
            for reading in second:
                x, p = f @ x, f @ p @ f.T
                p[2, 2], p[3, 3] = p[2, 2] + noise, p[3, 3] + noise
                pc = k * p[2]
                s = k * pc[2] + spread
                x, p = x + pc / s * (reading - k * x[2]), p - np.outer(pc, pc) / s
            x, p = decay @ x, decay @ p @ decay
            x[:2] += np.array([push1, push2]) * difference
            p[0, 0], p[1, 1] = p[0, 0] + waves, p[1, 1] + waves
            headings.append((o1 * x[0] + o2 * x[1]) * Decimal(math.pi / 180.0))
    return headings


@pytest.mark.parametrize("interval_filter", [IntervalFilter, PrintedIntervalFilter])
def test_outward_rounding_holds_the_exact_filter_and_plain_doubles_do_not(interval_filter):
    """With a point for a box all width is rounding. Doubles without outward rounding are a point beside the truth."""
    differences, readings, _, _ = record(25)
    model = composite_model(TCM2)
    bounds, naive, held, plain = interval_filter(box_of(model, 0.0)), CompositeFilter(model), [], []
    exact = exact_headings(model, differences, readings)
    for difference, second, truth in zip(differences, readings, exact, strict=True):
        low, high = bounds.step(difference, second)
        held.append(Decimal(low) <= truth <= Decimal(high))
        plain.append(Decimal(naive.step(difference, second)) == truth)
    assert all(held) and np.mean(plain) < 0.2
    assert interval_filter is PrintedIntervalFilter or bounds.width < 1e-6


@pytest.mark.parametrize("tolerance", [0.001, 0.01])
def test_every_model_in_the_box_is_included(tolerance):
    differences, readings, _, _ = record(90)
    bounds = IntervalFilter(box_of(composite_model(), tolerance))
    rng = np.random.default_rng(8)
    members = [CompositeFilter(composite_model(random_compass(rng, tolerance))) for _ in range(60)]
    members += [CompositeFilter(composite_model(TCM2.scaled(1.0 + s * tolerance))) for s in (-1, 1)]
    for u, z in zip(differences, readings, strict=True):
        low, high = bounds.step(u, z)
        headings = [each.step(u, z) for each in members]
        assert low <= min(headings) and max(headings) <= high
    assert not bounds.diverged
    spread = max(headings) - min(headings)
    assert spread < bounds.width < 60.0 * spread


def test_erratum_ten_per_cent_diverges_at_once():
    differences, readings, _, _ = record(10)
    for interval_filter in (IntervalFilter, PrintedIntervalFilter):
        bounds = interval_filter(box_of(composite_model(), 0.1, shift_too=True))
        for u, z in zip(differences, readings, strict=True):
            bounds.step(u, z)
        assert bounds.diverged


DEVIATION = math.radians(8.0)
DEVIATIONS = (
    lambda heading, k: (1.0 - 1e-9) * DEVIATION,
    lambda heading, k: -(1.0 - 1e-9) * DEVIATION,
    lambda heading, k: DEVIATION * math.sin(heading),
    lambda heading, k: (1.0 - 1e-9) * DEVIATION * (1.0 if k // 150 % 2 else -1.0),
)


def aboard(yaw, deviation):
    return DeviationBounds(yaw, deviation, math.radians(1.0), math.radians(0.5))


SLOW = HeadingModel((1.0, 0.9945), (2.17e-4, -7.1e-5), (1.0, 1.0))
"""Springer's, with states in rad."""


@pytest.mark.parametrize("yaw", [SLOW, SLOW._replace(poles=(1.0, 0.4))])
def test_bounds_hold_the_filter_of_every_deviation_and_stay_as_wide_as_the_box(yaw):
    """Readings at 10 Hz with pauses, from any first heading; each filter knows one deviation."""
    bounds, filters = aboard(yaw, DEVIATION), [aboard(yaw, 0.0) for _ in DEVIATIONS]
    draws, heading = np.random.default_rng(3), 2.0
    for k in range(1500):
        order = 3.0 * math.sin(0.01 * k)
        heading += 2e-3 * math.sin(1e-3 * k)
        reading = heading + math.radians(1.0) * draws.standard_normal()
        is_there = k % 2 == 0 and k % 400 < 300
        low, high = bounds.step(order, [reading] if is_there else None, 0.05)
        for each, deviation in zip(filters, DEVIATIONS, strict=True):
            held = each.step(order, [reading - deviation(heading, k)] if is_there else None, 0.05)
            assert low <= held[0] <= held[1] <= high
    assert 2.0 * DEVIATION < high - low < 2.6 * DEVIATION
    assert math.degrees(bounds.heading_std) == pytest.approx(math.degrees(high - low) / math.sqrt(12.0), rel=0.2)


def test_one_reading_is_enough_for_bounds_and_none_for_all_round():
    low, high = IntervalFilter(box_of(MODEL, 0.005)).step(0.0, np.array([0.1]))
    assert 0.0 < low < high < 1e-3  # from a heading that is known
    bounds = aboard(SLOW, DEVIATION)
    assert bounds.heading_std > 3.0
    low, high = bounds.step(0.0, [-3.0], 0.025)
    assert low < -3.0 < high and high - low < 2.1 * DEVIATION
    with pytest.raises(InputError, match=r"heading\.deviation is -1"):
        DeviationBounds(SLOW, -1.0, 0.1, 0.1)


@pytest.mark.parametrize("kind", ["aided", "composite", "interval"])
def test_a_heading_aboard_follows_a_turn_through_south(kind):
    aboard = HeadingAboard(kind, heading_model_of((1.0, 0.9), (0.02, -0.02), 0.1, 0.5), 0.5, 2.0)
    for k in range(400):
        true = math.remainder(2.9 + 0.002 * k, 2.0 * math.pi)
        heading, _ = aboard.step(true, 0.2, (2.0 * math.cos(true), 2.0 * math.sin(true)))
    assert -math.pi <= heading < math.pi and true < 0.0
    assert math.remainder(heading - true, 2.0 * math.pi) == pytest.approx(0.0, abs=math.radians(6.0))


def test_a_speed_is_fused_from_rows_that_come_late_and_twice():
    measured = MeasuredSpeed()
    for time in (0.0, 1.0, 0.5, 1.0, 2.0, 1.9, 3.0):
        measured.take(InputRow("any", time, sog=2.0, shaft=9.0))
        measured.take(InputRow("any", time, acceleration=0.0))
    assert measured.speed(3.0) == pytest.approx(2.0, abs=0.1) and measured.shaft == 9.0
    assert math.isnan(measured.speed(60.0))
