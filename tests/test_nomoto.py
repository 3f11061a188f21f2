"""Nomoto's vessel against the solution of her equation."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.vessels import CALM, Actuator, Nomoto, conditions
from steerway.vessels.testing import nomoto_derivatives as derivatives


def sail(vessel, state, rudder, seconds, weather=CALM, step=0.05):
    for _ in range(round(seconds / step)):
        state = vessel.step(state, (rudder,), weather, step)
    return state


def test_the_step_response_is_the_known_one():
    gain, time_constant, rudder, bias = 0.2, 8.0, 0.3, -0.05
    state = sail(Nomoto(gain, time_constant, 2.0, bias), np.zeros(5), rudder, 20.0)
    rate = gain * (rudder + bias)
    left = math.exp(-20.0 / time_constant)
    assert state[3] == pytest.approx(rate * (1.0 - left), rel=1e-9)
    assert state[2] == pytest.approx(rate * (20.0 - time_constant * (1.0 - left)), rel=1e-9)


def test_derivatives_are_the_equation():
    rates = derivatives([0.0, 0.0, 0.5, 0.1, 0.0], 0.3, gain=0.2, time_constant=8.0, speed=2.0, bias=0.1)
    np.testing.assert_allclose(rates, [2 * math.cos(0.5), 2 * math.sin(0.5), 0.1, (0.2 * 0.4 - 0.1) / 8.0, 0.0])


def test_she_sails_a_circle_to_starboard():
    vessel = Nomoto(gain=0.5, time_constant=1e-1, speed=3.0)
    state = sail(vessel, vessel.start(), 0.4, 5.0)
    centre = state[:2] + 3.0 / 0.2 * np.array([-math.sin(state[2]), math.cos(state[2])])
    for _ in range(5):
        state = sail(vessel, state, 0.4, 5.0)
        assert np.hypot(*(state[:2] - centre)) == pytest.approx(15.0, rel=1e-6)
    assert centre[1] > 10.0


def test_the_rudder_obeys_its_limits_rate_and_lag():
    rudder = Actuator("rudder", -0.5, 0.6, rate=0.1, lag=1.0)
    vessel = Nomoto(0.2, 8.0, 2.0, actuator=rudder)
    assert sail(vessel, np.zeros(5), 2.0, 3.0)[4] == pytest.approx(0.3)
    assert sail(vessel, np.zeros(5), 2.0, 60.0)[4] == pytest.approx(0.6)
    assert sail(vessel, np.zeros(5), -2.0, 60.0)[4] == pytest.approx(-0.5)
    ideal = Nomoto(0.2, 8.0, 2.0, actuator=Actuator("rudder", -0.5, 0.6))
    assert sail(ideal, np.zeros(5), 2.0, 0.05)[4] == 0.6


def test_motion_says_what_the_track_does_in_a_current():
    vessel, weather = Nomoto(0.5, 2.0, 3.0), conditions(current=(0.5, -1.0))
    state = sail(vessel, vessel.start(heading=1.0), 0.4, 7.0, weather)
    now, h = vessel.motion(state, weather), 1e-4
    ahead = vessel.motion(vessel.step(state, (0.4,), weather, h), weather)
    assert (ahead.north - now.north) / h == pytest.approx(now.north_velocity, rel=1e-3)
    assert (ahead.east - now.east) / h == pytest.approx(now.east_velocity, rel=1e-3)
    assert (ahead.cog - now.cog) / h == pytest.approx(now.course_rate, rel=1e-3)
    assert now.water_speed == 3.0 and now.sideslip == 0.0
    assert now.crab_angle != 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [((0.0, 1.0, 1.0), "gain is 0.0"), ((1.0, 0.0, 1.0), "time_constant is 0.0"), ((1.0, 1.0, -1.0), "speed is -1.0")],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(InputError, match=message):
        Nomoto(*arguments)


def test_she_has_one_speed():
    with pytest.raises(InputError, match="one speed"):
        Nomoto(1.0, 1.0, 2.0).start(speed=3.0)
