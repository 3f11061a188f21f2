"""The speed filter against the textbook's matrices, and its honesty on simulated instruments."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.estimation.speed import SurgeFilter, SurgeTuning
from steerway.estimation.speed.testing import BIAS, CURRENT, LEAK, SPEED
from steerway_studies.testing import SENSOR_STDS, Job, PrintedSpeedEkf, judge, plants, printed, run

GATE = 10.8
"""χ² with one degree of freedom at 0.1 %: 10.83."""
TUNING = SurgeTuning(current_walk=0.01, scale_std=0.0)
ROWS = {
    "sog": [1, 0, 0, 0, 0],
    "bottom_speed": [1, 0, 0, 0, 0],
    "water_speed": [1, 0, 0, -1, 0],
    "propeller_speed": [1, 0, 0, -1, 0],
}
STDS = {name: getattr(TUNING, f"{name.removesuffix('_speed')}_std") for name in ROWS}


def van_loan(rates, densities, dt):
    n = len(rates)
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -rates, densities, rates.T
    whole, term = np.eye(2 * n), np.eye(2 * n)
    for order in range(1, 12):
        term = term @ block * (dt / order)
        whole = whole + term
    transition = whole[n:, n:].T
    return transition, transition @ whole[:n, n:]


class ByMatrices:
    """The same filter with x ← F x + G a, P ← F P Fᵀ + Q and the textbook's update."""

    def __init__(self, t):
        self.t = t
        self.x = np.zeros(5)
        self.p = np.diag([400.0, t.bias_std**2, t.leak_std**2, t.current_std**2, t.scale_std**2])

    def predict(self, acceleration, dt):
        t = self.t
        known = np.isfinite(acceleration)
        rates = np.zeros((5, 5))
        rates[LEAK, LEAK] = -1.0 / t.leak_time
        if known:
            rates[SPEED, BIAS] = rates[SPEED, LEAK] = -1.0
        densities = np.diag(
            [
                (t.acceleration_walk if known else t.unmeasured) ** 2,
                2.0 * t.bias_wander**2 / t.bias_time,
                2.0 * t.leak_std**2 / t.leak_time,
                t.current_walk**2,
                0.0,
            ]
        )
        # Van Loan's integral of the noise over a step.
        f, q = van_loan(rates, densities, dt)
        self.x = f @ self.x
        self.x[SPEED] += acceleration * dt if known else 0.0
        self.p = f @ self.p @ f.T + q

    def aid_by(self, **output):
        for name, reading in output.items():
            h = np.array(ROWS[name], dtype=float)
            s = h @ self.p @ h + STDS[name] ** 2
            innovation = reading - h @ self.x
            if innovation**2 > GATE * s:
                continue
            gain = self.p @ h / s
            self.x = self.x + gain * innovation
            self.p = (np.eye(5) - np.outer(gain, h)) @ self.p


def test_it_is_the_filter_of_the_textbook():
    draws = np.random.default_rng(5)
    ours, theirs = SurgeFilter(TUNING), ByMatrices(TUNING)
    for k in range(900):
        acceleration = math.nan if 400 <= k < 440 else 0.3 * math.sin(0.01 * k) + 0.05
        dt = 0.01 * draws.uniform(0.5, 1.5)
        ours.predict(acceleration, dt)
        theirs.predict(acceleration, dt)
        truth = 3.0 + 0.3 * (1.0 - math.cos(0.01 * k))
        for name, every in (("sog", 10), ("bottom_speed", 30), ("water_speed", 20), ("propeller_speed", 50)):
            if k % every == 0 and not (name == "bottom_speed" and k > 500):
                stream = 0.4 if ROWS[name][CURRENT] else 0.0
                output = {name: truth - stream + STDS[name] * draws.standard_normal()}
                ours.aid_by(**output)
                theirs.aid_by(**output)
        if k % 50 == 0:
            np.testing.assert_allclose(ours.state, theirs.x, rtol=1e-9, atol=1e-10)
            np.testing.assert_allclose(ours.covariance, theirs.p, rtol=1e-6, atol=1e-12)
    assert ours.current == pytest.approx(0.4, abs=0.1)


def test_nothing_is_not_a_reading_and_one_in_a_thousand_is_refused():
    estimator = SurgeFilter()
    assert all(math.isnan(each) for each in estimator.aid_by())
    for nis, refused in ((GATE + 0.1, True), (GATE - 0.1, False)):
        estimator = SurgeFilter()
        estimator.aid_by(bottom_speed=3.0)
        before, std = estimator.state, math.hypot(estimator.speed_std, STDS["sog"])
        measured = estimator.aid_by(sog=estimator.speed + math.sqrt(nis) * std)
        assert measured[0] == pytest.approx(nis) and math.isnan(measured[1])
        assert np.array_equal(estimator.state, before) == refused


def test_the_rate_of_prediction_changes_nothing():
    fine, coarse = SurgeFilter(), SurgeFilter()
    for each in (fine, coarse):
        each.aid_by(sog=2.0)
    for _ in range(200):
        fine.predict(0.1, 0.005)
    for _ in range(20):
        coarse.predict(0.1, 0.05)
    np.testing.assert_allclose(fine.state, coarse.state, rtol=1e-9)
    np.testing.assert_allclose(fine.covariance, coarse.covariance, rtol=1e-9, atol=1e-13)


@pytest.fixture(scope="module")
def voyages():
    return [run(Job("ours", seed, 6)) for seed in range(3)]


def test_fused_speed_is_better_than_the_log_and_honest(voyages):
    for found in voyages:
        assert found["rms_pct"] <= 0.025 and found["max_pct"] <= 0.13
        assert found["rms_pct"] * 6.0 / 100.0 <= 0.7 * 0.002
        assert found["exclusions"] == 0
    assert 0.95 < np.mean([found["nis"] for found in voyages]) < 1.05
    assert 0.93 < np.mean([found["coverage"] for found in voyages]) < 0.97


def test_control_by_the_fused_speed_meets_the_requirements(voyages):
    for found in voyages:
        assert found["settling_s"] <= 36.0 and found["overshoot_pct"] <= 0.3 and found["tail_pct"] <= 0.3


def test_gps_and_accelerometer_do_without_the_log():
    found = run(Job("gps_only", 0, 6))
    assert found["rms_pct"] <= 0.15 and 0.85 < found["nis"] < 1.15


def test_the_water_track_finds_the_current():
    found = run(Job("water_track", 0, 6))
    assert found["max_pct"] <= 0.4 and found["current_found_s"] <= 10.0


def test_an_identified_model_bridges_an_outage():
    assert run(Job("outage", 0))["max_pct"] <= 0.6


@pytest.fixture(scope="module")
def track():
    return printed.sail_true(plants.plant("T"), plants.controller("a"), 3, 40.0, 0.001, 0.05)


def test_erratum_28_as_printed_diverges(track):
    def error(printed_sign):
        time, truth, estimate, _, _ = printed.filtered(track, 0, imu=None, printed_sign=printed_sign)
        return np.abs(estimate - truth)[time > judge.TRANSIENT].max()

    assert error(printed_sign=False) < 0.03
    assert error(printed_sign=True) > 30.0


def test_erratum_an_accelerometer_is_no_speed_sensor(track):
    time, truth, estimate, _, _ = printed.filtered(track, 0, imu="integrated")
    assert np.abs(estimate - truth)[time > judge.TRANSIENT].max() > 0.3


def test_erratum_27_the_slope_takes_the_size_of_the_speed():
    """With |u| the covariance shrinks whichever way the boat goes."""
    right, wrong = (PrintedSpeedEkf(printed=each, density=0.0, speed=-3.0) for each in (False, True))
    right.predict(0.0, 1.0)
    wrong.predict(0.0, 1.0)
    assert right.variance < 1.0 < wrong.variance


def test_printed_sensors_taken_in_turn_are_the_joint_update():
    ekf = PrintedSpeedEkf(printed=False, speed=2.0, variance=0.01)
    readings = (2.2, 2.1, 2.15)
    stds = (*SENSOR_STDS[:2], 0.05)
    c, r = np.ones((3, 1)), np.diag(np.square(stds))
    gain = 0.01 * c.T @ np.linalg.inv(0.01 * c @ c.T + r)
    expected = 2.0 + (gain @ (np.array(readings) - 2.0)).item()
    for reading, std in zip(readings, stds, strict=True):
        ekf.update(reading, std)
    assert ekf.speed == pytest.approx(expected, rel=1e-9)


def test_bad_input_is_named():
    with pytest.raises(InputError, match=r"surge\.sog_std is 0"):
        SurgeTuning(sog_std=0.0)
    with pytest.raises(InputError, match=r"surge\.current_walk is -1"):
        SurgeTuning(current_walk=-1.0)


@pytest.mark.parametrize("through_water", [False, True])
def test_the_log_s_scale_is_found_against_the_receiver(through_water):
    """Half a per cent while the speed changes slowly, in a current where the log sees the water."""
    estimator, draws = SurgeFilter(), np.random.default_rng(3)
    stream = 0.4 if through_water else 0.0
    for k in range(12_000):
        phase = 0.02 * 0.05 * k
        speed = 5.0 + 2.0 * math.sin(phase)
        estimator.predict(0.04 * math.cos(phase), 0.05)
        estimator.aid_by(sog=speed + 0.03 * draws.standard_normal())
        reading = 1.005 * (speed - stream) + 0.002 * draws.standard_normal()
        estimator.aid_by(**{"water_speed" if through_water else "bottom_speed": reading})
    assert estimator.log_scale == pytest.approx(1.005, abs=4.0 * estimator.log_scale_std)
    if through_water:  # a scale error and a current look alike
        assert estimator.log_scale_std > 0.002
    else:
        assert estimator.log_scale_std < 0.0002
    assert abs(estimator.speed - speed) < 4.0 * estimator.speed_std
    assert estimator.current == pytest.approx(stream, abs=0.04)


def test_a_log_without_a_scale_error_has_none():
    estimator = SurgeFilter(SurgeTuning(scale_std=0.0))
    estimator.predict(0.0, 0.1)
    estimator.aid_by(sog=3.0, bottom_speed=3.1)
    assert estimator.log_scale == 1.0 and estimator.log_scale_std == 0.0
