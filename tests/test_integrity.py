"""A receiver that stands still and a boat that does not turn as ordered stop the autopilot; sound ones do not."""

import math
import os

import numpy as np
import pytest

from steerway.control import OTTER_PROPELLERS
from steerway.core.testing import displaced
from steerway.live.testing import UNDER_WAY, ReceiverMonitor, ResponseMonitor, State, boat_of
from tests.desk import FULL, HOME, OTTER, SQUARE, TICK, Desk, square


def frozen(desk):
    """From now on every fix has the place of the next one."""
    stuck = []

    def freeze(row):
        stuck.append(row)
        return row._replace(latitude=stuck[0].latitude, longitude=stuck[0].longitude)

    desk.alter(freeze)


@pytest.mark.parametrize(
    ("by", "rate", "held", "metres"),
    [
        ("yaw-rate", 5.0, 0.0, 2.5),
        ("propellers", 5.0, 0.0, 2.5),
        ("yaw-rate", 1.0, 0.0, 9.0),
        ("propellers", 1.0, 0.0, 9.0),
        ("yaw-rate", 5.0, 30.0, 2.5),
        ("yaw-rate", 5.0, 10.0, 2.5),
    ],
)
def test_a_frozen_receiver_stops_the_autopilot(by, rate, held, metres):
    desk = Desk(square(boat=OTTER, hold_radius=3.0), by=by, rate=rate, current=0.4).start()
    desk.sail(20.0)
    if held:
        desk.autopilot.guide.hold_position()
        desk.sail(held)
    desk.until(lambda: desk.order.state is State.RUNNING)
    place = desk.state[6:8].copy()
    frozen(desk)
    doubted = desk.until(lambda: desk.order.state is not State.RUNNING)
    stopped = doubted + desk.until(lambda: desk.order.state not in UNDER_WAY)
    assert held or doubted <= 2.0 + 1.0 / rate  # the first frozen fix is a sound one
    assert stopped <= 5.0 + 2.0 * TICK
    assert not desk.order.yaw_rate and not desk.order.thrust
    assert math.dist(place, desk.state[6:8]) < metres


class Disobedient(Desk):
    """From `since` on the boat gets another yaw rate than ordered: `turns(ordered, s)`."""

    since, turns = math.inf, None

    def _propeller_speeds(self):
        order = self.order
        if self.time < self.since or order is None or not order.engaged:
            return super()._propeller_speeds()
        yaw_rate = self.turns(order.yaw_rate, self.time - self.since)
        error = yaw_rate - self.state[5]
        self.trim += 100.0 * error * TICK
        return OTTER_PROPELLERS.step(FULL * order.thrust, 25.0 * yaw_rate + 100.0 * error + self.trim)[:2]


def _master(ordered, time):
    return math.copysign(math.radians(10.0), math.sin(0.3 * time))


TURNS = {  # of the ordered yaw rate
    "reversed": lambda ordered, time: -ordered,
    "ignored": lambda ordered, time: 0.0,
    "stuck": lambda ordered, time: math.radians(10.0),
    "a second master": _master,
    "a second master for half": lambda ordered, time: 0.5 * ordered + _master(ordered, time),
}


def ordered_until_stopped(turns, since, seed=1):
    """s of ordered yaw rates of 5 °/s or more from a fault on, and why the autopilot stopped."""
    desk = Disobedient(square(boat=OTTER), current=0.4, seed=seed)
    desk.start()
    desk.sail(since)
    desk.turns, desk.since = turns, desk.time
    ordered, begun = 0.0, desk.time
    while desk.order.state in UNDER_WAY:
        assert desk.time < begun + 90.0
        desk.sail(TICK)
        ordered += TICK * (abs(desk.order.yaw_rate) >= math.radians(5.0))
    return ordered, desk.order.reason


@pytest.mark.parametrize(("fault", "since"), [("reversed", 28.0), *((fault, 25.0) for fault in TURNS)])
def test_a_boat_that_does_not_turn_as_ordered_stops_the_autopilot(fault, since):
    ordered, reason = ordered_until_stopped(TURNS[fault], since)
    assert ordered <= 20.0 and "does not turn as ordered" in reason


@pytest.mark.study
@pytest.mark.parametrize("since", range(5, 65, 3))
@pytest.mark.parametrize("fault", ["reversed", "ignored"])
def test_a_turn_that_is_not_made_stops_the_autopilot_whenever_it_begins(fault, since):
    ordered, _ = ordered_until_stopped(TURNS[fault], float(since))
    assert ordered <= 20.0


@pytest.mark.parametrize(
    ("by", "speed", "direction"),
    [*(("yaw-rate", 3.5, direction) for direction in (0.0, 0.7, 2.3, math.pi)), ("propellers", 3.6, 3.0)],
)
def test_in_a_current_above_the_boats_speed_it_stops_before_it_is_carried_off(by, speed, direction):
    desk = Desk(square(boat=OTTER), by=by, current=0.0)
    desk.sea[:2] = speed * math.cos(direction), speed * math.sin(direction)
    desk.drive = desk.state[0] = 0.0
    desk.start()
    place = desk.state[6:8].copy()
    assert desk.until(lambda: desk.order.state not in UNDER_WAY) < 30.0
    assert by == "yaw-rate" or desk.order.reason == "the current exceeds the boat's speed"
    assert math.dist(place, desk.state[6:8]) < 60.0


def positions(monitor, places, interval=0.2, sog=1.2):
    """Feed places (m north, m east); the time at which each trouble began, None without."""
    for k, place in enumerate(places):
        monitor.fix(interval * k, *displaced(*HOME, *place), sog, interval)
        if monitor.trouble:
            return interval * k
    return None


def test_positions_of_few_digits_or_given_five_times_repeat_honestly_and_those_that_flicker_stand_still():
    """NMEA 0183 with four decimals of a minute: 0.19 m; and a fix of every second at 5 Hz."""
    digit = 0.185
    for speed in (0.3, 0.6, 1.2):
        places = [(digit * round(speed * 0.2 * k / digit), 0.0) for k in range(3000)]
        assert positions(ReceiverMonitor(), places, sog=speed) is None
    assert positions(ReceiverMonitor(), [(1.2 * (k // 5), 0.3 * math.sin(k // 5)) for k in range(2000)]) is None
    noise = 0.5 * np.random.default_rng(1).standard_normal((700, 2))
    places = [(0.24 * k + noise[k, 0], noise[k, 1]) for k in range(600)]
    places += [(144.0 + 0.01 * (k % 2), 0.0) for k in range(100)]
    stopped = positions(ReceiverMonitor(), places)
    assert 600 * 0.2 < stopped <= 600 * 0.2 + 5.0


def test_a_gyro_tells_a_turn_at_once():
    monitor = ResponseMonitor(boat_of(square(boat=OTTER)))
    for k in range(300):
        monitor.order(0.2, 0.1)
        monitor.fix(0.1 * k, -0.2)
        if monitor.trouble:
            break
    assert 0.1 * k < 6.0


SURVEY = tuple((70.0 * ((k + 1) // 2 % 2), 12.0 * (k // 2)) for k in range(8))
SORTIES = range(10_000, 10_000 + int(os.environ.get("STEERWAY_SORTIES", "6")))


@pytest.mark.study
@pytest.mark.parametrize("seed", SORTIES)
def test_a_sound_boat_with_a_sound_receiver_is_never_reported_as_faulty(seed):
    """Squares, surveys, station keeping in currents of up to 80 % of the speed on the route (`make faults-hours`)."""
    rng = np.random.default_rng(seed)
    kind = ("square", "survey", "hold")[seed % 3]
    speed, direction = 0.8 * 1.2 * rng.uniform(), math.tau * rng.uniform()
    noise, wander, rate = rng.choice((0.1, 0.3, 0.5)), rng.choice((0.0, 0.2, 0.4)), rng.choice((1.0, 5.0, 10.0))
    by = str(rng.choice(("yaw-rate", "yaw-rate", "propellers")))
    more = {"hold_radius": 3.0} if kind == "hold" else {}
    route = square(SURVEY if kind == "survey" else SQUARE, boat=OTTER, **more)
    desk = Desk(route, by=by, noise=float(noise), rate=float(rate), seed=seed)
    honest, slow, kept = desk.fixes, np.zeros(2), math.exp(-1.0 / rate / 8.0)

    def fixes(time, north, east):
        slow[:] = kept * slow + wander * math.sqrt(1.0 - kept**2) * rng.standard_normal(2)
        return honest(time, north + slow[0], east + slow[1])

    desk.fixes = fixes
    desk.start().sail(20.0)
    before, after = desk.sea[:2].copy(), speed * np.array((math.cos(direction), math.sin(direction)))
    for k in range(60):
        desk.sea[:2] = before + (k + 1) / 60 * (after - before)
        desk.sail(1.0)
    if kind == "hold" and desk.order.state in UNDER_WAY:
        desk.autopilot.guide.hold_position()
    last = desk.time + (120.0 if kind == "hold" else 400.0)
    while desk.order.state in UNDER_WAY and desk.time < last:
        desk.sail(1.0)
    assert "stands still" not in desk.order.reason and "turn as ordered" not in desk.order.reason
