"""The adaptive speed loop on boats of all kinds, and P3's own as printed."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.control.speed import AdaptiveSpeed, AdaptiveSpeedGains
from steerway.vessels import Surge
from steerway_studies.adaptive_speed import judge, plants, printed
from steerway_studies.papers.speed_mrac import PrintedMrac


def respond(name, setpoint, control=None, duration=120.0, control_step=0.05):
    control = control or plants.controller(name)
    return printed.sail_true(plants.plant(name), control, setpoint, duration, 0.01, control_step)


@pytest.mark.parametrize("name", plants.PLANTS)
@pytest.mark.parametrize("setpoint", plants.SPEEDS)
def test_every_boat_settles_without_overshoot(name, setpoint):
    track = respond(name, setpoint)
    found = judge.response(track.time, track.speed, track.shaft, setpoint)
    assert found["settling_s"] <= 35.0
    assert found["overshoot_pct"] <= 0.05 and found["tail_pct"] <= 0.05 and found["shaft_max"] <= 17.5


def test_adaptation_takes_the_steady_error_away_and_feedback_alone_does_not():
    held = AdaptiveSpeed(AdaptiveSpeedGains(adaptation=0.0))
    assert respond("a", 6, held).speed[-1] < 5.95
    assert respond("a", 6).speed[-1] == pytest.approx(6.0, abs=1e-4)


def test_the_rate_of_the_loop_changes_nothing():
    slow, fast = (respond("a", 6, control_step=step) for step in (0.1, 0.02))
    np.testing.assert_allclose(slow.speed, fast.speed, atol=0.05)
    np.testing.assert_allclose(slow.parameters[-1], fast.parameters[-1], rtol=0.01)


def test_a_speed_out_of_reach_teaches_nothing():
    """At 12 m/s the shaft is at its limit for good; asked for 3 m/s afterwards she does it as if nothing had been."""
    boat, control = plants.plant("a"), plants.controller("a")
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


def test_parameters_stay_within_their_bounds():
    control = AdaptiveSpeed(AdaptiveSpeedGains(adaptation=1e4))
    for k in range(400):
        control.step(3.0, 3.0 + 2.0 * math.sin(0.1 * k), 0.05)
        for value, (low, high) in zip(control.parameters, control.gains.projection, strict=True):
            assert low <= value <= high


def test_too_fast_for_the_model_lowers_the_command_and_what_it_is_made_of():
    control = AdaptiveSpeed()
    control.step(5.0, 5.0, 0.05)
    as_wanted = AdaptiveSpeed()
    as_wanted.step(5.0, 5.0, 0.05)
    too_fast, wanted = control.step(5.0, 5.2, 0.05), as_wanted.step(5.0, 5.0, 0.05)
    assert too_fast < wanted
    assert (control.parameters < as_wanted.parameters).all()


def test_the_first_step_sets_out_from_the_boat_s_speed():
    control = AdaptiveSpeed()
    control.step(6.0, 4.0, 0.05)
    assert 4.0 < control.model < 4.02


def test_without_a_speed_nothing_is_learned_and_the_reference_is_held():
    control = AdaptiveSpeed()
    control.step(6.0, 5.0, 0.05)
    before = control.parameters.copy()
    commands = [control.step(6.0, math.nan, 0.05) for _ in range(100)]
    np.testing.assert_array_equal(control.parameters, before)
    assert np.isfinite(commands).all() and control.model > 5.3


def test_a_slow_shaft_is_driven_harder_than_it_is_to_go():
    gains = AdaptiveSpeedGains(shaft_lag=10.0)
    assert AdaptiveSpeed(gains).step(3.0, 3.0, 0.05, 3.0) > AdaptiveSpeed().step(3.0, 3.0, 0.05, 3.0) > 3.0
    assert AdaptiveSpeed(gains).step(3.0, 3.0, 0.05) == AdaptiveSpeed().step(3.0, 3.0, 0.05)


def test_restart_forgets():
    control, fresh = AdaptiveSpeed(), AdaptiveSpeed()
    for _ in range(50):
        control.step(3.0, 1.0, 0.05)
    control.restart()
    assert control.step(6.0, 2.0, 0.05) == fresh.step(6.0, 2.0, 0.05)


def test_two_loops_share_nothing():
    one, other = AdaptiveSpeed(), AdaptiveSpeed()
    one.step(3.0, 1.0, 0.05)
    assert math.isnan(other.model) and (other.parameters == other.gains.guess()).all()


def test_printed_the_controller_settles_as_found():
    track = printed.as_printed(3)
    found = judge.response(track.time, track.speed, track.shaft, 3)
    assert found["settling_s"] == pytest.approx(40.8, abs=0.7) and found["overshoot_pct"] < 0.5


@pytest.mark.parametrize(("setpoint", "settling"), [(3, 46.7), (6, 47.9), (9, 73.4)])
def test_published_the_paper_s_own_curves_miss_its_requirements(setpoint, settling):
    track = printed.as_published(setpoint)
    assert printed.settling_about_final(track) == pytest.approx(settling, abs=1.5)
    assert printed.settling_about_final(track) > 40.0


def test_erratum_at_ten_hertz_the_order_within_a_step_decides():
    assert judge.overshoot_pct(printed.at_ten_hertz(6, adapt_first=False).speed, 6) > 20.0
    assert judge.overshoot_pct(printed.at_ten_hertz(6, adapt_first=True).speed, 6) < 1.0


def test_erratum_the_printed_controller_does_not_bear_a_lag():
    boat = Surge(shaft=plants.shaft(lag=1.0))
    track = printed.sail_true(boat, PrintedMrac(), 3, 60.0, 0.005, 0.005)
    assert judge.overshoot_pct(track.speed, 3) > 15.0


def test_printed_with_the_wrong_sign_it_does_not_settle():
    track = printed.sail_true(plants.plant("T"), PrintedMrac(sign=-1.0, high=17.5), 3, 120.0, 0.005, 0.005)
    assert judge.settling(track.time, track.speed, 3) == math.inf


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"model_rate": 0.0}, "speed.model_rate is 0"),
        ({"adaptation": -1.0}, "speed.adaptation is -1"),
        ({"high": 0.0}, "speed.high is 0"),
        ({"projection": ((0.0, 1.0),)}, "expected three pairs"),
    ],
)
def test_bad_input_is_named(arguments, says):
    with pytest.raises(InputError, match=says):
        AdaptiveSpeedGains(**arguments)
