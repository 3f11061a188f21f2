"""Course or heading control, station keeping, and the pilot whose blocks they are."""

import math

import numpy as np
import pytest

from steerway.control import AnglePID, Autopilot, StationGains, StationKeeper, place_poles
from steerway.control.testing import HandOver, PositionHold, Steerageway
from steerway.core import Estimate, InputError, Measurements, wrap
from steerway.core.testing import over_ground
from steerway.estimation.testing import AtFaceValue, HeadingTracker
from steerway.guidance import LineOfSight, Mission, ReferenceModel, Route, TrackingFilter
from steerway.pilot import Lookout, Mode, Pilot
from steerway.simulation import parse_scenario, sail_scenario
from steerway.vessels.testing import OTTER_BOAT as OTTER

H = 0.02
YAW = place_poles(1.0 / 41.0, 1.0, bandwidth=0.8)


def test_hysteresis_and_dwell_and_a_boat_that_drifts_astern_is_not_steered_by_course():
    hand_over = HandOver(Steerageway(take=0.5, give=0.3, dwell=1.0))
    output = [
        hand_over.step(speed, 0.0, 0.0, 0.5) for speed in [0.4, 0.6, 0.6, 0.4, 0.6, 0.6, 0.6, 0.4, 0.31, 0.2, 0.2, 0.2]
    ]
    assert output == [False] * 6 + [True] * 5 + [False]
    hand_over = HandOver()
    for crab, by_course in ((180.0, False), (61.0, False), (59.0, True), (89.0, True), (91.0, False)):
        for _ in range(60):  # of 1.2 s: a second is waited for
            hand_over.step(0.8, math.radians(crab), 0.0, H)
        assert hand_over.by_course is by_course, crab


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
    assert keep(5.1, 3.0)[0][0] == pytest.approx(3.0)  # astern and far: turn
    assert keep(0.58, 1.0)[0][0] == 0.0  # too small a force to turn for
    assert keep(0.6, 1.0)[0][0] == pytest.approx(1.0)
    assert keep(400.0, 0.0, limit=50.0)[1] == 50.0 and keep(4.0, math.pi, limit_astern=0.0)[1] == 0.0
    assert keep(4.0, 0.0, heading=math.nan)[1] == 0.0


def test_a_station_keeper_learns_the_current_only_where_thrust_can_answer_it():
    for limit, distance, learns in ((200.0, 19.9, True), (60.0, 19.9, False), (200.0, 20.1, False)):
        keeper = StationKeeper(StationGains(mass=85.0, limit=limit))
        for _ in range(100):
            keeper.step(distance, 1.0, 0.0, 0.0, 1.0, H)
        learned = 0.1 * 0.2 * 2.0 * 85.0 * 0.2**2 * distance  # a tenth of the bandwidth, for 2 s
        assert math.hypot(*keeper.integral) == pytest.approx(learned if learns else 0.0)
    keeper.integral = (-30.0, 0.0)  # a current from the south
    assert keeper.step(1.0, 0.0, 0.0, 0.0, 0.0, H)[0][0] == pytest.approx(-math.pi)


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


UNDER_WAY = Measurements(0.0, 5.0, sog=0.8, cog=0.3, course_rate=0.0, heading=0.3, yaw_rate=0.0)


class Dead:
    """Propellers that do not turn."""

    def step(self, surge_force, yaw):
        return 0.0, 0.0, 0.0, 0.0


def pilot(propulsion=OTTER.propulsion, **more):
    return Pilot(
        AtFaceValue(),
        Mission(Route([0.0, 100.0], [0.0, 0.0], 5.0), at_end="hold"),
        LineOfSight(10.0),
        OTTER.autopilot(TrackingFilter(1.0)),
        propulsion,
        OTTER.speed_loop(),
        OTTER.station_keeper(),
        cruise=1.2,
        **more,
    )


def test_what_the_propellers_do_not_give_is_not_wound_up():
    live, dead = pilot(), pilot(Dead())
    for _ in range(1000):
        live.step(UNDER_WAY, 0.02)
        dead.step(UNDER_WAY, 0.02)
    assert abs(live.autopilot.controller.integral) > 3.0 and abs(live.speed.integral) > 10.0
    assert abs(dead.autopilot.controller.integral) < 0.1 and abs(dead.speed.integral) < 1.0


def test_after_a_blind_spell_the_helm_begins_with_the_boats_own_course():
    here = pilot(max_dead_reckoning=2.0)
    for _ in range(100):
        here.step(UNDER_WAY, 0.02)
    for _ in range(150):
        orders = here.step(Measurements(), 0.02)
    assert orders.mode is Mode.BLIND and orders.command == (0.0, 0.0) and not orders.by_course
    turned = UNDER_WAY._replace(cog=2.5, heading=2.5)
    orders = here.step(turned, 0.02)
    assert orders.mode is Mode.UNDER_WAY and abs(orders.reference.angle - 2.5) < 0.05


def test_every_station_begins_afresh():
    here = pilot()
    here.step(UNDER_WAY, 0.02)
    here.station.integral, here.station.heading = (30.0, 0.0), 2.0
    here.speed.integral = 50.0
    there = UNDER_WAY._replace(north=98.0, east=0.0)
    here.step(there, 0.02)
    assert here.step(there, 0.02).mode is Mode.HOLDING
    assert math.hypot(*here.station.integral) < 1.0 and here.station.heading != 2.0 and here.speed.integral == 0.0


def test_by_heading_the_law_is_steered_as_a_heading():
    for steer_by, angle in (("course", 0.3), ("heading", -0.4)):
        here = pilot(steer_by=steer_by)
        for _ in range(100):
            orders = here.step(UNDER_WAY._replace(heading=-0.4), 0.02)
        assert orders.by_course is (steer_by == "course")
        first = orders.desired.angle
        assert first == pytest.approx(-math.atan(0.5))
        assert math.copysign(1.0, orders.yaw) == math.copysign(1.0, first - angle)


class Watcher(Lookout):
    """An observer that records the stages and may change the result of each."""

    def __init__(self, mode, allowed=True):
        super().__init__(10.0)
        self.mode, self.allowed, self.stages = mode, allowed, []

    def judge(self, pilot, measurements, estimate, leg, dt):
        self.stages.append(("judge", leg.target))
        return self.mode

    def ask(self, pilot, desired, speed, estimate):
        self.stages.append(("ask", desired.angle))
        return desired, 0.4, estimate

    def allows(self, pilot, steered, estimate):
        self.stages.append(("allows", len(steered.command)))
        return self.allowed


def test_an_observer_is_called_between_the_stages_and_may_refuse_the_command():
    here = pilot(observer=(watcher := Watcher(Mode.UNDER_WAY)))
    orders = here.step(UNDER_WAY, 0.02)
    assert watcher.stages == [("judge", 1), ("ask", -math.atan(0.5)), ("allows", 2)]
    assert orders.speed == 0.4 and len(orders.command) == 2
    refusing = pilot(observer=Watcher(Mode.UNDER_WAY, allowed=False))
    assert refusing.step(UNDER_WAY, 0.02).command == ()
    idle, told = pilot(observer=Watcher(Mode.IDLE)), []
    idle._orders = lambda yaw, speed: told.append((yaw, speed))
    orders = idle.step(UNDER_WAY, 0.02)
    assert orders.command == () and orders.desired.angle == pytest.approx(-math.atan(0.5))
    assert len(told) == 1 and all(map(math.isnan, told[0])), "a boat that someone else steers is led"


def test_where_nothing_keeps_station_the_pilot_stops():
    here, held = pilot(), pilot(observer=Watcher(Mode.HOLDING))
    here.station = held.station = None
    there = UNDER_WAY._replace(north=98.0, east=0.0)
    orders = [here.step(there, 0.02) for _ in range(3)]
    assert orders[-1].mode is Mode.STOPPED and here.finished and orders[-1].command == (0.0, 0.0)
    assert held.step(UNDER_WAY, 0.02).command == (0.0, 0.0), "where an observer wants the boat held"


def test_a_wrong_word_is_refused():
    with pytest.raises(InputError, match=r"pilot\.steer_by is 'compass', expected one of course, heading"):
        pilot(steer_by="compass")
    with pytest.raises(InputError, match=r"pilot\.max_dead_reckoning is 0"):
        pilot(max_dead_reckoning=0.0)


def turned(tracker, rate, seconds, gyro=False, noise=0.0, every=5, dt=0.02):
    """(heading error, yaw rate) of a tracker on a boat that turns at a constant rate through south."""
    rng = np.random.default_rng(2)
    errors, rates = [], []
    for k in range(round(seconds / dt)):
        true = wrap(3.0 + rate * k * dt)
        heading = true + noise * rng.standard_normal() if k % every == 0 else math.nan
        output, yaw_rate = tracker.step(wrap(heading) if k % every == 0 else math.nan, rate if gyro else math.nan, dt)
        errors.append(wrap(output - true))
        rates.append(yaw_rate)
    return np.array(errors), np.array(rates)


def test_a_steady_turn_is_tracked_without_a_lag_at_once_with_a_gyro_and_noise_is_smoothed():
    errors, rates = turned(HeadingTracker(), 0.2, 20.0)
    assert np.max(np.abs(errors[500:])) < 1e-6 and np.max(np.abs(rates[500:] - 0.2)) < 1e-6
    assert np.max(np.abs(errors)) < 0.1  # across south
    errors, rates = turned(HeadingTracker(), 0.2, 2.0, gyro=True)
    assert np.max(np.abs(errors)) < 1e-9 and np.all(rates == 0.2)
    errors, _ = turned(HeadingTracker(), 0.0, 60.0, noise=0.01)
    assert errors[500:].std() < 0.006


def test_a_compass_that_falls_silent_is_no_longer_believed():
    tracker = HeadingTracker(patience=1.0)
    assert all(map(math.isnan, tracker.step(math.nan, math.nan, 0.1)))
    assert tracker.step(1.0, math.nan, 0.1) == (1.0, 0.0)
    for _ in range(9):
        assert tracker.step(math.nan, math.nan, 0.1)[0] == 1.0
    for _ in range(3):
        output = tracker.step(math.nan, math.nan, 0.1)
    assert all(map(math.isnan, output))
    assert tracker.step(-2.0, math.nan, 0.1) == (-2.0, 0.0)
