"""Data of the page: the present state as plain numbers; the track; speed and course of the last minutes.

Knots, degrees and metres; None for unknown. Every ± and the ellipse are 95 % bounds.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

Place = tuple[float, float]
"""North and east in the chart's plane, m."""
Places = Sequence[Place]
Track = Sequence[Place | None]
"""Places in order; None marks a break."""


class View(NamedTuple):
    """The state at one moment."""

    time: float | None = None  # Unix, UTC
    lat_deg: float | None = None
    lon_deg: float | None = None
    north: float | None = None  # m in the chart's plane
    east: float | None = None
    ellipse: tuple[float, float, float] | None = None  # half axes in m, direction of the first in degrees
    sog_kn: float | None = None
    sog_within_kn: float | None = None
    cog_deg: float | None = None
    cog_within_deg: float | None = None
    rate_dps: float | None = None
    rate_within_dps: float | None = None
    status: str = "lost"
    age: float | None = None  # s since the last fix
    nis: float | None = None  # NIS of the last fix
    source: str = ""
    counts: dict[str, int] = {}  # noqa: RUF012 (never changed)
    cross_track: float | None = None  # + to starboard of the leg
    target: int | None = None  # index of the next waypoint; None without a route or after its end
    destination: str = ""
    distance: float | None = None  # m to the destination
    left: float | None = None  # m along the rest of the route
    done: float | None = None  # fraction of the route that is completed
    bearing_deg: float | None = None
    steer_deg: float | None = None
    state: str | None = None  # of the autopilot; None without one
    reason: str = ""
    is_engaged: bool = False
    mode: str | None = None  # route, course or position
    held_deg: float | None = None  # held course
    dodges: bool = False  # whether the held course is a dodge off the route
    offset: float = 0.0  # m to starboard of the route
    faster_kn: float = 0.0  # speed above the route's speed
    unreachable: str = ""  # why no order reaches the boat
    mark: tuple[float, float] | None = None  # place at which a man went overboard, m in the chart's plane
    asked_course_deg: float | None = None
    asked_rate_dps: float | None = None
    asked_speed_kn: float | None = None
    thrust: float | None = None
    port: float | None = None
    starboard: float | None = None

    @property
    def place(self) -> Place | None:
        """Position in the chart's plane, m; None if unknown."""
        return None if self.north is None or self.east is None else (self.north, self.east)


_APART = 1.0  # smallest distance of two points of the track, m
_POINTS = 4000  # largest number of points of the track; above it every second point is dropped
_SPAN = 300.0  # length of the record of speed and course, s


class History:
    """The track (north, east; m; None marks a break), and the views of the last minutes, one per second."""

    def __init__(self) -> None:
        self.track: list[tuple[float, float] | None] = []
        self.moments: deque[tuple[float, View]] = deque()

    def add(self, view: View) -> None:
        """Add the next view; without a position the track breaks."""
        if view.place is None or view.status == "starting":
            if self.track and self.track[-1] is not None:
                self.track.append(None)
        else:
            self._add_place(view.place)
        if view.time is not None:
            self._add_moment(view.time, view)

    def _add_place(self, place: Place) -> None:
        last = self.track[-1] if self.track else None
        if last is None or math.dist(last, place) >= _APART:
            self.track.append(place)
        if len(self.track) > _POINTS:
            ends = self.track[-2:]
            self.track = [each for k, each in enumerate(self.track[:-2]) if each is None or k % 2 == 0] + ends

    def _add_moment(self, time: float, view: View) -> None:
        if self.moments and not 0.0 <= time - self.moments[-1][0] < _SPAN:
            self.moments.clear()
        if not self.moments or math.floor(time) > math.floor(self.moments[-1][0]):
            self.moments.append((time, view))
        while self.moments[0][0] < time - _SPAN:
            self.moments.popleft()


class Board:
    """The newest view and the history, for every open page."""

    def __init__(self, settings: dict[str, Any], send: Callable[[dict[str, Any]], None]):
        self.route: list[Place] = [tuple(place) for place in settings["route"]]
        self.fence: list[Place] = [tuple(place) for place in settings["fence"]]
        self.has_autopilot = bool(settings["has_autopilot"])
        self.history = History()
        self.view = View()
        self.notice = ""
        self.seq = 0
        self._send = send

    def update(self, message: dict[str, Any]) -> None:
        """Take the next message of the service."""
        self.view = View(**message["view"])
        self.notice, self.seq = message["notice"], message["seq"]
        self.history.add(self.view)

    def order(self, what: str, who: str, value: object = None) -> None:
        """Send a request to the service; see `live.controls.Controls`."""
        self._send({"do": what, "value": value, "who": who})
