"""A boat on a desk: the live service without sockets or clock around an Otter that obeys orders."""

import math

import numpy as np

from steerway.control.allocation import OTTER_PROPELLERS
from steerway.earth import displaced
from steerway.live.autopilot import Autopilot
from steerway.live.heard import Heard
from steerway.live.mission import Boat, Corner, GeodeticRoute, Limits, Settings, Waypoint
from steerway.live.navigator import Navigator
from steerway.live.route import Guide
from steerway.live.service import Service
from steerway.vessels import Otter, conditions

NOON = 1_719_835_200.0
HOME = (math.radians(54.0), math.radians(10.0))
SQUARE = ((0.0, 0.0), (60.0, 0.0), (60.0, 60.0), (0.0, 60.0), (0.0, 0.0))
TICK = 0.02
FULL = 239.0  # N, bollard pull of both propellers


def corner(north, east, kind=Corner, **more):
    lat, lon = displaced(*HOME, north, east)
    return kind(lat_deg=math.degrees(lat), lon_deg=math.degrees(lon), **more)


def square(corners=SQUARE, fence=(), limits=None, safe="stop", **settings):
    table = Settings(lookahead=8.0, acceptance=4.0, speed_mps=1.2, safe=safe, limits=limits or Limits(), **settings)
    return GeodeticRoute.of([corner(*each, Waypoint) for each in corners], [corner(*each) for each in fence], table)


OTTER = Boat(
    full_yaw_rate_dps=60.0, max_yaw_rate_dps=15.0, yaw_time=1.5, top_speed_mps=3.0, surge_time=1.1, reverse=True
)


class Desk:
    """Otter, receiver and service, tick by tick. `by` says what she obeys: "yaw-rate" (with thrust) or "propellers"."""

    def __init__(
        self, route, by="yaw-rate", current=0.2, noise=0.5, rate=5.0, seed=1, profile="otter", outputs=(), **autopilot
    ):
        self.navigator = Navigator(profile)
        self.autopilot = Autopilot(route, profile, **autopilot)
        self.service = Service(self.navigator, outputs, 1.0 / TICK, 0.0, Guide(route), self.autopilot)
        self.by, self.noise, self.every = by, noise, round(1.0 / rate / TICK)
        self.random = np.random.default_rng(seed)
        self.boat = Otter(25.0, (0.05, 0.0, -0.35))
        self.sea = conditions((current * math.cos(0.7), current * math.sin(0.7)))
        self.state = self.boat.start(-30.0, 0.0, 0.0, 1.0)
        self.ticks = 0
        self.trim = 0.0
        self.own = 0.0  # s by which the service's clock runs ahead of the ticks
        self.fixes = lambda time, north, east: [Heard("gps", NOON + time, *displaced(*HOME, north, east))]
        self.said, self.truth = [], []

    @property
    def time(self):
        return self.ticks * TICK

    @property
    def order(self):
        return self.service.latest.order

    def sail(self, seconds):
        """Ticks for so long; the orders said."""
        first = len(self.said)
        for _ in range(round(seconds / TICK)):
            self.tick()
        return self.said[first:]

    def tick(self):
        if self.ticks % self.every == 0:
            place = self.state[6:8] + self.noise * self.random.standard_normal(2)
            for heard in self.fixes(self.time, *place):
                for row in self.service._heard(heard):
                    self.service._fix(row)
        self.service._tick(NOON + self.time, self.time + self.own)
        self.said.append(self.order)
        self.truth.append((self.time, *self.state[6:8]))
        self.state = self.boat.step(self.state, self._propeller_speeds(), self.sea, TICK)
        self.ticks += 1

    def until_ready(self):
        begun = self.time
        while self.order is None or self.order.state != "ready":
            assert self.time < begun + 60.0, self.order
            self.tick()
        return self

    def start(self):
        self.until_ready().autopilot.start()
        self.tick()
        return self

    def _propeller_speeds(self):
        order = self.order
        if not order.engaged:
            return OTTER_PROPELLERS.step(90.0, 0.0)[:2]  # someone drives her straight on
        if self.by == "propellers":
            return order.port * OTTER_PROPELLERS.max_speed, order.starboard * OTTER_PROPELLERS.max_speed
        error = order.yaw_rate - self.state[5]
        self.trim += 100.0 * error * TICK
        yaw_moment = 25.0 * order.yaw_rate + 100.0 * error + self.trim
        return OTTER_PROPELLERS.step(FULL * order.thrust, yaw_moment)[:2]
