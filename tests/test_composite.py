"""The composite filter, its bank, its H∞ cousin and the aided filter, against the textbook and against each other."""

import math

import numpy as np
import pytest

from steerway.core import InputError
from steerway.estimation.heading import (
    SCALE_ONLY,
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
from steerway_studies.testing import HInfinityFilter, exists, largest_theta
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
    return np.array(headings), x, p


def test_innovation_is_reading_less_prediction():
    estimator, bank = CompositeFilter(composite_model()), ModelBank(corners(0.01))
    for each in (estimator, bank):
        each.step(0.0, np.full(40, 0.1))
        assert 0.0 < each.innovation < np.degrees(0.1)
    assert estimator.innovation == pytest.approx(bank.innovation)


@pytest.mark.parametrize("compass", [TCM2, TRUE_TCM2])
@pytest.mark.parametrize("yaw", [PAPER_YAW, PHYSICAL_YAW])
def test_composite_is_the_kalman_filter(compass, yaw):
    differences, readings, _, _ = record()
    estimator = CompositeFilter(composite_model(compass, yaw))
    headings = [estimator.step(u, z) for u, z in zip(differences, readings, strict=True)]
    expected, x, p = by_matrices(compass, yaw, differences, readings)
    np.testing.assert_allclose(headings, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(estimator._state, x, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(estimator._covariance, p, rtol=1e-8, atol=1e-20)


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


def test_h_infinity_is_the_kalman_filter_at_theta_zero_and_ends_somewhere():
    model = composite_model()
    differences, readings, _, _ = record()
    one, other = HInfinityFilter(model, 0.0), CompositeFilter(model)
    for u, z in zip(differences, readings, strict=True):
        assert one.step(u, z) == pytest.approx(other.step(u, z), rel=1e-12, abs=1e-15)
    largest = largest_theta(model, horizon=100)
    assert exists(model, largest, horizon=100) and not exists(model, 1.05 * largest, horizon=100)
    with pytest.raises(InputError, match="theta"):
        HInfinityFilter(model, 1e9)


def test_h_infinity_step_is_the_information_form():
    """P ← (P⁻¹ − θ CᵀC)⁻¹."""
    from steerway_studies.testing import _inflate

    model, rng = composite_model(), np.random.default_rng(0)
    root = rng.standard_normal((4, 4)) * [1e-6, 1e-6, 1.0, 1.0]
    p = root.T @ root + np.diag([1e-13, 1e-13, 1.0, 1.0])
    c = np.array([*np.degrees(PAPER_YAW.outputs), 0.0, 0.0])
    theta = 0.5 / (c @ p @ c)
    expected = np.linalg.inv(np.linalg.inv(p) - theta * np.outer(c, c))
    assert _inflate(p, model, theta)
    np.testing.assert_allclose(p, expected, rtol=1e-6, atol=1e-20)


def test_scale_state_finds_the_gain():
    differences, readings, headings, _ = record(300)
    estimator, errors = AidedHeadingFilter(SCALE_ONLY, TCM2, PAPER_YAW), []
    for u, z, heading in zip(differences, readings, headings, strict=True):
        errors.append(estimator.heading - heading)
        estimator.step(u, z)
    assert estimator.scale == pytest.approx(TRUE_TCM2.gain, abs=4.0 * estimator.scale_std + 0.005)
    assert np.degrees(np.sqrt(np.mean(np.square(errors)))) < 0.05


def test_without_unknowns_the_aided_filter_is_the_composite_one():
    known = HeadingTuning(1e-7, 1e-6, *[(0.0, 0.0)] * 4, water_speed=(0.0, 0.0))
    differences, readings, _, _ = record(compass=TCM2)
    one, other = AidedHeadingFilter(known, TCM2, PAPER_YAW), CompositeFilter(composite_model())
    for u, z in zip(differences, readings, strict=True):
        # The gate of the aided filter refuses a reading in a thousand: with the true compass the heading hardly moves.
        assert one.step(u, z) == pytest.approx(other.step(u, z), abs=2e-6)


def derivative(function, x, steps):
    return np.stack([(function(x + s) - function(x - s)) / (2.0 * s.sum()) for s in np.diag(steps)], axis=-1)


def test_aided_filter_predicts_its_covariance_by_the_true_jacobian():
    from steerway.estimation.heading.testing import STATES, predict_compass, predict_vehicle

    estimator, rng = AidedHeadingFilter(), np.random.default_rng(4)
    model = estimator._model
    x = rng.standard_normal(STATES) * [0.02, 0.02, 500.0, 500.0, 1.0, 0.2, 3.0, 3.0, 0.2, 0.2, 0.1]
    x[5] += 1.0
    steps = np.array([1e-6, 1e-6, 1e-2, 1e-2, 1e-4, 1e-5, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4])

    def compass(state):
        state = state.copy()
        predict_compass(state, np.eye(STATES), np.empty(STATES), model)
        return state

    def vehicle(state):
        state = state.copy()
        predict_vehicle(state, np.eye(STATES), model, 3.0, np.zeros(7))
        return state

    root = rng.standard_normal((STATES, STATES))
    p = root @ root.T
    jacobian = derivative(compass, x, steps)
    predicted = p.copy()
    predict_compass(x.copy(), predicted, np.empty(STATES), model)
    noise = np.diag([0.0, 0.0, 1.0, 1.0, *[0.0] * 7])
    np.testing.assert_allclose(predicted, jacobian @ p @ jacobian.T + noise, rtol=1e-5, atol=1e-4)
    jacobian, predicted = derivative(vehicle, x, steps), p.copy()
    predict_vehicle(x.copy(), predicted, model, 3.0, np.full(7, 0.25))
    noise = np.diag([model[11]] * 2 + [0.0, 0.0] + [0.25] * 7)
    np.testing.assert_allclose(predicted, jacobian @ p @ jacobian.T + noise, rtol=1e-6, atol=1e-8)


def test_gnss_velocity_corrects_like_the_textbook():
    from steerway.estimation.heading.testing import STATES, take_velocity

    estimator, rng = AidedHeadingFilter(), np.random.default_rng(5)
    x = np.zeros(STATES)
    x[0], x[8], x[9], x[10] = 0.02, 0.1, -0.1, 1.5
    root = 0.01 * rng.standard_normal((STATES, STATES))
    p = root @ root.T
    psi = PHYSICAL_YAW.outputs[0] * x[0]
    output = 1.5 * np.array([math.cos(psi), math.sin(psi)]) + x[8:10] + [0.05, -0.02]
    mine, covariance = x.copy(), p.copy()
    take_velocity(mine, covariance, np.empty((2, STATES)), estimator._model, *output, 0.01)
    for axis in range(2):
        psi = float(np.dot(PHYSICAL_YAW.outputs, x[:2]))
        direction = (math.cos(psi), math.sin(psi))
        slope = (-math.sin(psi), math.cos(psi))[axis]
        h = np.zeros(STATES)
        h[:2] = x[10] * slope * np.array(PHYSICAL_YAW.outputs)
        h[8 + axis], h[10] = 1.0, direction[axis]
        gain = p @ h / (h @ p @ h + 0.01)
        x, p = x + gain * (output[axis] - x[10] * direction[axis] - x[8 + axis]), p - np.outer(gain, h @ p)
    np.testing.assert_allclose(mine, x, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(covariance, p, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_product_filter_finds_bias_scale_and_current(seed):
    rng = np.random.default_rng(seed)
    compass = random_compass(rng)
    data = record(900, compass, "physical", (0.1, -0.15), seed, effectiveness=1.1, bias=10.0 * RPM)
    estimator, errors = AidedHeadingFilter(PRODUCT), []
    for u, z, heading, velocity in zip(*data, strict=True):
        errors.append(estimator.heading - heading)
        estimator.step(u, z, velocity)
    assert np.degrees(np.median(np.abs(errors[100:]))) < 2.0
    assert estimator.bias == pytest.approx(10.0 * RPM, abs=4.0 * RPM)
    assert estimator.scale == pytest.approx(compass.gain / TCM2.gain, abs=0.1)
    assert np.hypot(*np.subtract(estimator.current, (0.1, -0.15))) < 0.08


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


def test_steering_for_a_course_in_the_estimated_current():
    estimator = AidedHeadingFilter()
    estimator._best.state[8:] = 0.3, -0.4, 1.5
    for course in np.radians([0.0, 50.0, 200.0]):
        psi = estimator.heading_for(course)
        made = np.array([0.3, -0.4]) + 1.5 * np.array([math.cos(psi), math.sin(psi)])
        assert math.remainder(math.atan2(made[1], made[0]) - course, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)
    estimator._best.state[10] = 0.1  # the current is stronger: against it
    assert math.isfinite(estimator.heading_for(0.0))
