"""Routes and missions: what is refused, when a waypoint is passed, and the behaviour at both ends."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from steerway.core import InputError, track_errors
from steerway.guidance import LineOfSight, Mission, Passing, Phase, Route
from steerway.guidance.testing import Voyage, corner
from steerway_studies.testing import RangeRatePassing

SQUARE = Route([0.0, 100.0, 100.0, 0.0], [0.0, 0.0, 100.0, 100.0])


@given(st.floats(-80.0, 40.0))
def test_beside_a_route_every_leg_is_parallel_and_as_far_to_its_side(offset):
    beside = SQUARE.beside(offset)
    for one, other in zip(legs_of(SQUARE), legs_of(beside), strict=True):
        assert other[2] == pytest.approx(one[2], abs=1e-9)
        assert track_errors(*other[:2], *one)[1] == pytest.approx(offset, abs=1e-9)


def legs_of(route):
    """Start point and direction of each leg."""
    ahead = np.arctan2(np.diff(route.east), np.diff(route.north))
    return list(zip(route.north[:-1].tolist(), route.east[:-1].tolist(), ahead.tolist(), strict=True))


CIRCLE, NO_PLANE = Passing(rule="circle"), Passing(rule="circle", by_plane=False)


def sail(mission, points, dt=1.0):
    return [mission.step(north, east, dt) for north, east in points]


CORNERS = [0.0, 100.0, 100.0, 0.0], [0.0, 0.0, 30.0, 30.0]


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Route([0.0], [0.0]), "1 waypoints"),
        (lambda: Route([0.0, 1.0], [0.0]), "2 north and 1 east"),
        (lambda: Route([0.0, 50.0, 99.0], [0.0, 0.0, math.nan]), r"waypoint\[2\].east is nan"),
        (lambda: Route([0.0, 50.0, 99.0, 99.0], [0.0] * 4), r"waypoint\[3\] repeats waypoint 2"),
        (lambda: Route([0.0, 50.0, 60.0], [0.0] * 3), r"waypoint\[2\] is 10 m from waypoint 1"),
        (lambda: Route([0.0, 50.0], [0.0, 0.0], acceptance=[1.0, -2.0]), r"waypoint\[1\].acceptance is -2"),
        (lambda: Route([0.0, 50.0], [0.0, 0.0], speed=0.0), r"waypoint\[0\].speed is 0"),
        (lambda: Route([0.0, 50.0], [0.0, 0.0], speed=[1.0] * 3), "speed has 3 values, expected one or 2"),
        (lambda: Route([0.0, 1e7], [0.0, 0.0]), r"waypoint\[1\] is 10000 km from waypoint 0"),
        (lambda: Route([0.0, 50.0], [0.0, 0.0], default_acceptance=math.nan), "default_acceptance is nan"),
        (lambda: Route(*CORNERS, corners="arc", corner_radius=20.0), r"40 m of the leg to .*2\], which has 30 m"),
        (lambda: Route([0.0, 100.0, 20.0], [0.0] * 3, corners="arc"), r"1\] turns by 180°, expected at most 175°"),
        (lambda: Route(*CORNERS, corners="round"), r"route\.corners is 'round'"),
        (lambda: SQUARE.beside(50.0), "50 m to starboard, the leg to waypoint 2 is no longer than"),
        (lambda: Route([0.0, 100.0, 0.0], [0.0, 0.0, 10.0]).beside(1.0), "route turns by 174.3° at waypoint 1"),
        (lambda: Passing(rule="round"), r"passing\.rule is 'round'"),
        (lambda: Mission(SQUARE, at_end="sink"), r"mission\.at_end is 'sink'"),
        (lambda: Mission(SQUARE, start="anywhere"), r"mission\.start is 'anywhere'"),
        (lambda: Voyage(SQUARE, (0.0, 0.0, 0.0, 5.0)), r"3\]\.stay is 5 s, expected 0 at the first and the last"),
        (lambda: Voyage(SQUARE, (0.0, 0.0)), "voyage has 2 stays, expected one for each of the 4 waypoints"),
        (lambda: Voyage(SQUARE, (0.0, -1.0, 0.0, 0.0)), r"waypoint\[1\]\.stay is -1"),
    ],
)
def test_what_cannot_be_sailed_is_refused_by_name(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


def test_what_a_mission_says_of_a_place_and_the_remaining_distance_switches_for_the_next_step():
    leg = Mission(Route([10.0, 10.0], [20.0, 120.0], speed=1.5)).step(7.0, 50.0, 1.0)
    assert leg.target == 1 and leg.speed == 1.5
    assert leg.direction == pytest.approx(math.pi / 2)
    assert leg.along_track == pytest.approx(30.0) and leg.remaining == pytest.approx(70.0)
    assert leg.cross_track == pytest.approx(3.0)  # south of an eastbound leg is to starboard
    assert leg.distance == pytest.approx(math.hypot(3.0, 70.0))
    assert leg.bearing == pytest.approx(math.atan2(70.0, 3.0))
    mission = Mission(SQUARE)
    targets = [leg.target for leg in sail(mission, [(89.0, 20.0), (90.0, 30.0), (91.0, 30.0)])]
    assert targets == [1, 1, 2]
    passed = mission.log.passages[0]
    assert (passed.waypoint, passed.reached, passed.why, passed.time) == (1, True, "remaining", 2.0)
    lengths = math.hypot(1, 10), math.hypot(10, 30), math.hypot(11, 20)
    assert (passed.sailed, passed.distance, passed.closest) == pytest.approx(lengths)


STRAIGHT = Route([0.0, 100.0], [0.0, 0.0])
TURNING_ROUND = [(0.0, 0.0), (4.0, 0.0), (0.0, 0.0), (-4.0, 0.0), (-8.0, 0.0), (-4.0, 0.0)]


@pytest.mark.parametrize(
    ("mission", "points", "targets", "why"),
    [
        (Mission(SQUARE), [(-500.0, 0.0), (-95.0, 0.0), (-105.0, 40.0)], [1, 1, 1], []),  # behind the first waypoint
        (Mission(SQUARE, CIRCLE), [(95.0, 9.0), (95.0, 8.0), (95.0, 8.0)], [1, 1, 2], ["circle"]),
        (Mission(SQUARE, CIRCLE), [(0.0, 15.0), (99.0, 15.0), (101.0, 15.0), (102.0, 15.0)], [1, 1, 1, 2], ["plane"]),
        (Mission(SQUARE, NO_PLANE), [(0.0, 15.0), (101.0, 15.0), (300.0, 15.0)], [1, 1, 1], []),
        # A boat that still has to turn round moves away from its waypoint without having missed it.
        (Mission(STRAIGHT, CIRCLE), TURNING_ROUND, [1] * 6, []),
        (Mission(STRAIGHT, RangeRatePassing()), TURNING_ROUND[:2], [1, 1], []),
        (Mission(STRAIGHT, RangeRatePassing()), TURNING_ROUND[:3], [1, 1, 1], ["range rate"]),
    ],
)
def test_a_waypoint_is_passed_or_not(mission, points, targets, why):
    assert [leg.target for leg in sail(mission, points)] == targets
    assert [each.why for each in mission.log.passages] == why
    assert mission.log.missed == ([1] if why in (["plane"], ["range rate"]) else [])


def test_a_leg_is_given_up_after_its_time():
    route = Route([0.0, 100.0, 200.0], [0.0, 0.0, 0.0], speed=1.0)
    mission = Mission(route, CIRCLE)
    sail(mission, [(20.0, 0.0)] * 360)
    assert not mission.log.passages
    sail(mission, [(20.0, 0.0)])
    assert mission.log.missed == [1] and mission.log.passages[0].why == "time"
    sail(mission, [(100.0, 0.0)] * 600)
    assert mission.phase is Phase.UNDER_WAY  # the next leg has a time limit of its own, from the 180 m to its end
    sail(mission, [(100.0, 0.0)])
    assert mission.log.missed == [1, 2] and mission.phase is Phase.STOPPED
    far = Mission(route, CIRCLE)
    sail(far, [(-900.0, 0.0)] * 3059)
    assert not far.log.passages  # its time limit is that of its 1000 m
    without_speed = Mission(Route([0.0, 100.0], [0.0, 0.0]), CIRCLE)
    sail(without_speed, [(20.0, 0.0)] * 1000)
    never = Mission(route, Passing(rule="circle", time_factor=None))
    sail(never, [(20.0, 0.0)] * 1000)
    assert not without_speed.log.passages and not never.log.passages


def test_starting_at_a_point():
    mission = Mission(SQUARE, start="point")
    legs = sail(mission, [(-60.0, -80.0), (-6.0, -8.0), (0.0, 0.0)])
    assert [leg.target for leg in legs] == [0, 0, 1]
    assert legs[0].direction == pytest.approx(math.atan2(80.0, 60.0)) and legs[0].cross_track == pytest.approx(0.0)
    there = Mission(SQUARE, start="point")
    assert sail(there, [(3.0, 0.0)])[0].target == 1
    assert there.log.reached == [0]


@pytest.mark.parametrize(
    ("at_end", "phase", "speed"),
    [("continue", Phase.CONTINUING, 2.0), ("hold", Phase.HOLDING, 0.0), ("stop", Phase.STOPPED, 0.0)],
)
def test_the_end_of_a_route(at_end, phase, speed):
    mission = Mission(Route([0.0, 100.0], [0.0, 0.0], speed=2.0), at_end=at_end)
    sail(mission, [(50.0, 5.0), (95.0, 5.0)])
    assert mission.phase is phase
    time = mission.log.time
    leg = mission.step(160.0, 30.0, 1.0)
    assert leg.speed == speed and leg.target == 1
    assert leg.cross_track == pytest.approx(30.0) and leg.remaining == pytest.approx(-60.0)
    assert leg.bearing == pytest.approx(math.atan2(-30.0, -60.0))
    assert mission.log.time == time and len(mission.log.passages) == 1


def test_the_log_adds_up():
    mission = Mission(SQUARE)
    for north, east in [(0.0, 3.0), (30.0, -1.0), (60.0, 2.0)]:
        mission.step(north, east, 0.5, effort=4.0)
    log = mission.log
    assert log.energy == pytest.approx(6.0) and log.mean_effort == pytest.approx(4.0) and log.time == 1.5
    assert log.cross_track_max == pytest.approx(3.0)
    assert log.cross_track_rms == pytest.approx(math.sqrt(14.0 / 3.0))
    mission.skip("skipped")
    assert log.missed == [1] and log.passages[0].why == "skipped"
    assert log.passages[0].distance == pytest.approx(math.hypot(40.0, 2.0))
    mission.step(math.nan, math.nan, 1.0)
    mission.skip()
    assert mission.log.passages[1].distance == pytest.approx(math.hypot(40.0, 98.0))  # from the last known position
    mission.restart()
    assert mission.log.time == 0.0 and mission.step(0.0, 0.0, 1.0).target == 1


@given(
    turn=st.floats(-math.pi, math.pi),
    shift=st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4)),
    mirrored=st.booleans(),
    rule=st.sampled_from(["remaining", "circle"]),
)
def test_the_scene_may_be_turned_shifted_and_mirrored(turn, shift, mirrored, rule):
    def scene(north, east):
        east = -east if mirrored else east
        c, s = math.cos(turn), math.sin(turn)
        return shift[0] + c * north - s * east, shift[1] + s * north + c * east

    def sailed(place):
        corners = [place(*corner) for corner in zip(SQUARE.north, SQUARE.east, strict=True)]
        mission = Mission(Route(*zip(*corners, strict=True)), Passing(rule=rule))
        law = LineOfSight(15.0)
        north, east, legs = -23.0, 17.0, []
        for step in range(60):
            north, east = north + 8.0 * math.cos(step / 9.0), east + 8.0 * math.sin(step / 9.0)
            leg = mission.step(*place(north, east), 1.0)
            legs.append((leg, law.step(leg, math.nan, math.nan, 1.0)))
        return legs, mission.log

    (plain, log), (moved, moved_log) = sailed(lambda north, east: (north, east)), sailed(scene)
    side = -1.0 if mirrored else 1.0
    assert [leg.target for leg, _ in plain] == [leg.target for leg, _ in moved]
    for (one, steer), (other, steer_other) in zip(plain, moved, strict=True):
        assert other.cross_track == pytest.approx(side * one.cross_track, abs=1e-8)
        assert other.remaining == pytest.approx(one.remaining, abs=1e-8)
        off = steer_other.angle - other.direction - side * (steer.angle - one.direction)
        assert math.remainder(off, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert moved_log.distance == pytest.approx(log.distance)
    assert moved_log.missed == log.missed


@pytest.mark.parametrize("kind", ["arc", "clothoid"])
@pytest.mark.parametrize("turn_deg", [90.0, -90.0, 30.0, -150.0])
def test_a_corner_joins_both_legs_smoothly(kind, turn_deg):
    direction, turn = 0.7, math.radians(turn_deg)
    curve = corner(kind, 10.0, 3.0, -4.0, direction, direction + turn)
    before = 3.0 - curve.before * math.cos(direction), -4.0 - curve.before * math.sin(direction)
    behind = 3.0 + curve.before * math.cos(direction + turn), -4.0 + curve.before * math.sin(direction + turn)
    ends = (curve.north[0], curve.east[0]), (curve.north[-1], curve.east[-1])
    assert np.allclose(ends, (before, behind), atol=1e-9)
    assert curve.direction[0] == direction and curve.direction[-1] == pytest.approx(direction + turn)
    curvature = np.abs(np.diff(curve.direction)) / curve.step
    assert curvature.max() == pytest.approx(0.1, rel=0.02)
    assert curve.length == pytest.approx(abs(turn) * 10.0 * (1.0 if kind == "arc" else 2.0))
    if kind == "arc":
        assert curve.before == pytest.approx(10.0 * math.tan(0.5 * abs(turn)), rel=1e-3)
        middle = len(curve.north) // 2
        c, s = math.cos(curve.direction[middle]), math.sin(curve.direction[middle])
        along, cross = curve.seen(curve.north[middle] - 2.0 * s, curve.east[middle] + 2.0 * c)
        assert (along, cross) == pytest.approx((middle * curve.step, 2.0))
    else:
        assert curvature[0] < 0.01 and curvature[-1] < 0.01


def test_a_mission_follows_its_curves_to_their_ends():
    """A point that moves exactly along the path has no cross-track error, and passes every waypoint by its corner."""
    route = Route([0.0, 100.0, 100.0, 0.0], [0.0, 0.0, 100.0, 100.0], corners="arc", corner_radius=20.0)
    mission, north, east = Mission(route), 0.0, 0.0
    mission.preview = 0.05  # half a step
    off, angle = 0.0, []
    while mission.phase is Phase.UNDER_WAY:
        leg = mission.step(north, east, 0.1)
        off = max(off, abs(leg.cross_track))
        angle.append(leg.direction)
        north, east = north + 0.1 * math.cos(leg.direction), east + 0.1 * math.sin(leg.direction)
    assert off < 0.01
    assert [each.why for each in mission.log.passages] == ["corner", "corner", "remaining"]
    assert np.abs(np.diff(angle)).max() < 0.02
    assert mission.log.distance == pytest.approx(300.0 - 80.0 + 2.0 * 10.0 * math.pi - 10.0, abs=0.5)
    mission = Mission(route)
    mission.preview = 5.0
    assert mission.step(79.0, 0.0, 0.1).direction == pytest.approx(4.0 / 20.0, abs=0.01)
    assert math.isnan(mission.following)
    assert Route(*CORNERS, corners="arc", corner_radius=15.0).curves[1].before == pytest.approx(15.0, rel=1e-3)


def test_the_distance_at_which_a_turn_begins_does_not_count_on_the_next_leg():
    """A leg of 40 m, after a wheel-over point 60 m before its waypoint, is followed and not passed at once."""
    mission = Mission(Route([0.0, 200.0, 200.0, 0.0], [0.0, 0.0, 40.0, 40.0]))
    targets = []
    for north in (100.0, 139.0, 141.0, 143.0, 145.0):
        targets.append(mission.step(north, 0.0, 1.0).target)
        mission.lead = 60.0 if math.isfinite(mission.following) and targets[-1] == 1 else math.nan
    assert targets == [1, 1, 1, 2, 2]


@pytest.mark.parametrize(
    ("target", "direction", "across"), [(1, 0.0, 30.0), (2, math.pi / 2, 50.0), (3, -math.pi, 70.0)]
)
def test_the_leg_that_is_gone_to_leads_from_the_waypoint_before(target, direction, across):
    mission = Mission(SQUARE)
    mission.step(50.0, 30.0, 1.0)
    mission.go_to(target)
    leg = mission.step(50.0, 30.0, 1.0)
    assert leg.target == target and math.remainder(leg.direction - direction, 2.0 * math.pi) == pytest.approx(0.0)
    assert leg.cross_track == pytest.approx(across)
    mission.exchange(Route(SQUARE.north + 10.0, SQUARE.east + 10.0))
    moved = mission.step(60.0, 40.0, 1.0)
    assert moved.target == target and moved.cross_track == pytest.approx(across)
    with pytest.raises(InputError, match="the route has 2 waypoints, expected 4 as before"):
        mission.exchange(Route(SQUARE.north[:2], SQUARE.east[:2]))
    # To a waypoint beyond which she lies she goes straight, unless she is at it.
    for place, direction in (((140.0, 140.0), -0.75 * math.pi), ((103.0, 104.0), math.pi / 2)):
        mission = Mission(SQUARE)
        mission.step(*place, 1.0)
        mission.go_to(2)
        assert mission.step(*place, 1.0).direction == pytest.approx(direction)


def test_a_stay_lasts_as_long_as_it_should_and_the_route_goes_on():
    """By a point that follows each leg, and waits while the phase is holding."""
    route = Route([0.0, 50.0, 50.0, 0.0], [0.0, 0.0, 50.0, 50.0], 5.0, 1.0)
    voyage, north, east, seen = Voyage(route, (0.0, 30.0, 0.0, 0.0)), 0.0, 0.0, []
    for k in range(400):
        leg = voyage.step(north, east, 0.5)
        seen.append((0.5 * k, voyage.phase, leg.target))
        if voyage.phase is Phase.UNDER_WAY:
            north, east = north + 0.5 * math.cos(leg.bearing), east + 0.5 * math.sin(leg.bearing)
    holding = [time for time, phase, _ in seen if phase is Phase.HOLDING]
    assert holding[0] == 45.0 and holding[-1] == pytest.approx(75.0, abs=0.5)
    assert all(target == 1 for time, _, target in seen if time <= holding[-1])
    assert [each.waypoint for each in voyage.passages] == [1, 2, 3] and all(each.reached for each in voyage.passages)
    assert seen[-1][1:] == (Phase.STOPPED, 3)
    times = [each.time for each in voyage.passages]
    assert times == sorted(times) and times[0] == pytest.approx(45.5)
