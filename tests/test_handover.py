"""Course or heading control: hysteresis, no jump, no chatter, and a boat that holds station in a current and leaves."""

import math

import numpy as np
import pytest

from steerway.control import (
    AnglePID,
    Autopilot,
    StationGains,
    StationKeeper,
    place_poles,
)
from steerway.control.testing import HandOver, PositionHold, Steerageway
from steerway.core import Estimate, InputError
from steerway.core.testing import over_ground
from steerway.guidance import ReferenceModel
from steerway.pilot import Mode
from steerway.simulation import parse_scenario, sail_scenario

H = 0.02
YAW = place_poles(1.0 / 41.0, 1.0, bandwidth=0.8)


def test_hysteresis_and_dwell():
    hand_over = HandOver(Steerageway(take=0.5, give=0.3, dwell=1.0))
    output = [
        hand_over.step(speed, 0.0, 0.0, 0.5) for speed in [0.4, 0.6, 0.6, 0.4, 0.6, 0.6, 0.6, 0.4, 0.31, 0.2, 0.2, 0.2]
    ]
    assert output == [False] * 6 + [True] * 5 + [False]


def test_a_boat_that_drifts_astern_is_not_steered_by_course():
    hand_over = HandOver()
    for _ in range(500):
        assert not hand_over.step(0.8, math.pi, 0.0, H)
    for _ in range(500):
        hand_over.step(0.8, 0.3, 0.0, H)
    assert hand_over.by_course
    for _ in range(500):
        hand_over.step(0.8, math.radians(80.0), 0.0, H)
    assert hand_over.by_course  # within 1.5 times 60°
    for _ in range(500):
        hand_over.step(0.8, math.radians(100.0), 0.0, H)
    assert not hand_over.by_course


def test_what_is_unknown_or_unwanted_gives_up_at_once():
    for nothing in [(math.nan, 0.0, True), (0.8, math.nan, True), (0.8, 0.0, False)]:
        hand_over = HandOver(Steerageway(dwell=0.0))
        hand_over.step(0.8, 0.0, math.nan, H)
        assert hand_over.by_course  # and no heading is needed to steer by course
        speed, course, wanted = nothing
        assert not hand_over.step(speed, course, 0.0, H, wanted)
    with pytest.raises(InputError, match=r"steerageway\.take is 0\.2 m/s, expected more than give"):
        HandOver(Steerageway(take=0.2))


def test_the_hand_over_is_without_a_jump():
    """Heading 20°, course 35°, in a turn with a control error and an integral: the moment is continuous."""
    autopilot = Autopilot(AnglePID(YAW), ReferenceModel(0.5), HandOver(Steerageway(dwell=0.0)))
    heading, course = math.radians(20.0), math.radians(35.0)
    command = (math.radians(60.0), 0.0, 0.0)
    moments, errors = [], []
    for step in range(400):
        speed = 0.2 if step < 200 else 0.8 if step < 300 else 0.1
        moments.append(autopilot.step(command, course, 0.03, heading, 0.02, speed, H))
        errors.append((course if autopilot.by_course else heading) - autopilot.shaper.reference[0])
        if step == 199:
            trim = autopilot.controller.integral
    jumps = np.abs(np.diff(moments))
    assert np.max(jumps[[199, 299]]) < 1.5 * np.max(jumps[150:199]) + 0.3
    assert np.max(jumps[[199, 299]]) < 0.02 * np.max(np.abs(moments))
    assert abs(trim) > 0.0 and not autopilot.by_course
    for step in (199, 299):  # the error to the reference is the same, seen from the other angle
        assert abs(errors[step]) > 0.05 and errors[step + 1] == pytest.approx(errors[step], abs=0.01)


def test_without_a_compass_the_autopilot_waits_for_steerageway():
    autopilot = Autopilot(AnglePID(YAW), ReferenceModel(0.5), HandOver(Steerageway(dwell=0.0)))
    command = (2.0, 0.0, 0.0)
    autopilot.controller.integral = 3.0

    def steer(speed, course):
        return autopilot.step(command, course, 0.0, math.nan, math.nan, speed, H)

    assert [steer(0.1, math.nan) for _ in range(100)] == [3.0] * 100
    assert abs(steer(0.8, 0.5) - 3.0) < 0.3  # from the boat's present course, whatever was commanded meanwhile
    for _ in range(200):
        turning = steer(0.8, 0.5)
    assert turning > 10.0
    trim = autopilot.controller.integral
    assert steer(0.1, 0.6) == pytest.approx(trim) and steer(0.1, 0.6) == pytest.approx(trim)
    assert abs(steer(0.8, -1.0) - trim) < 0.4
    damped = autopilot.step(command, math.nan, math.nan, math.nan, 0.2, 0.1, H)
    assert damped == pytest.approx(autopilot.controller.integral - YAW.proportional * YAW.derivative_time * 0.2)


def keep(distance, bearing, course=0.0, speed=0.0, heading=0.0, **more):
    keeper = StationKeeper(StationGains(mass=85.0, **more))
    return keeper.step(distance, bearing, course, speed, heading, H)


def test_a_station_keeper_pulls_brakes_and_backs():
    assert keep(4.0, 0.0)[1] == pytest.approx(85.0 * 0.04 * 4.0)
    braking = keep(4.0, 0.0, speed=0.3)[1]
    assert braking == pytest.approx(85.0 * 0.04 * 4.0 - 2.0 * 85.0 * 0.2 * 0.3)
    assert keep(4.0, 0.0, course=math.nan, speed=0.3) == keep(4.0, 0.0)
    (heading, _, _), force = keep(4.0, math.pi)  # astern and near: back
    assert heading == 0.0 and force < 0.0
    assert keep(4.0, 1.0)[0][0] == pytest.approx(1.0)  # near and ahead: point there
    assert keep(6.0, 3.0)[0][0] == pytest.approx(3.0)  # astern and far: turn
    assert keep(0.5, 1.0)[0][0] == 0.0  # too small a force to turn for
    assert keep(400.0, 0.0, limit=50.0)[1] == 50.0 and keep(4.0, math.pi, limit_astern=0.0)[1] == 0.0
    assert keep(4.0, 0.0, heading=math.nan)[1] == 0.0


def test_a_station_keeper_learns_the_current_only_where_thrust_can_answer_it():
    for limit, distance, learns in ((200.0, 4.0, True), (5.0, 4.0, False), (200.0, 25.0, False)):
        keeper = StationKeeper(StationGains(mass=85.0, limit=limit))
        for _ in range(100):
            keeper.step(distance, 1.0, 0.0, 0.0, 1.0, H)
        assert (math.hypot(*keeper.integral) > 0.0) is learns


STATION = """
duration = 420.0
[environment.current]
speed = 0.3
direction_deg = 120.0
[compass]
[gnss]
white = 0.1
markov = []
[speed]
cruise = 1.0
[route]
waypoints = [{ north = 0, east = 0 }, { north = 30, east = 0, stay = 320 }, { north = 30, east = 60 }]
"""


def test_an_otter_holds_station_in_a_current_and_leaves_again():
    """By course on the way, by heading on the station, bow into the current."""
    run = sail_scenario(parse_scenario(STATION)).run
    holding = run["mode"] == Mode.HOLDING
    late = holding & (run.time > run.time[holding][0] + 150.0)
    distance = np.hypot(run["true_north"] - 30.0, run["true_east"])[late]
    assert np.sqrt(np.mean(np.square(distance))) < 1.5 and max(distance) < 3.0
    np.testing.assert_allclose(np.degrees(run["true_heading"])[late], -60.0, atol=15.0)
    assert np.abs(np.diff(run["by_course"])).sum() == 4  # not once more
    assert run["mode"][-1] == Mode.STOPPED and abs(run["true_north"][-1] - 30.0) < 3.0


def estimate(north, east):
    return Estimate(*[math.nan] * 9, 1.0, 0.0, 0.1, 0.0, north, east, 0.0, 1.0)


def test_in_a_current_she_goes_as_fast_as_the_water_with_her_bow_up_it():
    hold = PositionHold(5.0, 0.8)
    assert hold.step(0.0, 2.0, estimate(0.0, 0.5)) == pytest.approx((-0.5 * math.pi, 0.5))
    for bearing in np.linspace(-3.0, 3.0, 7):
        wanted = hold.step(3.0, bearing, estimate(0.0, 0.5))
        north, east = over_ground(wanted.water_speed, 0.0, wanted.heading)
        nearer = north * math.cos(bearing) + (east + 0.5) * math.sin(bearing)
        assert nearer > 0.15 and math.cos(wanted.heading + 0.5 * math.pi) > 0.7
    assert hold.step(20.0, 0.5 * math.pi, estimate(0.0, 0.5)).heading == pytest.approx(0.5 * math.pi)  # far: back
