"""Turns: both sides planned, the one nearer to the corner taken; what a vehicle's yaw rate is limited to."""

import math

import numpy as np
import pytest

from steerway.control.testing import TurnLimits, TurnSpeeds, plan_turn
from steerway.core import Estimate, LegState
from steerway.guidance.testing import passing, turn_path
from steerway.live.testing import TurnLimit, boat_of
from tests.desk import OTTER, square

QUICK = TurnLimits(2.0, math.radians(60.0), math.radians(60.0))


def planned(degrees, current=(0.0, 0.0), limits=QUICK, speed=2.0):
    return plan_turn(0.0, math.radians(degrees), current, limits, TurnSpeeds(speed, speed))


@pytest.mark.parametrize("degrees", [30.0, 90.0, -120.0, 170.0])
def test_without_a_current_the_bow_turns_as_the_legs_do(degrees):
    turn = planned(degrees)
    assert math.degrees(turn.angle) == pytest.approx(degrees, abs=1e-6)
    assert turn.closest <= turn.excursion + turn.lead


def test_a_turn_of_more_than_half_a_circle_is_taken_where_it_stays_nearer_to_the_legs():
    """The current along the middle of the turn adds both crab angles: 90° over ground take the bow by some 190°."""
    current = 1.41 * math.cos(math.radians(45.0)), 1.41 * math.sin(math.radians(45.0))
    turn, heading = planned(90.0, current, QUICK, 1.45), -math.asin(current[1] / 1.45)
    other = turn.angle - math.copysign(math.tau, turn.angle)
    path, _ = turn_path(heading, other, 1.45, *current, *QUICK)
    assert 150.0 < abs(math.degrees(turn.angle)) < 210.0
    assert turn.excursion <= passing(path, 0.0, 0.0, 0.5 * math.pi)[0]


def test_a_path_turns_to_the_side_asked_for_and_a_hull_that_slips_is_carried_on_in_the_old_direction():
    for angle in (math.radians(250.0), math.radians(-250.0)):
        path, time = turn_path(0.3, angle, 1.0, 0.0, 0.0, 2.0, 1.0, 2.0)
        headings = np.unwrap(np.arctan2(*np.diff(path, axis=0).T[::-1]))
        assert headings[-1] - headings[0] == pytest.approx(angle, abs=0.03)
        assert abs(angle) < time < abs(angle) + 4.0
    straight, _ = turn_path(0.0, 0.5 * math.pi, 2.0, 0.0, 0.0, 2.0, 1.0, 2.0)
    slipping, _ = turn_path(0.0, 0.5 * math.pi, 2.0, 0.0, 0.0, 2.0, 1.0, 2.0, slip_time=0.5)
    assert slipping[-1, 0] - straight[-1, 0] == pytest.approx(2.0 * 0.5, rel=0.2)


def test_passing_of_a_square_corner_by_hand():
    """From 3 m before a corner to 4 m behind it, straight across; then the same 1 m further out."""
    path = np.array([(0.0, 0.0), (1.5, 2.0), (3.0, 4.0)])
    assert passing(path, 3.0, 0.0, 0.5 * math.pi) == pytest.approx((1.5, 0.0, 2.5, 4.0))
    beside = 1.0, 1.0, math.hypot(1.5, 1.0), 3.0
    assert passing(path, 3.0, 0.0, 0.5 * math.pi, 1.0) == pytest.approx(beside)
    turned = path @ [[math.cos(0.7), math.sin(0.7)], [-math.sin(0.7), math.cos(0.7)]]
    assert passing(turned, 3.0, 0.7, 0.7 + 0.5 * math.pi, 1.0) == pytest.approx(beside)


@pytest.mark.parametrize("degrees", [-150.0, -90.0, 60.0, 120.0])
def test_a_turn_ends_beside_the_next_leg_as_far_as_it_begins_beside_the_last(degrees):
    turn, following = planned(degrees, (0.3, 0.4)), math.radians(degrees)
    north, east = turn.path[-1] - (turn.lead, -turn.beside)
    assert east * math.cos(following) - north * math.sin(following) == pytest.approx(turn.beside, abs=1e-6)
    assert turn.beside * degrees < 0.0  # outside


@pytest.mark.parametrize("towards", range(0, 360, 45))
def test_what_a_turn_cuts_of_the_corner_is_weighed_against_what_it_leaves_the_legs_by(towards):
    """With 60°/s in a current of two thirds of the speed, which on the legs' line would be passed 2.7 m away."""
    current = 1.3 * math.cos(math.radians(towards)), 1.3 * math.sin(math.radians(towards))
    turn = planned(90.0, current, QUICK)
    assert turn.closest <= 1.5 and turn.outside <= 1.0
    assert turn.outside == pytest.approx(max(turn.closest / 1.7, turn.excursion / 2.5), abs=0.15)


def turned(limit, ordered, share, seconds, thrust=1.0, throttle=math.nan):
    for _ in range(int(seconds / 0.2)):
        for _ in range(10):
            limit.order(ordered, thrust, 0.02, throttle)
        limit.turned(share * ordered, 0.2)


@pytest.mark.parametrize(
    ("degrees", "current", "slows"), [(150.0, 0.0, True), (150.0, -1.1, False), (30.0, 0.0, False)]
)
def test_a_wide_corner_is_turned_slowly_where_that_leaves_it_by_less(degrees, current, slows):
    boat = boat_of(square(boat=OTTER.model_copy(update={"max_yaw_rate_dps": 60.0}))).but(cruise=2.0)
    steering, model = boat.in_current(), boat.autopilot_in_current().model
    unknown = Estimate(*[math.nan] * 11)
    seen = unknown._replace(north=0.0, east=0.0, sog=2.0, heading=0.0, heading_std=0.05, speed_gain=1.0)
    seen = seen._replace(water_speed=2.0 - current, current_north=current, current_east=0.0)
    for left in np.arange(40.0, 0.0, -0.5).tolist():
        leg = LegState(1, 0.0, 80.0 - left, 0.0, left, left, 0.0, 2.0)
        steering.turn(leg, math.radians(degrees), seen, model)
        speed = steering.speed(leg, 2.0)
        assert left < 25.0 or speed == 2.0
    assert (speed == pytest.approx(1.0)) == slows and (speed == 2.0) != slows


def test_the_limit_is_the_vehicles_unless_the_mission_says_one_and_one_lowered_by_an_idling_motor_grows_again():
    limit, declared = TurnLimit(), TurnLimit(0.3)
    assert math.degrees(limit.rate) == pytest.approx(20.0)
    for each in (limit, declared):
        each.vehicle(math.radians(80.0))
        turned(each, 0.1, 1.0, 3.0)
    assert math.degrees(limit.rate) == pytest.approx(60.0) and declared.rate == 0.3
    limit = TurnLimit()
    limit.vehicle(math.radians(80.0))
    turned(limit, math.radians(40.0), 0.1, 2.0, throttle=0.05)
    assert math.degrees(limit.rate) == pytest.approx(8.0)
    for _ in range(30):
        turned(limit, limit.rate, 1.0, 0.2, throttle=0.9)
    assert math.degrees(limit.rate) > 20.0


def test_a_boat_that_turns_less_than_the_vehicle_says_is_ordered_less_and_without_thrust_half_and_nothing_is_learned():
    limit, slow = TurnLimit(), TurnLimit()
    slow.vehicle(math.radians(120.0))
    turned(slow, math.radians(60.0), 0.4, 3.0)
    assert 20.0 <= math.degrees(slow.rate) <= 30.0
    turned(slow, 0.0, 1.0, 10.0)
    assert 20.0 <= math.degrees(slow.rate) <= 30.0
    limit.vehicle(math.radians(80.0))
    turned(limit, math.radians(60.0), 0.4, 3.0, thrust=0.1)
    assert math.degrees(limit.rate) <= 30.0
    turned(limit, 0.0, 1.0, 10.0)
    assert math.degrees(limit.rate) == pytest.approx(60.0)
    turned(limit, 0.0, 1.0, 10.0, thrust=0.1, throttle=1.0)
    assert math.degrees(limit.rate) == pytest.approx(60.0), "a motor that still drives turns the boat"


@pytest.mark.parametrize(
    ("ordered", "water", "current", "share"), [(2.0, 1.9, -0.9, 0.5), (2.0, 1.9, 0.0, 1.0), (0.0, 0.1, -1.0, 1.0)]
)
def test_what_a_vehicle_reaches_of_a_speed_over_ground(ordered, water, current, share):
    """Nearly reached counts as reached; a boat that drifts astern without an order lacks nothing."""
    steering = boat_of(square(boat=OTTER.model_copy(update={"top_speed_mps": 2.0}))).in_current()
    seen = Estimate(*[math.nan] * 11)._replace(heading=0.0, water_speed=water, current_north=current, current_east=0.0)
    assert steering.reached(ordered, seen) == pytest.approx(share)
