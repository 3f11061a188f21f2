"""Compass, log, gyro and accelerometer: the same in a record and in the loop, and wrong by what was asked for."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.sensors import Compass, DopplerLog, Instrument, accelerometer, gyro
from steerway.sensors.testing import Clock, epochs

TIME = 1.7e9 + 0.02 * np.arange(20_001)
WOBBLY = Instrument(rate=7.0, white=0.1, bias=0.3, turn_on_std=0.2, wander=(0.1, 20.0), scale=1.1)


def streamed(stream, *truth):
    """Times and readings of an instrument asked at every step."""
    rows = zip(TIME.tolist(), *(column.tolist() for column in truth), strict=True)
    readings = [(row[0], stream.step(*row)) for row in rows]
    return tuple(zip(*[(time, reading) for time, reading in readings if reading is not None], strict=True))


def test_an_instrument_is_the_same_in_a_record_and_in_the_loop():
    value = np.sin(0.01 * TIME)
    time, reading = WOBBLY.measured(TIME, value, 3)
    np.testing.assert_array_equal((time, reading), streamed(WOBBLY.start(3), value))
    assert len(time) == 1 + math.floor(400.0 * 7.0)


def test_a_compass_is_the_same_in_a_record_and_in_the_loop():
    compass = Compass(WOBBLY, deviation=(0.1, 0.2, 0.3, 0.04, 0.05))
    heading = np.linspace(-6.0, 6.0, len(TIME))
    time, reading = compass.measured(TIME, heading, 3)
    np.testing.assert_array_equal((time, reading), streamed(compass.start(3), heading))
    assert reading.min() >= -math.pi and reading.max() < math.pi


def test_a_log_is_the_same_in_a_record_and_in_the_loop():
    log = DopplerLog(WOBBLY)
    time, surge, sway = log.measured(TIME, np.cos(TIME), np.sin(TIME), 3)
    times, readings = streamed(log.start(3), np.cos(TIME), np.sin(TIME))
    np.testing.assert_array_equal((time, surge, sway), (times, *zip(*readings, strict=True)))
    assert abs(np.corrcoef(surge - np.cos(time), sway - np.sin(time))[0, 1]) < 0.9


def test_a_clock_that_does_not_land_on_its_tenths_loses_none():
    """Steps of 0.02 s that jitter by 10 µs, around a reading every 0.1 s."""
    time = 1.7e9 + 0.02 * np.arange(5001) + np.random.default_rng(0).uniform(-1e-5, 1e-5, 5001)
    clock = Clock(rate=10.0)
    due = [k for k, t in enumerate(time.tolist()) if clock.due(t)]
    np.testing.assert_array_equal(due, np.arange(0, 5001, 5))
    np.testing.assert_array_equal(due, epochs(time, 10.0))


def test_noise_bias_and_scale_have_their_size():
    errors = Instrument(rate=50.0, white=0.2, bias=0.5).measured(TIME, 0.0, 1)[1]
    assert errors.mean() == pytest.approx(0.5, abs=0.01) and errors.std() == pytest.approx(0.2, rel=0.03)
    np.testing.assert_allclose(Instrument(rate=50.0, scale=1.1).measured(TIME, 2.0, 1)[1], 2.2)
    turn_on = [Instrument(turn_on_std=0.3).measured(TIME[:1], 0.0, seed)[1][0] for seed in range(500)]
    assert np.std(turn_on) == pytest.approx(0.3, rel=0.1) and abs(np.mean(turn_on)) < 0.05
    wander = Instrument(rate=50.0, wander=(0.3, 1.0)).measured(TIME, 0.0, 1)[1]
    assert wander.std() == pytest.approx(0.3, rel=0.1)
    assert np.corrcoef(wander[50:], wander[:-50])[0, 1] == pytest.approx(math.exp(-1.0), abs=0.1)


def test_a_compass_deviates_by_its_card():
    exact = Instrument(rate=50.0)
    heading = math.radians(30.0)
    for k, expected in enumerate((1.0, 0.5, math.sqrt(0.75), math.sqrt(0.75), 0.5)):
        card = tuple(0.1 * (i == k) for i in range(5))
        reading = Compass(exact, card).measured(TIME[:1], [heading], 0)[1][0]
        assert reading - heading == pytest.approx(0.1 * expected)


def test_data_sheets_are_read_in_their_units():
    assert gyro(rate=100.0, noise_density_deg=0.01).white == pytest.approx(math.radians(0.1))
    assert gyro(in_run_deg_hour=36.0).wander[0] == pytest.approx(math.radians(0.01))
    assert accelerometer(rate=100.0, noise_density_micro_g=60.0).white == pytest.approx(600e-6 * 9.80665)
    assert accelerometer(turn_on_milli_g=5.0).turn_on_std == pytest.approx(0.0490, abs=1e-4)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"rate": 0.0}, "rate is 0.0"),
        ({"white": -1.0}, "white is -1.0"),
        ({"wander": (1.0, 0.0)}, "time constant of 0"),
    ],
)
def test_bad_input_is_named(arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        Instrument(**arguments)
