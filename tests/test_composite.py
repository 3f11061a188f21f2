"""The composite filter, its bank, its H∞ cousin and the aided filter, against the textbook and against each other."""

import math

import numpy as np
import pytest

from steerway.core import InputError
from steerway.estimation.heading import (
    AidedHeadingFilter,
    CompositeFilter,
    HeadingTuning,
    ModelBank,
    composite_model,
    corners,
    grid,
)
from steerway.estimation.heading.testing import PRODUCT
from steerway.sensors import TCM2, TRUE_TCM2, random_compass
from steerway.vessels import RPM
from steerway.vessels.testing import PAPER_YAW, PHYSICAL_YAW
from tests.weaving import record


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


def test_true_model_is_consistent_and_nominal_is_not():
    nis, errors = {}, {}
    for name, compass in {"true": TRUE_TCM2, "nominal": TCM2}.items():
        differences, readings, headings, _ = record(400)
        estimator, values, wrong = CompositeFilter(composite_model(compass)), [], []
        for u, z, heading in zip(differences, readings, headings, strict=True):
            wrong.append(estimator.heading - heading)
            estimator.step(u, z)
            values.append(estimator.nis)
        nis[name], errors[name] = np.mean(values), np.degrees(np.sqrt(np.mean(np.square(wrong))))
    assert nis["true"] == pytest.approx(1.0, abs=0.02)
    assert errors["true"] < 0.05 and errors["nominal"] > 3.0 * errors["true"]


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


@pytest.mark.parametrize("wrong", [{"velocity_std": 0.0}, {"scale": (-1.0, 0.0)}, {"vehicle_std": math.nan}])
def test_unusable_tunings_are_named(wrong):
    with pytest.raises(InputError, match="heading_tuning"):
        HeadingTuning(**wrong)


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
