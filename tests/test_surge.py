"""Speed along the hull: the filter against the textbook's matrices, and what the fusion does with liars."""

import math

import numpy as np
import pytest

from steerway.estimation.speed import SurgeFilter, SurgeFusion
from steerway_studies.testing import PrintedSpeedEkf


def test_errata_27_and_28_the_slope_takes_the_size_of_the_speed_and_the_innovation_the_difference():
    """With |u| the covariance shrinks whichever way the boat goes; a reading as expected changes nothing."""
    right, wrong = (PrintedSpeedEkf(printed=each, density=0.0, speed=-3.0) for each in (False, True))
    right.predict(0.0, 1.0)
    wrong.predict(0.0, 1.0)
    assert right.variance < 1.0 < wrong.variance
    before, gain = (right.speed, wrong.speed), wrong.variance / (wrong.variance + 0.25)
    right.update(right.speed, 0.5)
    wrong.update(wrong.speed, 0.5)
    assert (right.speed, wrong.speed) == pytest.approx((before[0], before[1] * (1.0 + 2.0 * gain)))


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


STEP = 0.02


def sail(fault, seed=0, seconds=60.0, fusion=None, third=3.1, log="bottom_speed", stream=None):
    """3 m/s for a while at 50 Hz, GPS and log at 10 Hz. `fault(t)` adds to (acceleration, GPS, log)."""
    fusion = fusion or SurgeFusion()
    draws = np.random.default_rng(seed)
    n = round(seconds / STEP)
    noise = draws.standard_normal((n, 3)) * (60e-6 * 9.80665 / math.sqrt(STEP), 0.03, 0.002)
    errors = []
    for k in range(n):
        time = (k + 1) * STEP
        felt, gps, doppler = noise[k] + fault(time)
        output = {}
        if k % 5 == 0:
            output["sog"] = 3.0 + gps
        if k % 5 == 2:
            output[log] = 3.0 + doppler - (stream(time) if stream else 0.0)
        fusion.step(0.02 + felt, STEP, reference=third(time) if callable(third) else third, **output)
        errors.append(fusion.speed - 3.0)
    return fusion, STEP * np.arange(1, n + 1), np.array(errors)


def after(begin, *what):
    return lambda time: np.array(what) if time > begin else np.zeros(3)


def ramp(begin, rate):
    return lambda time: np.array([0.0, 0.0, rate * max(0.0, time - begin)])


def names(fusion):
    return [(event.instrument, event.what) for event in fusion.events]


@pytest.mark.parametrize(
    ("fault", "guilty", "within", "most"),
    [
        (after(30.0, 0.0, 0.0, 0.1), "bottom_speed", 3.0, 0.03),
        (ramp(30.0, 0.005), "bottom_speed", 12.0, 0.06),
        (after(30.0, 0.0, 0.3, 0.0), "sog", 2.0, 0.009),
        (after(30.0, 0.0, -0.3, 0.0), "sog", 2.0, 0.009),
    ],
)
def test_the_guilty_one_is_named_soon(fault, guilty, within, most):
    fusion, time, errors = sail(fault)
    assert names(fusion) == [(guilty, "excluded")]
    assert 30.0 < fusion.events[0].time < 30.0 + within
    assert fusion.excluded == guilty
    assert np.abs(errors[time > 30.0]).max() <= most


def test_without_a_third_instrument_the_accelerometer_tells_sudden_faults():
    fusion, _, errors = sail(after(30.0, 0.0, 0.0, 0.1), third=math.nan)
    assert names(fusion) == [("bottom_speed", "excluded")] and np.abs(errors).max() < 0.25
    fusion, _, _ = sail(ramp(30.0, 0.005), third=math.nan)
    assert fusion.excluded is None and fusion.events == []


def test_a_current_that_begins_is_found_and_not_taken_for_a_fault():
    fusion, time, errors = sail(after(1e9, 0, 0, 0), log="water_speed", stream=lambda time: 0.5 if time > 30.0 else 0.0)
    assert fusion.current == pytest.approx(0.5, abs=0.05)
    assert names(fusion) == [] and np.abs(errors[time > 10.0]).max() < 0.03
