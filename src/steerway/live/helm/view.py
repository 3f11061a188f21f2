"""What the page shows of one moment, as plain numbers.

Knots, degrees and metres; None for what is unknown. Every ± and the ellipse hold 95 %.
"""

from typing import NamedTuple


class View(NamedTuple):
    """One moment."""

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
    nis: float | None = None  # of the last fix
    source: str = ""
    counts: dict[str, int] = {}  # noqa: RUF012 (never changed)
    cross_track: float | None = None  # + to starboard of the leg
    target: int | None = None  # index of the waypoint under way; None without a route or when it is done
    destination: str = ""
    distance: float | None = None  # to the destination
    left: float | None = None  # along the rest of the route
    done: float | None = None  # the share of the route that is behind
    bearing_deg: float | None = None
    steer_deg: float | None = None
    state: str | None = None  # of the autopilot; None without one
    reason: str = ""
    is_engaged: bool = False
    mode: str | None = None  # what is followed: route, course, position
    held_deg: float | None = None  # the course that is held
    dodges: bool = False  # that course leads off the route for a while
    offset: float = 0.0  # m to starboard of the route
    faster_kn: float = 0.0  # above the route's speed
    unreachable: str = ""  # why no order reaches the boat
    mark: tuple[float, float] | None = None  # of a man overboard, m in the chart's plane
    asked_course_deg: float | None = None
    asked_rate_dps: float | None = None
    asked_speed_kn: float | None = None
    thrust: float | None = None
    port: float | None = None
    starboard: float | None = None
