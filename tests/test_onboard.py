"""Measurements into an estimate: the heading between compass readings, the filter in the loop, true states."""

import math

import numpy as np

from steerway.core import wrap
from steerway.estimation.testing import HeadingTracker


def turned(tracker, rate, seconds, gyro=False, noise=0.0, every=5, dt=0.02):
    """(heading error, yaw rate) of a tracker on a boat that turns at a constant rate across south."""
    rng = np.random.default_rng(2)
    errors, rates = [], []
    for k in range(round(seconds / dt)):
        true = wrap(3.0 + rate * k * dt)
        heading = true + noise * rng.standard_normal() if k % every == 0 else math.nan
        output, yaw_rate = tracker.step(wrap(heading) if k % every == 0 else math.nan, rate if gyro else math.nan, dt)
        errors.append(wrap(output - true))
        rates.append(yaw_rate)
    return np.array(errors), np.array(rates)


def test_a_steady_turn_is_tracked_without_a_lag():
    errors, rates = turned(HeadingTracker(), 0.2, 20.0)
    assert np.max(np.abs(errors[500:])) < 1e-6 and np.max(np.abs(rates[500:] - 0.2)) < 1e-6
    assert np.max(np.abs(errors)) < 0.1  # across south


def test_a_gyro_tells_the_rate_at_once_and_noise_is_smoothed():
    errors, rates = turned(HeadingTracker(), 0.2, 2.0, gyro=True)
    assert np.max(np.abs(errors)) < 1e-9 and np.all(rates == 0.2)
    errors, _ = turned(HeadingTracker(), 0.0, 60.0, noise=0.01)
    assert errors[500:].std() < 0.006


def test_a_compass_that_falls_silent_is_no_longer_believed():
    tracker = HeadingTracker(patience=1.0)
    assert all(map(math.isnan, tracker.step(math.nan, math.nan, 0.1)))
    assert tracker.step(1.0, math.nan, 0.1) == (1.0, 0.0)
    for _ in range(9):
        assert tracker.step(math.nan, math.nan, 0.1)[0] == 1.0
    for _ in range(3):
        output = tracker.step(math.nan, math.nan, 0.1)
    assert all(map(math.isnan, output))
    assert tracker.step(-2.0, math.nan, 0.1) == (-2.0, 0.0)
