"""The autopilot aboard: it keeps to the route, lets go in time for every cause, and steers only when it was started."""

import math
import re

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from steerway.control.testing import COMFORTABLE, RATE_SHARE, comfortable_bandwidth, loop_damping
from steerway.core import OK, InputError, rms
from steerway.core.testing import STATUSES, Leg
from steerway.live.testing import UNDER_WAY, Limits, Row, State, Supervisor, TableFile, lost, piloting
from tests.desk import HOME, NOON, OTTER, TICK, Desk, dock_all, led, square

FENCE = ((-40.0, -10.0), (70.0, -10.0), (70.0, 70.0), (-40.0, 70.0))
LEG = Leg(2.0, 0.0, 0.0, 50.0, 0.3, 1.0, *HOME, "WP0", "WP1", speed=1.2)


def at(time, cog=0.0, sog=1.2, nis=2.0, status=OK, course_rate=0.0, **more):
    row = Row(NOON + time, *HOME, sog, cog, course_rate, 0.1, 0.05, 0.02, 0.3, 0.3, nis, status)
    return row._replace(**more)


def under_way(**settings):
    desk = Desk(settings.pop("route", None) or square(boat=OTTER), **settings).start()
    desk.sail(5.0)
    assert desk.order.state is State.RUNNING and desk.order.engaged and desk.order.thrust > 0.0
    return desk


def until_stopped(desk, most=15.0):
    """s from now to the first tick with the safe output."""
    return desk.until(lambda: desk.order.state not in UNDER_WAY, most)


def delayed(by):
    def change(says, _):
        waiting = []

        def fixes(*fix):
            waiting.append(fix)
            return says(*waiting.pop(0)) if waiting[0][0] <= fix[0] - by else []

        return fixes

    return change


def stepped(by):
    return lambda says, _: lambda time, *place: says(time + by, *place)


SAYS = {
    "silence": (lambda *_: lambda *fix: [], 10.0, "no fix for 10"),
    "jump": (lambda says, _: lambda time, north, east: says(time, north, east + 40.0), 0.0, "fixes do not fit"),
    "standing time": (lambda says, now: lambda time, *place: says(now, *place), 0.0, "time stands still"),
    "time ahead": (stepped(3.0), 0.0, r"time stepped by \+2.8 s"),
    "time far ahead": (stepped(3600.0), 0.0, "time stepped"),
    "time back": (stepped(-3.0), 0.0, "time has stepped"),
    "time far back": (stepped(-3600.0), 0.0, "time stepped"),
    "late fixes": (delayed(4.0), 4.4, "fixes come more than 2 s late"),
}
"""What the receiver says from now on, for how long that is allowed or cannot be seen, and what is said of it."""
HAPPENS = {
    "watchdog": (lambda desk: desk.hang(2.2), 0.0, "the service was late by 2.2 s"),
    "link": (lambda desk: desk.autopilot.link("mavlink", False), 0.0, "link mavlink is lost"),
    "person": (lambda desk: desk.autopilot.stop(), 0.0, "stopped by command"),
}


@pytest.mark.parametrize(("name", "safe"), [*((name, "stop") for name in SAYS | HAPPENS), ("link", "hand-back")])
def test_every_cause_leads_to_the_safe_output_in_time(name, safe):
    cause, allowed, output = (SAYS | HAPPENS)[name]
    desk = under_way(route=square(boat=OTTER, safe=safe))
    if name in SAYS:
        desk.fixes = cause(desk.fixes, desk.time)
    else:
        cause(desk)
    assert until_stopped(desk) <= allowed + 1.0 + 2.0 * TICK
    for order in (desk.order, *desk.sail(3.0)):
        assert order.state is State.STOPPED and order.engaged is (safe == "stop")
        assert order[3:7] == (0.0, 0.0, 0.0, 0.0)
        assert order.reason == desk.order.reason
    assert re.search(output, desk.order.reason), desk.order.reason


def test_a_late_service_is_reported_and_steers_on(seconds=1.9):
    """Also in a turn; a vehicle follows its last order meanwhile."""
    desk = under_way()
    desk.until(lambda: desk.leg.destination == "WP2", 120.0)
    desk.hang(seconds)
    order = desk.sail(0.2)[-1]
    assert order.state is State.DEGRADED and order.engaged
    assert order.reason == f"the service was late by {seconds + TICK:.1f} s"
    desk.sail(15.0)
    off = []
    for _ in range(250):
        desk.sail(0.1)
        off.append(desk.state[6] - 60.0)  # the second leg leads east
    assert desk.leg.destination == "WP2" and desk.order.state is State.RUNNING and rms(np.array(off)) < 1.0

    for _ in range(4):
        assert desk.order.state in UNDER_WAY
        desk.hang(0.6)
        desk.sail(1.0)
    assert desk.order.state is State.STOPPED and "the service was late by" in desk.order.reason


@pytest.mark.parametrize("rate", [0.5, 10.0])
def test_dead_reckoning_is_said_counted_from_the_last_fix_and_ends_with_the_next(rate):
    desk = under_way(rate=rate, max_dead_reckoning=6.0)
    says, desk.fixes = desk.fixes, lambda *fix: []
    output = desk.sail(5.0)
    assert output[0].state is State.RUNNING and output[-1].engaged
    assert (output[-1].state is State.DEGRADED) is ("dead reckoning" in output[-1].reason) is (rate == 10.0)
    desk.fixes = says
    assert desk.sail(4.0)[-1].state is State.RUNNING
    begun, desk.fixes = desk.time, lambda *fix: []
    until_stopped(desk)
    late = desk.time - (begun + 6.0)
    assert -1.0 / rate - TICK <= late <= max(1.0, 3.0 / rate)


def test_limits_hold_before_the_start_and_under_way_the_least_speed_once_she_has_had_time_to_reach_it():
    desk = under_way(route=square(boat=OTTER, fence=FENCE))
    led(desk.autopilot, LEG._replace(course_to_steer=-math.pi / 2.0, cross_track=0.0))
    until_stopped(desk, 60.0)
    assert "about to be left" in desk.order.reason and desk.state[7] > -10.0
    with pytest.raises(AssertionError, match=r"speed is 1\..* the limit 0.6"):
        Desk(square(boat=OTTER, limits=Limits(max_sog_mps=0.6))).until_ready()
    desk = under_way(route=square(boat=OTTER, limits=Limits(cross_track=3.0)))
    led(desk.autopilot, LEG._replace(cross_track=-3.5))
    assert until_stopped(desk) <= 1.0 and desk.order.reason == "the boat is 3.5 m off the leg, the limit 3 m"
    desk = Desk(square(boat=OTTER, limits=Limits(min_sog_mps=1.0))).start()
    desk.sail(16.0)
    assert desk.order.state is State.RUNNING
    desk.boat = type("Moored", (), {"step": lambda self, state, *_: state})()
    assert until_stopped(desk) < 6.0 and "the least 1 m/s" in desk.order.reason


def test_the_route_begins_with_the_start_which_is_refused_in_words():
    desk = Desk(square(boat=OTTER))
    with pytest.raises(InputError, match="cannot be started: no position yet"):
        desk.autopilot.start()
    desk.until_ready().sail(80.0)
    assert desk.leg.destination != "WP1"  # passed by while nobody steered
    desk.autopilot.link("mavlink", False)
    desk.sail(0.1)
    with pytest.raises(InputError, match="link mavlink is lost"):
        desk.autopilot.start()
    assert desk.order.state is State.IDLE
    desk.autopilot.link("mavlink", True)
    desk.state[6:8] = 0.0, 0.0
    desk.sail(5.0)
    desk.start()
    assert desk.leg.destination == "WP1"


def pilot_ready(boat=OTTER, **settings):
    """An autopilot that may be started, and the time."""
    pilot, time = Supervisor(square(boat=boat), "otter", **settings), 0.0
    led(pilot, LEG)
    while pilot.state is not State.READY:
        time += 0.1
        pilot.fix(at(time))
        pilot.step(at(time), 0.1)
    return pilot, time


def test_she_begins_with_the_course_she_is_on_and_one_that_stays_unknown_stops_her():
    pilot, time = pilot_ready()
    pilot.start()
    order = pilot.step(at(time, cog=-2.0), TICK)
    assert order.engaged and abs(order.yaw_rate) < 0.02
    assert pilot.step(at(time + 1.0, cog=-2.0), 0.4).yaw_rate > order.yaw_rate
    pilot, time = pilot_ready()
    pilot.start()
    begun = time
    while pilot.step(at(time, cog=math.nan), 0.1).engaged and pilot.state is not State.STOPPED:
        time += 0.1
        pilot.fix(at(time, cog=math.nan))
    assert pilot.reason == "the course is not known" and time - begun == pytest.approx(3.1, abs=0.25)


def test_a_table_tells_the_state(tmp_path):
    desk = Desk(square(boat=OTTER), outputs=[TableFile(tmp_path / "run.parquet")]).until_ready()
    desk.start().sail(3.0)
    desk.autopilot.stop("enough")
    desk.sail(2.0)
    dock_all()
    frame = pl.read_parquet(tmp_path / "run.parquet")
    said = frame.select("state", "reason").rows()
    assert list(dict.fromkeys(state for state, _ in said)) == [None, "idle", "ready", "running", "stopped"]
    assert dict(said)["running"] is None and said[-1] == ("stopped", "enough")
    assert frame.height == desk.navigator.counts["used"]


EVENTS = st.sampled_from(["start", "stop", "down", "up", "silence", "fixes", "jump", "hang", "blind", "end", "wait"])


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(EVENTS, st.integers(1, 60)), max_size=25), st.sampled_from(["stop", "hand-back"]))
def test_whatever_happens_it_steers_only_when_started_and_safely_stops(events, safe):
    pilot = Supervisor(square(boat=OTTER, safe=safe), "otter", max_dead_reckoning=2.0)
    led(pilot, LEG)
    started, world, time = False, "fixes", 0.0
    for event, ticks in [("wait", 60), *events]:
        if event == "start":
            try:
                pilot.start()
                started = True
            except InputError:
                assert pilot.state not in UNDER_WAY
        elif event == "stop":
            pilot.stop()
        elif event in ("down", "up"):
            pilot.link("it", event == "up")
        elif event != "wait":
            world = event
        for _ in range(ticks):
            before = pilot.state
            dt = 0.7 if world == "hang" else 0.1
            time += dt
            row = lost(NOON + time) if world == "blind" else at(time)
            if world not in ("silence", "blind"):
                pilot.fix(row._replace(status=STATUSES.index("rejected")) if world == "jump" else row)
            pilot.guide.finished = world == "end"
            order = pilot.step(row, dt)
            assert order.state is pilot.state
            assert started or (not order.engaged and order.state in (State.IDLE, State.READY))
            if order.state in UNDER_WAY:
                assert before in UNDER_WAY and order.engaged and world not in ("hang", "end")
                assert abs(order.yaw_rate) <= math.radians(15.0) and abs(order.thrust) <= 1.0
                assert abs(order.port) <= 1.0 and abs(order.starboard) <= 1.0
            else:
                assert order[3:7] == (0.0, 0.0, 0.0, 0.0)
            if order.state is State.STOPPED:
                assert order.reason and order.engaged is (safe == "stop")
                assert before in (*UNDER_WAY, State.STOPPED)


def steering(cog=0.0, sog=1.2, takes=piloting.YAW_RATE, **boat):
    """A function that steers a boat on a constant course towards a leg for so many ticks; the last order."""
    supervisor, time = pilot_ready(OTTER.model_copy(update=boat), takes=takes)
    supervisor.start()

    def steer(ticks, **leg):
        led(supervisor, LEG._replace(**leg))
        for _ in range(ticks):
            order = supervisor.step(at(time, cog=cog, sog=sog), TICK)
        return order

    return steer


def test_a_course_is_reached_by_the_short_way_and_steering_comes_before_thrust():
    order = steering()(25)
    assert order.yaw_rate > 0.0 and order.port > order.starboard and order.course == LEG.course_to_steer
    assert steering(cog=-3.1)(25, course_to_steer=3.1).yaw_rate < 0.0
    assert steering(cog=3.1)(25, course_to_steer=-3.1).yaw_rate > 0.0
    assert steering()(1, speed=0.1).speed == pytest.approx(0.45), "above steerageway"
    order = steering(cog=-2.0, sog=0.5, takes=piloting.PROPELLERS, full_yaw_rate_dps=15.0)(200, speed=3.0)
    assert order.port == pytest.approx(1.0) and order.starboard < -0.5 and order.thrust > 0.0


def test_propellers_give_the_share_of_the_full_moment_that_a_yaw_rate_takes():
    actuation = piloting.BoatActuation(OTTER, piloting.PROPELLERS)
    for yaw in (-0.4, 0.1, 0.7):
        _, _, port, starboard, _, achieved = actuation.step(0.0, yaw)
        assert 0.5 * (port * abs(port) - starboard * abs(starboard)) == pytest.approx(yaw / math.radians(60.0))
        assert achieved == pytest.approx(yaw)
    rate, *_, achieved = piloting.BoatActuation(OTTER).step(0.0, 0.7)
    assert rate == achieved == pytest.approx(math.radians(15.0)), "a vehicle's yaw rate has a limit of its own"


LAGS = [(carried, time) for carried in (0.1, 0.5, 1.0) for time in (0.0, 0.2, 0.5, 1.0, 2.0, 5.0, 20.0)]


def test_the_bandwidth_and_a_commanded_yaw_rate_keep_the_loop_damped_whatever_the_vessels_lag():
    for carried, time in [*LAGS, (0.1, 107.0), (1.0, 107.0)]:
        bandwidth = comfortable_bandwidth(carried, time)
        assert 0.1 * carried < bandwidth < carried
        assert loop_damping(bandwidth, carried, time) == pytest.approx(COMFORTABLE, abs=0.01), (carried, time)
    for carried, time in LAGS:
        s = np.polynomial.Polynomial([0.0, 1.0])
        filtering = np.polynomial.Polynomial([carried**3, 2.0 * carried**2, 2.0 * carried, 1.0])
        course = np.polynomial.Polynomial([carried**3, 2.0 * carried**2])
        poles = (s * (time * s + 1.0) * filtering + RATE_SHARE * carried * course).roots()
        assert np.min(-poles.real / np.abs(poles)) > COMFORTABLE, (carried, time)
