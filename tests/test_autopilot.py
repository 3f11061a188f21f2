"""The autopilot: placed poles, signs, wrap, limits without wind-up, take-over without a jump; the papers' misprints."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from steerway.control.course import AnglePID, AnglePIDGains, place_poles
from steerway.control.speed_pi import SpeedPI, SpeedPIGains
from steerway.errors import InputError
from steerway.guidance.reference import ReferenceModel
from steerway.papers import course_autopilot as printed
from steerway.papers.references import reference_model
from tests.boats import Nomoto

H = 0.02
OTTER = place_poles(*printed.OTTER_NOMOTO, bandwidth=1.5)
P1_GAINS = (1.45, 200.0, 36.27)


def steer(gains, command, seconds, boat=None, shaper=None, pilot=None):
    """(n,) unwrapped course of a Nomoto boat told a constant course; the reference is the command without a shaper."""
    boat = boat or Nomoto(printed.OTTER_NOMOTO[0], printed.OTTER_NOMOTO[1])
    pilot = pilot or AnglePID(gains)
    courses = []
    for _ in range(round(seconds / H)):
        reference = shaper.step((command, 0.0, 0.0), H) if shaper else (command, 0.0, 0.0)
        boat.step(pilot.step(reference, boat.course, boat.rate, H), H)
        courses.append(boat.course)
    return np.array(courses)


def test_pole_placement_gives_the_papers_gains():
    assert OTTER.proportional == pytest.approx(92.98, abs=0.005)
    assert OTTER.derivative_time == pytest.approx(0.889, abs=5e-4) and OTTER.integral_time == pytest.approx(
        6.667, abs=1e-3
    )
    mariner = place_poles(*printed.MARINER_NOMOTO, bandwidth=0.05)
    assert mariner.proportional == pytest.approx(1.450, abs=5e-4)
    assert mariner.derivative_time == pytest.approx(36.27, abs=5e-3) and mariner.integral_time == 200.0


@pytest.mark.parametrize("damping", [0.7, 1.0])
def test_placed_poles_are_where_they_were_put(damping):
    """Without the integral the loop of the object itself, linearised by finite differences, has ω_n and ζ."""
    gains = place_poles(0.5, 4.0, 0.6, damping)
    pilot = AnglePID(gains)

    def turning(course, rate):
        pilot.restart()
        return (0.5 * pilot.step((0.0, 0.0, 0.0), course, rate, 0.0) - rate) / 4.0

    step = 1e-6
    stiffness, friction = -turning(step, 0.0) / step, -turning(0.0, step) / step
    assert stiffness == pytest.approx(0.6**2) and friction == pytest.approx(2 * damping * 0.6)


def test_poles_of_the_papers_loops():
    """P0 (56): the integral adds a slow pole and moves the placed pair; P1 (29) as printed is unstable."""
    gains = (OTTER.proportional, OTTER.integral_time, OTTER.derivative_time)
    poles = np.sort(printed.closed_loop_poles(gains, printed.OTTER_NOMOTO, printed=False))
    scaled = np.sort(np.roots([1.0, 2.0, 1.0, 0.1])) * 1.5
    np.testing.assert_allclose(poles, scaled, rtol=1e-9)
    np.testing.assert_allclose(-poles.real / 1.5, [1.280, 0.587, 0.133], atol=1e-3)


def test_erratum_p1_29_the_printed_signs_are_unstable():
    poles = printed.closed_loop_poles(P1_GAINS, printed.MARINER_NOMOTO)
    np.testing.assert_allclose(np.sort(poles.real), [0.0061, 0.0376, 0.0376], atol=5e-5)
    assert poles.imag.max() == pytest.approx(0.025, abs=5e-5)
    assert printed.closed_loop_poles(P1_GAINS, printed.MARINER_NOMOTO, printed=False).real.max() < 0.0
    departure = {}
    for form in (True, False):
        ship, integral = Nomoto(*printed.MARINER_NOMOTO, course=math.radians(1.0)), 0.0
        for _ in range(3000):
            ship.step(printed.rudder(ship.course, integral, ship.rate, P1_GAINS, printed=form), 0.1)
            integral += 0.1 * ship.course
        departure[form] = abs(ship.course)
    assert departure[True] > math.radians(60.0) and departure[False] < math.radians(0.1)


def test_erratum_p1_30_the_printed_feedforward_does_not_follow():
    """A Nomoto ship on a 60° third-order reference of ω 0.02 rad/s, ζ 1; the bandwidth is not in the paper."""
    peak = {}
    for form in (True, False):
        ship, integral, reference, worst = Nomoto(*printed.MARINER_NOMOTO), 0.0, (0.0, 0.0, 0.0), 0.0
        for _ in range(40000):
            error, rate_error = ship.course - reference[0], ship.rate - reference[1]
            forward = printed.feedforward(reference[1], reference[2], printed.MARINER_NOMOTO, printed=form)
            ship.step(printed.rudder(error, integral, rate_error, P1_GAINS, forward, printed=False), H)
            integral += H * error
            worst = max(worst, abs(error))
            reference = reference_model(*reference, math.radians(60.0), 0.02, 1.0, math.inf, H)
        peak[form] = math.degrees(worst)
    assert peak[True] == pytest.approx(0.99, abs=0.05)
    assert peak[False] < 0.01


def test_feedforward_follows_a_reference_on_the_right_plant():
    shaper = ReferenceModel(0.5, max_rate=math.radians(10.0))
    shaper.start(0.0)
    boat, pilot, worst = Nomoto(*printed.OTTER_NOMOTO), AnglePID(OTTER), 0.0
    for _ in range(1500):
        reference = shaper.step((math.radians(60.0), 0.0, 0.0), H)
        boat.step(pilot.step(reference, boat.course, boat.rate, H), H)
        worst = max(worst, abs(boat.course - reference.angle))
    assert worst < math.radians(0.4)
    assert abs(boat.course - math.radians(60.0)) < math.radians(0.1)
    blind_gains = replace(OTTER, rate_feedforward=0.0, acceleration_feedforward=0.0)
    blind = steer(blind_gains, math.radians(60.0), 30.0, shaper=started(ReferenceModel(0.5)))
    assert abs(blind[-1] - math.radians(60.0)) < math.radians(1.5)


def started(shaper, angle=0.0):
    shaper.start(angle)
    return shaper


@pytest.mark.parametrize("command", [-3.0, -1.0, 1.0, 3.0])
@pytest.mark.parametrize("start", [-3.1, 0.3, 3.1, 9.0])
def test_every_course_is_reached_the_short_way(command, start):
    boat = Nomoto(*printed.OTTER_NOMOTO, course=start)
    courses = steer(OTTER, command, 60.0, boat)
    way = math.remainder(command - start, 2 * math.pi)
    assert courses[-1] - start == pytest.approx(way, abs=2e-3)
    assert np.max(np.abs(courses - start)) < 1.35 * abs(way) + 1e-9  # the integral's overshoot, not another turn


def test_the_opposite_course_is_where_the_way_is_decided():
    """Unwinding: the wrapped error leaves no long way round, at the price of a jump of the moment at 180°."""
    just_left = AnglePID(OTTER).step((0.0, 0.0, 0.0), math.pi - 1e-3, 0.0, H)
    just_right = AnglePID(OTTER).step((0.0, 0.0, 0.0), -math.pi + 1e-3, 0.0, H)
    assert just_left == pytest.approx(-OTTER.proportional * (math.pi - 1e-3), rel=1e-9)
    assert just_right == pytest.approx(-just_left)
    unwrapped, wrapped = Nomoto(*printed.OTTER_NOMOTO), Nomoto(*printed.OTTER_NOMOTO)
    command, start = math.radians(10.0), math.radians(350.0)
    unwrapped.course = wrapped.course = start
    gains = (OTTER.proportional, OTTER.derivative_time)
    for _ in range(3000):
        unwrapped.step(-gains[0] * (unwrapped.course - command + gains[1] * unwrapped.rate), H)
    courses = steer(OTTER, command, 60.0, wrapped)
    assert start - unwrapped.course == pytest.approx(math.radians(340.0), abs=1e-3)
    assert courses[-1] - start == pytest.approx(math.radians(20.0), abs=1e-3)


def test_the_integral_carries_a_steady_disturbance():
    boat = Nomoto(*printed.OTTER_NOMOTO, disturbance=-0.2)
    pilot = AnglePID(OTTER)
    courses = steer(OTTER, 0.5, 120.0, boat, pilot=pilot)
    assert courses[-1] == pytest.approx(0.5, abs=1e-6)
    assert pilot.integral == pytest.approx(0.2 / printed.OTTER_NOMOTO[0], rel=1e-5)
    assert OTTER.limit == math.inf and AnglePIDGains(50.0).integral_time == math.inf


def overshoot(frozen, behind, turn=2.5):
    """Overshoot in a turn that saturates for long, the limit in the autopilot or behind it."""
    limit = 25.0
    gains = place_poles(*printed.OTTER_NOMOTO, bandwidth=1.5, limit=math.inf if behind else limit)
    boat, pilot, integral, worst = Nomoto(*printed.OTTER_NOMOTO), AnglePID(gains), 0.0, 0.0
    for _ in range(3000):
        if frozen:
            wanted = pilot.step((turn, 0.0, 0.0), boat.course, boat.rate, H)
        else:
            error = boat.course - turn
            integral -= gains.proportional / gains.integral_time * error * H
            wanted = integral - gains.proportional * (error + gains.derivative_time * boat.rate)
        achieved = max(-limit, min(limit, wanted))
        if frozen and behind:
            pilot.limited_to(achieved)
        boat.step(achieved, H)
        worst = max(worst, (boat.course - turn) / turn)
    return worst


@pytest.mark.parametrize("behind", [False, True])
def test_a_limit_does_not_wind_the_integral_up(behind):
    held, wound = overshoot(True, behind), overshoot(False, behind)
    assert wound > 0.25 and held < 0.4 * wound


def test_the_integral_leaves_a_limit_at_once():
    gains = AnglePIDGains(10.0, integral_time=1.0, limit=5.0)
    pilot = AnglePID(gains)
    for _ in range(500):
        pilot.step((1.0, 0.0, 0.0), 0.0, 0.0, H)
    assert pilot.command == 5.0 and pilot.integral <= gains.limit
    high = pilot.integral
    pilot.step((0.0, 0.0, 0.0), 0.001, 0.0, H)
    assert pilot.integral <= high
    for _ in range(200):
        pilot.step((0.0, 0.0, 0.0), 0.4, 0.0, H)
    assert pilot.command < 0.0


def test_take_over_is_without_a_jump():
    for command in (-30.0, 12.0):
        pilot = AnglePID(OTTER)
        pilot.start(command, (0.4, 0.02, 0.01), 0.35, -0.01)
        assert pilot.step((0.4, 0.02, 0.01), 0.35, -0.01, H) == pytest.approx(command)
    bounded = AnglePID(place_poles(*printed.OTTER_NOMOTO, bandwidth=1.5, limit=20.0))
    bounded.start(500.0, (0.0, 0.0, 0.0), 0.0, 0.0)
    assert bounded.integral == 20.0
    assert bounded.step((0.0, 0.0, 0.0), 0.0, 0.0, H) == 20.0


def test_unknown_angles_leave_the_trim():
    pilot = AnglePID(OTTER)
    pilot.start(7.0, (0.0, 0.0, 0.0), 0.0, 0.0)
    for nothing in [((0.0, 0.0, 0.0), math.nan, math.nan), ((math.nan, 0.0, 0.0), 1.0, 0.0)]:
        assert pilot.step(*nothing, H) == pytest.approx(7.0) and pilot.integral == pytest.approx(7.0)
    turning = pilot.step((0.0, 0.0, 0.0), math.nan, 0.1, H)
    assert turning == pytest.approx(7.0 - OTTER.proportional * OTTER.derivative_time * 0.1)


@pytest.mark.parametrize("rate_hz", [10.0, 50.0, 200.0])
def test_the_rate_of_the_loop_is_no_tuning(rate_hz):
    """The sampled loop stays with the closed loop of P0 (56) in continuous time, solved by a matrix exponential."""
    gain, time_constant = printed.OTTER_NOMOTO
    push, turn = 0.1, 0.5
    stiffness = OTTER.proportional * gain / time_constant
    loop = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-stiffness, -1.0 / time_constant - stiffness * OTTER.derivative_time, gain / time_constant, push],
            [-OTTER.proportional / OTTER.integral_time, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0],
        ]
    )
    boat, pilot = Nomoto(*printed.OTTER_NOMOTO, disturbance=push), AnglePID(OTTER)
    onward, true = expm(loop / rate_hz), np.array([-turn, 0.0, 0.0, 1.0])
    for _ in range(round(8.0 * rate_hz)):
        moment = pilot.step((turn, 0.0, 0.0), boat.course, boat.rate, 1.0 / rate_hz)
        for _ in range(round(1000 / rate_hz)):
            boat.step(moment, 1e-3)
        true = onward @ true
        assert boat.course - turn == pytest.approx(true[0], abs=0.3 * turn / rate_hz)


def test_gains_that_cannot_be_are_refused():
    for make, said in (
        (lambda: place_poles(0.0, 1.0, 1.0), "nomoto.gain is 0"),
        (lambda: place_poles(1.0, math.nan, 1.0), "nomoto.time_constant is nan"),
        (lambda: place_poles(1.0, 1.0, 0.3), "autopilot.bandwidth is 0.3 rad/s, expected at least 0.5 rad/s"),
        (lambda: AnglePIDGains(-1.0), "autopilot.proportional is -1"),
        (lambda: AnglePIDGains(1.0, integral_time=0.0), "autopilot.integral_time is 0"),
        (lambda: AnglePIDGains(1.0, derivative_time=-1.0), "autopilot.derivative_time is -1"),
        (lambda: SpeedPIGains(mass=0.0), "speed.mass is 0"),
    ):
        with pytest.raises(InputError, match=said):
            make()


def run_speed(pilot, seconds, desired, mass=85.0, drag=77.0, push=0.0, speed=0.0, give=math.inf):
    speeds = []
    for _ in range(round(seconds / H)):
        force = min(give, pilot.step(desired, speed, H))
        pilot.limited_to(force)
        speed += H * (force + push - drag * speed) / mass
        speeds.append(speed)
    return np.array(speeds)


def test_a_speed_is_held_against_a_push_and_without_wind_up():
    known = SpeedPIGains(mass=85.0, linear_drag=77.0, limit=200.0)
    assert run_speed(SpeedPI(known), 40.0, 1.2)[-1] == pytest.approx(1.2, abs=1e-3)
    assert run_speed(SpeedPI(known), 60.0, 1.2, push=-30.0)[-1] == pytest.approx(1.2, abs=1e-3)
    unknown = SpeedPIGains(mass=85.0, limit=100.0)
    slow = run_speed(SpeedPI(unknown), 60.0, 1.2)
    assert slow[-1] == pytest.approx(1.2, abs=1e-3) and slow.max() < 1.2 * 1.05
    pilot = SpeedPI(SpeedPIGains(mass=85.0))  # the limit lies behind it
    assert run_speed(pilot, 100.0, 1.5, give=80.0)[-1] == pytest.approx(80.0 / 77.0, abs=1e-3)
    assert pilot.integral < 80.0
    no_reverse = SpeedPI(SpeedPIGains(mass=85.0))
    assert no_reverse.step(0.0, 1.0, H) == 0.0
    no_reverse.start(20.0, 1.0, 0.8)
    assert no_reverse.step(1.0, 0.8, H) == pytest.approx(20.0)
    assert no_reverse.step(1.0, math.nan, H) == pytest.approx(no_reverse.integral)
