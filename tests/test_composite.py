"""The composite filter, its bank, its H∞ cousin and the aided filter; and speed and heading of any readings."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steerway.control import AdaptiveSpeed, AdaptiveSpeedGains, ObservedSpeed, SpeedObserverGains
from steerway.core import InputError
from steerway.estimation.heading import (
    AidedHeadingFilter,
    CompositeFilter,
    IntervalFilter,
    LearnedHeading,
    ModelBank,
    box_of,
    composite_model,
    corners,
    grid,
)
from steerway.estimation.testing import PRODUCT, HeadingAboard
from steerway.estimation.testing import heading_model_of as model_of
from steerway.live.testing import InputRow, MeasuredSpeed
from steerway.sensors import TCM2, TRUE_TCM2, random_compass
from steerway.vessels import RPM
from steerway.vessels.testing import PAPER_YAW, PHYSICAL_YAW
from tests.boats import record


def by_matrices(compass, yaw, differences, readings, vehicle_noise=1e-14, start=1e-12):
    """P4 (11)–(15) on point values with NumPy's matrices."""
    a, b, c = yaw.matrices()
    tick, second = np.eye(4), np.eye(4)
    tick[2] = [*(compass.b * np.degrees(c)), compass.a1, compass.a2]
    tick[3] = [0.0, 0.0, compass.shift, 0.0]
    second[:2, :2] = a
    h = np.array([0.0, 0.0, compass.k, 0.0])
    x, p = np.zeros(4), np.diag([start, start, 1.0, 1.0])
    headings = []
    for u, zs in zip(differences, readings, strict=True):
        for z in np.degrees(zs):
            x, p = tick @ x, tick @ p @ tick.T + np.diag([0.0, 0.0, 1.0, 1.0])
            gain = p @ h / (h @ p @ h + 2.0)
            x, p = x + gain * (z - h @ x), p - np.outer(gain, h @ p)
        x = second @ x + np.array([*b, 0.0, 0.0]) * u
        p = second @ p @ second.T + np.diag([vehicle_noise, vehicle_noise, 0.0, 0.0])
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


def test_bank_holds_its_members_and_blends_towards_the_true_one():
    compasses = [*corners(0.01), TRUE_TCM2._replace(shift=1.0)]
    truth = compasses[3]
    differences, readings, _, _ = record(200, truth)
    bank, own = ModelBank(compasses), CompositeFilter(composite_model(truth))
    for u, z in zip(differences, readings, strict=True):
        bank.step(u, z)
        own.step(u, z)
        assert bank.low <= own.heading <= bank.high
    assert bank.headings[3] == pytest.approx(own.heading, rel=1e-12)
    assert bank.weights.argmax() == 3
    assert abs(bank.heading - own.heading) < 0.1 * (bank.high - bank.low)
    assert len(grid(0.01)) == 81 and len(corners(0.01)) == 17


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
FILTERS = {
    "composite": lambda: CompositeFilter(MODEL),
    "bank": lambda: ModelBank(corners(0.01)),
    "aided": AidedHeadingFilter,
    "learned": LearnedHeading,
    "interval": lambda: IntervalFilter(box_of(MODEL, 0.005)),
}
STRANGE = (
    None,
    ["north"],
    np.empty(0),
    np.zeros((2, 20)),
    np.full(130, 20.0),
    np.r_[0.1, math.nan, -0.1],
    np.r_[0.1, math.inf, -1e300],
)


@pytest.mark.parametrize("make", FILTERS.values(), ids=FILTERS)
def test_any_readings_steps_and_times_give_a_heading_with_its_deviation_or_one_sentence(make):
    estimator = make()
    for readings, dt, difference in itertools.product(STRANGE, (1.0, 0.02, 2.5, math.nan), (0.0, 30.0, math.inf)):
        try:
            estimator.step(difference, readings, dt=dt)
        except InputError as refused:
            text = str(refused)
            assert text.startswith("heading.") and "expected" in text and "\n" not in text
    if isinstance(estimator, IntervalFilter):
        assert estimator.diverged or -math.inf < estimator.low <= estimator.high < math.inf
    else:
        assert math.isfinite(estimator.heading)
        assert isinstance(estimator, LearnedHeading) or 0.0 <= estimator.heading_std < math.inf


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


NAN = st.just(math.nan)
SPEED = st.one_of(NAN, st.floats(-30.0, 30.0))
FEW = settings(max_examples=25, deadline=None)


@FEW
@given(
    st.sampled_from([(AdaptiveSpeed, AdaptiveSpeedGains), (ObservedSpeed, SpeedObserverGains)]),
    st.lists(st.tuples(SPEED, SPEED, st.one_of(NAN, st.floats(-50.0, 50.0)), st.floats(0.001, 5.0)), max_size=40),
)
def test_speed_controllers_command_within_the_limits(kind, steps):
    controller, gains = kind
    control = controller(gains(low=-5.0))
    for setpoint, speed, shaft, dt in steps:
        command = control.step(0.0 if math.isnan(setpoint) else setpoint, speed, dt, shaft)
        assert -5.0 <= command <= 17.5


ROW = st.builds(
    lambda time, **read: InputRow("any", time, **read),
    st.floats(-100.0, 1000.0),
    sog=SPEED,
    bottom_speed=SPEED,
    water_speed=SPEED,
    acceleration=st.one_of(NAN, st.floats(-50.0, 50.0)),
    shaft=SPEED,
)


@FEW
@given(st.lists(ROW, max_size=60))
def test_a_fused_speed_is_a_number_with_its_deviation(rows):
    measured = MeasuredSpeed()
    for row in rows:
        measured.take(row)
    assert math.isfinite(measured.fusion.speed) and measured.fusion.speed_std >= 0.0
    assert math.isfinite(measured.fusion.log_scale_std)


VELOCITY = st.tuples(SPEED, SPEED)


@FEW
@given(
    st.sampled_from(["aided", "composite"]), st.lists(st.tuples(SPEED, VELOCITY, st.floats(0.001, 3.0)), max_size=20)
)
def test_heading_aboard_is_an_angle_or_unknown(kind, steps):
    aboard = HeadingAboard(kind, model_of((1.0, 0.9), (0.02, -0.02), 0.1, 0.5), 0.5, 2.0)
    for heading, velocity, dt in steps:
        aboard.order(0.3)
        angle, rate = aboard.step(heading, dt, velocity)
        assert math.isnan(angle) == math.isnan(rate)
        assert math.isnan(angle) or -math.pi <= angle < math.pi + 1e-12
