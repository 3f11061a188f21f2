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


STEP, BEGIN = 0.02, 30.0


def sail(gps=0.0, log=0.0, ramp=0.0, current=None, third=3.1):
    """3 m/s for a minute at 50 Hz, GPS and log at 10 Hz; from BEGIN on they are off, the log drifts, a current runs.

    With a current, the log measures the speed through the water.
    """
    fusion, errors, time = SurgeFusion(), [], STEP * np.arange(1, 3001)
    noise = np.random.default_rng(0).standard_normal((3000, 3)) * (60e-6 * 9.80665 / math.sqrt(STEP), 0.03, 0.002)
    for k, (felt, of_gps, of_log) in enumerate(noise):
        late = max(0.0, time[k] - BEGIN)
        aids = {"sog": 3.0 + of_gps + gps * (late > 0.0)} if k % 5 == 0 else {}
        if k % 5 == 2:
            kind = "bottom_speed" if current is None else "water_speed"
            aids[kind] = 3.0 + of_log + (log - (current or 0.0)) * (late > 0.0) + ramp * late
        fusion.step(0.02 + felt, STEP, reference=third, **aids)
        errors.append(fusion.speed - 3.0)
    return fusion, time, np.abs(errors)


def names(fusion):
    return [(event.instrument, event.what) for event in fusion.events]


@pytest.mark.parametrize(
    ("fault", "guilty", "within", "most"),
    [
        ({"log": 0.1}, "bottom_speed", 3.0, 0.03),
        ({"ramp": 0.005}, "bottom_speed", 12.0, 0.06),
        ({"gps": 0.3}, "sog", 2.0, 0.009),
        ({"gps": -0.3}, "sog", 2.0, 0.009),
    ],
)
def test_the_guilty_one_is_named_soon(fault, guilty, within, most):
    fusion, time, errors = sail(**fault)
    assert names(fusion) == [(guilty, "excluded")]
    assert BEGIN < fusion.events[0].time < BEGIN + within
    assert fusion.excluded == guilty
    assert errors[time > BEGIN].max() <= most


def test_without_a_third_instrument_the_accelerometer_tells_sudden_faults_and_a_current_is_none():
    fusion, _, errors = sail(log=0.1, third=math.nan)
    assert names(fusion) == [("bottom_speed", "excluded")] and errors.max() < 0.25
    fusion, _, _ = sail(ramp=0.005, third=math.nan)
    assert fusion.excluded is None and fusion.events == []
    fusion, time, errors = sail(current=0.5)
    assert fusion.current == pytest.approx(0.5, abs=0.05)
    assert names(fusion) == [] and errors[time > 10.0].max() < 0.03
