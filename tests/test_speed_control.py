"""The adaptive speed loop on boats of all sizes, and P3's own as printed."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.control import (
    AdaptiveSpeed,
    AdaptiveSpeedGains,
    ForceLoop,
    ObservedSpeed,
    SpeedObserverGains,
    SpeedPI,
    SpeedPIGains,
    speed_loop,
)
from steerway.vessels import CALM, Surge
from steerway_studies.testing import printed, sailing


@pytest.mark.parametrize(("name", "setpoint"), [("a", 6), ("T", 9), ("b", 3)])
def test_boats_settle_without_overshoot(name, setpoint):
    track = printed.sail_true(sailing.plant(name), sailing.controller(name), setpoint, 120.0, 0.01, 0.05)
    found = sailing.response(track.time, track.speed, track.shaft, setpoint)
    assert found["settling_s"] <= 35.0
    assert found["overshoot_pct"] <= 0.05 and found["tail_pct"] <= 0.05 and found["shaft_max"] <= 17.5
    assert track.speed[-1] == pytest.approx(setpoint, abs=1e-3)


def test_a_speed_out_of_reach_teaches_nothing():
    """At 12 m/s the shaft stays at its limit; a set-point of 3 m/s afterwards is reached as without that."""
    boat, control = sailing.plant("a"), sailing.controller("a")
    state, speeds = boat.start(), []
    for k in range(round(260.0 / 0.05)):
        setpoint = 12.0 if k * 0.05 < 120.0 else 3.0
        command = control.step(setpoint, state[3], 0.05, state[4])
        assert 0.0 <= command <= 17.5
        state = boat.step(state, (command,), np.zeros(5), 0.05)
        speeds.append(state[3])
    assert max(speeds) == pytest.approx(10.59, abs=0.02)
    assert speeds[-1] == pytest.approx(3.0, abs=0.003)
    late = np.array(speeds[round(120.0 / 0.05) :])
    assert late.min() > 2.9


def test_parameters_stay_within_their_bounds_and_it_is_reported():
    control = AdaptiveSpeed(AdaptiveSpeedGains(adaptation=1e4))
    low, high = control.gains.bounds()
    assert not control.at_bounds
    for k in range(400):
        control.step(3.0, 3.0 + 2.0 * math.sin(0.1 * k), 0.05)
        assert (low <= control.parameters).all() and (control.parameters <= high).all()
    assert control.at_bounds


def test_a_slow_shaft_is_driven_harder_than_it_is_to_go():
    gains = AdaptiveSpeedGains(shaft_lag=10.0)
    assert AdaptiveSpeed(gains).step(3.0, 3.0, 0.05, 3.0) > AdaptiveSpeed().step(3.0, 3.0, 0.05, 3.0) > 3.0
    assert AdaptiveSpeed(gains).step(3.0, 3.0, 0.05) == AdaptiveSpeed().step(3.0, 3.0, 0.05)


def test_a_restart_forgets_and_the_first_step_sets_out_from_the_boat_s_speed():
    control, fresh = AdaptiveSpeed(), AdaptiveSpeed()
    for _ in range(50):
        control.step(3.0, 1.0, 0.05)
    control.restart()
    assert control.step(6.0, 4.0, 0.05) == fresh.step(6.0, 4.0, 0.05)
    assert control.model == fresh.model and 4.0 < control.model < 4.03


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"model_rate": 0.0}, "speed.model_rate is 0"),
        ({"adaptation": -1.0}, "speed.adaptation is -1"),
        ({"high": 0.0}, "speed.high is 0"),
        ({"reach": 0.0}, "speed.reach is 0"),
        ({"thrust": 1e-9}, r"top speed of 0\.00.* expected 0.05 to 60 m/s"),
        ({"linear_drag": 0.0, "quadratic_drag": 0.0}, "top speed of inf m/s"),
        ({"thrust": 500.0, "quadratic_drag": 100.0}, "reaches the top speed in"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(InputError, match=message):
        AdaptiveSpeedGains(**arguments)


BOTH = pytest.mark.parametrize(
    ("control", "gains"), [(AdaptiveSpeed, AdaptiveSpeedGains), (ObservedSpeed, SpeedObserverGains)]
)


@BOTH
def test_a_shaft_that_turns_up_slowly_makes_no_overshoot(control, gains, setpoint=4.75):
    boat = Surge(shaft=sailing.shaft(lag=1.0, rate=0.5))
    track = printed.sail_true(boat, control(gains()), setpoint, 100.0, 0.02, 0.1)
    found = sailing.response(track.time, track.speed, track.shaft, setpoint)
    assert found["settling_s"] <= 45.0 and found["overshoot_pct"] <= 0.1 and found["tail_pct"] <= 0.2


@BOTH
@pytest.mark.parametrize("mass", [10.0, 2e6])
def test_boats_of_all_sizes_settle_alike_each_in_its_own_time(control, gains, mass):
    """P3's boat scaled by Froude's law, with a guess that is wrong by 30 %."""
    length = (mass / sailing.CALDAS_MASS) ** (1.0 / 3.0)
    time, speed = math.sqrt(length), math.sqrt(length)
    truth = sailing.NOMINAL
    propeller = sailing.Propeller(diameter=0.8 * length)
    machine = sailing.shaft(lag=0.5 * time, rate=1.75 / length, high=17.5 / time)
    boat = Surge(mass, 820.8 * length**2.5, 101.2 * length**2, propeller, machine)
    values = gains(
        linear_drag=1.3 * truth.linear_drag / time,
        quadratic_drag=0.7 * truth.quadratic_drag / length,
        thrust=1.3 * 0.0049 * length,
        high=machine.high,
    )
    setpoint = 6.0 * speed
    track = printed.sail_true(boat, control(values), setpoint, 100.0 * time, 0.02 * time, 0.1 * time)
    found = sailing.response(track.time, track.speed, track.shaft, setpoint)
    assert found["settling_s"] <= 36.0 * time and found["overshoot_pct"] <= 0.5
    np.testing.assert_allclose(track.speed[-1000:], setpoint, rtol=2e-3)


def test_the_observer_finds_what_the_guess_leaves_out():
    boat, control = sailing.plant("a"), ObservedSpeed()
    state = boat.start()
    for _ in range(1000):
        state = boat.step(state, (control.step(6.0, state[3], 0.05, state[4]),), CALM, 0.05)
    gains, u, n = control.gains, state[3], state[4]
    missed = gains.linear_drag * u + gains.quadratic_drag * u * u - gains.thrust * n * n
    assert control.disturbance == pytest.approx(missed, rel=1e-3)
    held = control.disturbance
    control.step(6.0, math.nan, 0.05)
    assert control.disturbance == held
    control.step(6.0, u + 0.5, 0.05, n)
    left = math.exp(-4.0 * gains.rate * 0.05)  # of an error within a step: both poles at four times the model's
    error = (u + 0.5 - control.speed) / left**2
    assert control.disturbance - held == pytest.approx((1.0 - left) ** 2 / 0.05 * error)
    # Without a measured speed it is stable for any step.
    control = ObservedSpeed()
    control.step(6.0, 5.0, 0.05)
    for _ in range(20):
        control.step(6.0, math.nan, 20.0)
    assert control.speed == pytest.approx(6.0, abs=0.01)


GAINS = SpeedPIGains(mass=85.0, linear_drag=60.0, bandwidth=0.4, limit=200.0, limit_astern=100.0)


@pytest.mark.parametrize("kind", ["adaptive", "disturbance-observer"])
def test_force_loops_hold_a_speed_against_a_drag_they_do_not_know(kind):
    control, speed, within = speed_loop(kind, GAINS), 0.0, []
    for _ in range(1200):
        force = max(-50.0, min(150.0, control.step(1.5, speed, 0.05)))
        control.limited_to(force)
        speed += 0.05 * (force - 77.5 * speed - 20.0) / 95.0
        within.append(speed)
    assert speed == pytest.approx(1.5, abs=0.005) and max(within) < 1.53
    control.restart()
    assert control.step(1.5, math.nan, 0.05) == 0.0


def test_a_pi_loop_settles_as_a_first_order_model_within_its_limits_where_the_drag_balances_the_force():
    control, speed = SpeedPI(SpeedPIGains(mass=85.0, linear_drag=60.0, bandwidth=0.4)), 0.0
    for _ in range(250):
        speed += 0.01 * (control.step(1.0, speed, 0.01) - 60.0 * speed) / 85.0
    assert speed == pytest.approx(1.0 - math.exp(-1.0), abs=0.005)
    assert SpeedPI(GAINS).step(9.0, 0.0, 0.05) == 200.0 and SpeedPI(GAINS).step(-9.0, 0.0, 0.05) == -100.0
    control = SpeedPI(SpeedPIGains(mass=85.0, linear_drag=60.0, quadratic_drag=25.0))
    for force in (-30.0, 40.0):
        speed = control.speed_of(force)
        assert 60.0 * speed + 25.0 * speed * abs(speed) == pytest.approx(force)


def test_speed_loops_are_chosen_by_name_and_refused():
    assert isinstance(speed_loop("pi", GAINS), SpeedPI)
    assert isinstance(speed_loop("adaptive", GAINS), ForceLoop)
    with pytest.raises(InputError, match=r"speed\.controller is 'pid', expected one of pi, adaptive"):
        speed_loop("pid", GAINS)
    with pytest.raises(InputError, match="needs a limit of the force"):
        speed_loop("adaptive", SpeedPIGains(mass=85.0, linear_drag=60.0))
