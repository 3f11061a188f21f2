"""A boat on a desk: the live service with a simulated Otter that obeys its orders, without sockets or waiting."""

import asyncio
import math
from itertools import count
from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from steerway.control import OTTER_PROPELLERS
from steerway.core.testing import LegState, displaced
from steerway.guidance.testing import PlaceTable, WaypointTable
from steerway.live import testing as live
from steerway.vessels import Otter, conditions
from tests.hastened import HastenedLoop

NOON = 1_719_835_200.0
HOME = (math.radians(54.0), math.radians(10.0))
SQUARE = ((0.0, 0.0), (60.0, 0.0), (60.0, 60.0), (0.0, 60.0), (0.0, 0.0))
TICK = 0.02
FULL = 239.0  # N, bollard pull of both propellers


def corner(north, east, kind=PlaceTable, **more):
    lat, lon = displaced(*HOME, north, east)
    return kind(lat_deg=math.degrees(lat), lon_deg=math.degrees(lon), **more)


def square(corners=SQUARE, fence=(), limits=None, safe="stop", **settings):
    table = live.MissionTable(
        lookahead=8.0, acceptance=4.0, speed_mps=1.2, safe=safe, limits=limits or live.Limits(), **settings
    )
    return live.GeodeticRoute.of(
        [corner(*each, WaypointTable) for each in corners], [corner(*each) for each in fence], table
    )


def led(supervisor, leg):
    """Make the supervisor follow this leg from now on, wherever the boat is."""
    seen = LegState(1, leg.direction, 0.0, leg.cross_track, leg.distance, leg.distance, leg.bearing, leg.speed)
    supervisor.guide.step = lambda north, east, dt: seen
    supervisor.guide.given_course = leg.course_to_steer


OTTER = live.BoatTable(
    full_yaw_rate_dps=60.0, max_yaw_rate_dps=15.0, yaw_time=1.5, top_speed_mps=3.0, surge_time=1.1, reverse=True
)


class Desk:
    """Otter, receiver and live service on a hastened loop. `by`: the boat's orders, "yaw-rate" or "propellers".

    `fixes(time, north, east)` gives the receiver's rows at an epoch; tests replace it to insert faults.
    """

    afloat: ClassVar[list["Desk"]] = []

    def __init__(
        self, route, by="yaw-rate", current=0.2, noise=0.5, rate=5.0, seed=1, profile="otter", outputs=(), **autopilot
    ):
        self.navigator = live.Navigator(profile, max_dead_reckoning=autopilot.get("max_dead_reckoning", 10.0))
        takes = live.PROPELLERS if by == "propellers" else live.YAW_RATE
        self.autopilot = live.Supervisor(route, profile, takes=takes, **autopilot)
        self.service = live.Service(self.navigator, [self, *outputs], 1.0 / TICK, 0.0, self.autopilot)
        self.by, self.noise, self.every = by, noise, round(1.0 / rate / TICK)
        self.random = np.random.default_rng(seed)
        self.boat = Otter(25.0, (0.05, 0.0, -0.35))
        self.sea = conditions((current * math.cos(0.7), current * math.sin(0.7)))
        self.state = self.boat.start(-30.0, 0.0, 0.0, 1.0)
        self.trim, self.drive = 0.0, 90.0
        self.fixes = lambda time, north, east: [live.InputRow("gps", NOON + time, *displaced(*HOME, north, east))]
        self.output, self.rows = [], []
        self.loop = HastenedLoop()
        self.running = self.loop.create_task(self.service.run([SimpleNamespace(run=self._float)]))
        self.afloat.append(self)

    @property
    def time(self):
        return self.loop.time()

    @property
    def order(self):
        return self.service.latest.order

    @property
    def leg(self):
        return self.service.latest.leg

    def sail(self, seconds):
        """Sail for `seconds`; return the orders given meanwhile."""
        first = len(self.output)
        self.loop.run_until_complete(asyncio.sleep(seconds))
        return self.output[first:]

    def until(self, happens, most=60.0):
        """Sail until something happens; return the time it took, s."""
        begun = self.time
        while not happens():
            assert self.time < begun + most, self.order
            self.sail(TICK)
        return self.time - begun

    def until_ready(self):
        self.until(lambda: self.order is not None and self.order.state is live.State.READY)
        return self

    def start(self):
        self.until_ready().autopilot.start()
        self.sail(2.0 * TICK)
        return self

    def hang(self, seconds):
        """Halt the service for `seconds` while time goes on."""
        self.loop.hastened.ahead += seconds

    def alter(self, change):
        """From now on the receiver's rows are changed: `change(row)`."""
        honest = self.fixes
        self.fixes = lambda *fix: [change(row) for row in honest(*fix)]

    def close(self):
        """See Output; the service calls it."""

    def dock(self):
        self.running.cancel()
        self.loop.run_until_complete(asyncio.gather(self.running, return_exceptions=True))
        self.loop.close()

    def fix(self, row):
        pass

    def tick(self, row, leg=None, order=None):
        self.rows.append(row)
        self.output.append(order)

    async def _float(self, receive):
        for epoch in count():
            await asyncio.sleep(epoch * TICK - self.loop.time())
            if epoch % self.every == 0:
                place = self.state[6:8] + self.noise * self.random.standard_normal(2)
                receive(self.fixes(self.time, *place))
            self.state = self.boat.step(self.state, self._propeller_speeds(), self.sea, TICK)

    def _propeller_speeds(self):
        order = self.order
        if order is None or not order.engaged:
            return OTTER_PROPELLERS.step(self.drive, 0.0)[:2]  # somebody else drives the boat straight on
        if self.by == "propellers":
            return order.port * OTTER_PROPELLERS.max_speed, order.starboard * OTTER_PROPELLERS.max_speed
        error = order.yaw_rate - self.state[5]
        self.trim += 100.0 * error * TICK
        return OTTER_PROPELLERS.step(FULL * order.thrust, 25.0 * order.yaw_rate + 100.0 * error + self.trim)[:2]


def dock_all():
    """End the services of all boats, after a test."""
    while Desk.afloat:
        Desk.afloat.pop().dock()
