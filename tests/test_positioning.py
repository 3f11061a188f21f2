"""The positioning PID: the published way, the symmetries, windup, and the printed law that pushes away."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.control import PositioningGains, PositionPID
from steerway.control.testing import by_bandwidth
from steerway.vessels import CALM, CyberShip2
from steerway.vessels.testing import INERTIA
from steerway_studies.testing import PrintedPositionPID, positioning, saturation, scenario


def unlimited():
    printed = scenario.PRINTED_GAINS
    return PositioningGains(printed.proportional, printed.integral, printed.derivative)


def test_the_published_gains_sail_the_known_way():
    numbers = positioning.numbers()
    assert numbers["pid_rise_north"] == pytest.approx(21.9, abs=0.3)
    assert numbers["pid_overshoot_north_pct"] == pytest.approx(6.6, abs=0.3)
    assert numbers["pid_overshoot_east_pct"] == pytest.approx(9.7, abs=0.3)
    assert numbers["pid_end_north"] == pytest.approx(10.54, abs=0.02)
    assert numbers["pid_end_east"] == pytest.approx(10.68, abs=0.02)
    assert numbers["pid_anti_windup_overshoot_east_pct"] < 0.5 * numbers["pid_overshoot_east_pct"]


def test_erratum_30_feeds_back_positively_and_does_not_turn_into_the_body():
    assert positioning.growth(-1.0) > 0.1
    assert positioning.growth(1.0) < 0.0
    goal, still = np.array([1.0, 0.0, 0.0]), np.zeros(3)
    printed = PrintedPositionPID(scenario.PRINTED_GAINS).step(goal, 0.0, 0.0, 0.0, still, 0.1)
    corrected = PositionPID(scenario.PRINTED_GAINS).step(goal, 0.0, 0.0, 0.0, still, 0.1)
    assert printed[0] < 0.0 < corrected[0]


def test_erratum_20_is_one_number():
    assert {saturation(speed) for speed in (-1.0, 0.0, 0.3, 0.5, 2.0)} == {0.25}


def test_the_law_term_by_term():
    gains = unlimited()
    pid = PositionPID(gains)
    heading, velocity = 2.0, np.array([0.1, -0.2, 0.05])
    to_go = np.array([3.0 - 1.0, -4.0 - 2.0])
    c, s = math.cos(heading), math.sin(heading)
    error = np.array([c * to_go[0] + s * to_go[1], -s * to_go[0] + c * to_go[1], -3.0 - heading + 2.0 * math.pi])
    first = pid.step((3.0, -4.0, -3.0), 1.0, 2.0, heading, velocity, 0.1)
    np.testing.assert_allclose(first, gains.proportional @ error - gains.derivative @ velocity, rtol=1e-12)
    second = pid.step((3.0, -4.0, -3.0), 1.0, 2.0, heading, velocity, 0.1)
    np.testing.assert_allclose(second - first, 0.1 * gains.integral @ error, rtol=1e-9)


def test_a_turned_scene_asks_for_the_same_force():
    one, other, angle = PositionPID(unlimited()), PositionPID(unlimited()), 2.5
    c, s = math.cos(angle), math.sin(angle)
    for k in range(5):
        goal, place, heading, velocity = (2.0, 1.0), (0.1 * k, -0.3), 0.2 * k, (0.1, 0.0, 0.05 * k)
        turned_goal = (c * goal[0] - s * goal[1], s * goal[0] + c * goal[1], 3.0 + angle)
        turned_place = (c * place[0] - s * place[1], s * place[0] + c * place[1])
        force = one.step((*goal, 3.0), *place, heading, velocity, 0.1)
        turned = other.step(turned_goal, *turned_place, heading + angle, velocity, 0.1)
        np.testing.assert_allclose(turned, force, atol=1e-12)


def test_it_holds_her_against_a_steady_force_at_the_place():
    vessel, pid = CyberShip2(), PositionPID(by_bandwidth(INERTIA, 0.3, limit=(2.0, 1.5, 1.5)))
    state, push = vessel.start(), np.array([0.0, 0.0, 0.5, -0.4, 0.05])
    for _ in range(4000):
        state = vessel.step(state, pid.step((2.0, -1.0, 0.8), *state[:3], state[3:], 0.1), push, 0.1)
    np.testing.assert_allclose(state, [2.0, -1.0, 0.8, 0.0, 0.0, 0.0], atol=1e-3)


def test_an_integral_does_not_wind_up_while_its_force_is_limited():
    pid = PositionPID(scenario.PRINTED_GAINS)
    for _ in range(100):
        pid.step((50.0, 0.0, 0.0), 0.0, 0.0, 0.0, np.zeros(3), 0.1)
    np.testing.assert_array_equal(pid.integral, np.zeros(3))
    careless = PositionPID(scenario.PRINTED_GAINS, anti_windup=False)
    for _ in range(100):
        careless.step((50.0, 0.0, 0.0), 0.0, 0.0, 0.0, np.zeros(3), 0.1)
    assert careless.integral[0] == pytest.approx(0.0026 * 50.0 * 10.0)


def test_bad_gains_are_named():
    with pytest.raises(InputError, match=r"positioning.proportional is \(3,\), expected \(3, 3\)"):
        PositioningGains(np.ones(3), INERTIA, INERTIA)
    with pytest.raises(InputError, match=r"positioning\.limit"):
        PositioningGains(INERTIA, INERTIA, INERTIA, (1.0, 0.0, 1.0))
    with pytest.raises(InputError, match=r"positioning\.bandwidth is 0"):
        by_bandwidth(INERTIA, 0.0)


def test_the_vessel_is_calm_without_command():
    state = CyberShip2().start()
    np.testing.assert_array_equal(CyberShip2().step(state, (0.0, 0.0, 0.0), CALM, 0.1), state)
