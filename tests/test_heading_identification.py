"""Identification of the yaw model from a manoeuvre."""

import math

import numpy as np
import pytest

from steerway.core import InputError
from steerway.identification import identify_heading
from steerway.identification.testing import binary_sequence
from steerway.vessels import RPM, Springer, conditions


def manoeuvre(plant="physical", seconds=900, noise_deg=0.5, bias_rpm=5.0, seed=0, step=1.0):
    """(time, n_d in rpm, heading) of a binary sequence; propellers that follow at once."""
    rng = np.random.default_rng(seed)
    n = round(seconds / step)
    steering = binary_sequence(n, round(20 / step), 100.0, rng)
    vessel = Springer(plant, bias=bias_rpm * RPM)
    state, heading = vessel.start(heading=1.0), np.empty(n)
    for k in range(n):
        heading[k] = vessel.heading(state)
        state[4] = steering[k] * RPM
        state = vessel.step(state, (steering[k] * RPM,), conditions(), step)
    return step * np.arange(n), steering, heading + np.radians(noise_deg) * rng.standard_normal(n)


def test_exact_from_a_clean_record():
    time, steering, heading = manoeuvre(noise_deg=0.0)
    model = identify_heading(time, steering, heading)
    truth = Springer("physical").yaw
    assert model.poles == pytest.approx((1.0, 0.9945), abs=1e-6)
    gains = np.multiply(truth.inputs, truth.outputs)
    np.testing.assert_allclose(model.gains, gains, rtol=1e-4)
    assert model.bias == pytest.approx(5.0, abs=1e-3)
    assert model.fit > 99.99 and model.heading0 == pytest.approx(1.0, abs=1e-4)
    np.testing.assert_allclose(model.run(steering), heading, atol=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_predicts_another_manoeuvre(seed):
    model = identify_heading(*manoeuvre(seed=seed))
    _, steering, heading = manoeuvre(seed=seed + 100, noise_deg=0.0)
    assert np.degrees(np.sqrt(np.mean((model.run(steering) - heading) ** 2))) < 5.0
    assert model.residual_rms == pytest.approx(np.radians(0.5), rel=0.1)


def test_wrapped_gappy_and_offset_headings_say_the_same():
    time, steering, heading = manoeuvre()
    wrapped = np.angle(np.exp(1j * heading))
    wrapped[100:110] = math.nan
    one, other = identify_heading(time, steering, heading), identify_heading(time + 1e6, steering, wrapped)
    np.testing.assert_allclose(one.gains, other.gains, rtol=0.05)


def test_finds_the_paper_plants_unstable_pole():
    model = identify_heading(*manoeuvre("paper", noise_deg=0.05, seconds=600), integrating=False)
    assert model.poles == pytest.approx((1.002, 0.9945), abs=2e-3)


def test_mirrored_steering_mirrors_the_gains_and_rates_are_per_second():
    time, steering, heading = manoeuvre(noise_deg=0.0)
    one, mirrored = identify_heading(time, steering, heading), identify_heading(time, -steering, heading)
    np.testing.assert_allclose(mirrored.gains, np.negative(one.gains), rtol=1e-3)
    half = identify_heading(*manoeuvre(noise_deg=0.0, step=0.5))
    assert half.turn_rate == pytest.approx(one.turn_rate, rel=1e-3)
    assert half.time_constant == pytest.approx(one.time_constant, rel=1e-3)


@pytest.mark.parametrize("change", ["short", "uneven", "still", "unequal"])
def test_unusable_records_are_named(change):
    time, steering, heading = manoeuvre(seconds=100)
    if change == "short":
        time, steering, heading = time[:20], steering[:20], heading[:20]
    elif change == "uneven":
        time[50:] += 5.0
    elif change == "still":
        steering[:] = 1.0
    else:
        heading = heading[:-1]
    with pytest.raises(InputError, match="identify heading"):
        identify_heading(time, steering, heading)
