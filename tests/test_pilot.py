"""The pilot alone, with blocks that fail; the heading between compass readings."""

import math

import numpy as np
import pytest

from steerway.core import InputError, Measurements, wrap
from steerway.estimation.testing import AtFaceValue, HeadingTracker
from steerway.guidance import LineOfSight, Mission, Route, TrackingFilter
from steerway.pilot import Lookout, Mode, Pilot
from steerway.vessels.testing import OTTER_BOAT as OTTER

UNDER_WAY = Measurements(0.0, 5.0, sog=0.8, cog=0.3, course_rate=0.0, heading=0.3, yaw_rate=0.0)


class Dead:
    """Propellers that do not turn."""

    def step(self, surge_force, yaw):
        return 0.0, 0.0, 0.0, 0.0


def pilot(propulsion=OTTER.propulsion, at_end="hold", speed=None, **more):
    return Pilot(
        AtFaceValue(),
        Mission(Route([0.0, 100.0], [0.0, 0.0], 5.0), at_end=at_end),
        LineOfSight(10.0),
        OTTER.autopilot(TrackingFilter(1.0)),
        propulsion,
        speed or OTTER.speed_loop(),
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


def test_where_nothing_keeps_station_the_pilot_stops():
    here = pilot()
    here.station = None
    there = UNDER_WAY._replace(north=98.0, east=0.0)
    orders = [here.step(there, 0.02) for _ in range(3)]
    assert orders[-1].mode is Mode.STOPPED and here.finished and orders[-1].command == (0.0, 0.0)


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


def test_an_observer_is_called_between_the_stages():
    here = pilot(observer=(watcher := Watcher(Mode.UNDER_WAY)))
    orders = here.step(UNDER_WAY, 0.02)
    assert watcher.stages == [("judge", 1), ("ask", -math.atan(0.5)), ("allows", 2)]
    assert orders.speed == 0.4 and len(orders.command) == 2
    refusing = pilot(observer=Watcher(Mode.UNDER_WAY, allowed=False))
    assert refusing.step(UNDER_WAY, 0.02).command == ()


def test_what_an_observer_wants_held_is_stopped_at_where_nothing_keeps_station():
    here = pilot(observer=Watcher(Mode.HOLDING))
    here.station = None
    assert here.step(UNDER_WAY, 0.02).command == (0.0, 0.0)


def test_a_boat_that_someone_else_steers_is_led_without_a_command():
    here = pilot(observer=Watcher(Mode.IDLE))
    told = []
    here._orders = lambda yaw, speed: told.append((yaw, speed))
    orders = here.step(UNDER_WAY, 0.02)
    assert orders.command == () and orders.desired.angle == pytest.approx(-math.atan(0.5))
    assert len(told) == 1 and all(map(math.isnan, told[0]))


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


def test_a_steady_turn_is_tracked_without_a_lag():
    errors, rates = turned(HeadingTracker(), 0.2, 20.0)
    assert np.max(np.abs(errors[500:])) < 1e-6 and np.max(np.abs(rates[500:] - 0.2)) < 1e-6
    assert np.max(np.abs(errors)) < 0.1  # across south


def test_a_gyro_tells_the_rate_at_once_and_noise_is_smoothed():
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
