"""Makes the page's view from the present state of a service."""

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from steerway.core.earth import KNOT, displacement
from steerway.core.leg import Leg
from steerway.core.records import PREDICTED, STATUSES
from steerway.core.statistics import NORMAL_95
from steerway.live.autopilot.guide import Guide
from steerway.live.autopilot.mission import GeodeticRoute
from steerway.live.helm.view import Places, View
from steerway.live.rows import Order, Row

if TYPE_CHECKING:
    from steerway.live.service import Service

_ELLIPSE = math.sqrt(5.991465)  # χ² of 2 degrees of freedom, 95 %
_FRESH = 2.0  # time after a fix for which predictions keep the status of the fix, s


@dataclass
class ChartPlane:
    """The chart's plane, with its origin at the route's first waypoint, or else at the first position."""

    origin: tuple[float, float] | None = None
    route: list[tuple[float, float]] = field(default_factory=list)
    fence: list[tuple[float, float]] = field(default_factory=list)

    @classmethod
    def of(cls, route: GeodeticRoute | None) -> "ChartPlane":
        """The plane of a route."""
        if route is None:
            return cls()
        origin = float(route.latitude[0]), float(route.longitude[0])
        fence = () if route.fence is None else route.fence.places

        def placed(places: Any) -> list[tuple[float, float]]:
            return [displacement(float(latitude), float(longitude), *origin) for latitude, longitude in places]

        return cls(origin, placed(zip(route.latitude, route.longitude, strict=True)), placed(fence))

    def place(self, latitude: float, longitude: float) -> tuple[float, float]:
        """North and east of a position, m."""
        if self.origin is None and math.isfinite(latitude):
            self.origin = latitude, longitude
        return displacement(latitude, longitude, *self.origin) if self.origin else (math.nan, math.nan)


def view(service: "Service", plane: ChartPlane) -> View:
    """The view of a service at present."""
    navigator, latest, controls = service.navigator, service.latest, service.controls
    row, fix, mark = latest.row, navigator.last_fix, controls.mark
    north, east = plane.place(row.latitude, row.longitude)
    return View(
        **_known(
            time=row.time,
            lat_deg=math.degrees(row.latitude),
            lon_deg=math.degrees(row.longitude),
            north=north,
            east=east,
            sog_kn=row.sog / KNOT,
            sog_within_kn=NORMAL_95 * row.sog_std / KNOT,
            cog_deg=_compass(row.cog),
            cog_within_deg=min(NORMAL_95 * math.degrees(row.cog_std), 180.0),
            rate_dps=math.degrees(row.course_rate),
            rate_within_dps=NORMAL_95 * math.degrees(row.course_rate_std),
            age=max(row.time - fix.time, 0.0),
            nis=fix.nis,
        ),
        ellipse=ellipse(navigator.position_covariance) if row.valid else None,
        status=STATUSES[_status(row, fix)],
        source=navigator.choice.present,
        counts=dict(navigator.counts),
        unreachable=service.unreachable(),
        mark=None if mark is None else plane.place(mark.latitude, mark.longitude),
        **_followed(controls.guide) | _ordered(latest.order) | _on_route(row, latest.leg, plane.route),
    )


def _status(row: Row, fix: Row) -> int:
    """The status to show: shortly after a fix, that of the fix instead of "predicted"."""
    return fix.status if row.status == PREDICTED and row.time - fix.time < _FRESH else row.status


def ellipse(covariance: tuple[float, float, float]) -> tuple[float, float, float] | None:
    """The 95 % ellipse of a covariance (m²): longer and shorter half axis (m), the longer one's direction (degrees)."""
    if not all(map(math.isfinite, covariance)):
        return None
    north, both, east = covariance
    variances, axes = np.linalg.eigh([[north, both], [both, east]])
    minor, major = (_ELLIPSE * math.sqrt(max(float(each), 0.0)) for each in variances)
    return major, minor, math.degrees(math.atan2(axes[1, 1], axes[0, 1])) % 180.0


def _on_route(row: Row, leg: Leg | None, route: Places) -> dict[str, Any]:
    if leg is None:
        return {"done": 1.0, "left": 0.0} if route and math.isfinite(row.time) else {}
    target = next((k for k in range(len(route)) if leg.destination == f"WP{k}"), None)
    left = done = math.nan
    if target is not None:
        legs = [math.dist(*ends) for ends in pairwise(route)]
        left = leg.distance + sum(legs[target:])
        done = min(max(1.0 - left / sum(legs), 0.0), 1.0)
    known = _known(
        cross_track=leg.cross_track,
        distance=leg.distance,
        left=left,
        done=done,
        bearing_deg=_compass(leg.bearing),
        steer_deg=_compass(leg.course_to_steer),
    )
    return known | {"target": target, "destination": leg.destination}


def _followed(guide: Guide | None) -> dict[str, Any]:
    if guide is None:
        return {}
    mode, course, dodges, offset, faster = guide.followed
    held = _known(held_deg=_compass(course))
    return held | {"mode": mode, "dodges": dodges, "offset": offset, "faster_kn": faster / KNOT}


def _ordered(order: Order | None) -> dict[str, Any]:
    if order is None:
        return {}
    desired = _known(
        asked_course_deg=_compass(order.course),
        asked_rate_dps=math.degrees(order.yaw_rate),
        asked_speed_kn=order.speed / KNOT,
        thrust=order.thrust,
        port=order.port,
        starboard=order.starboard,
    )
    return desired | {"state": str(order.state), "reason": order.reason, "is_engaged": bool(order.engaged)}


def _compass(angle: float) -> float:
    turned = math.degrees(angle) % 360.0
    return 0.0 if turned >= 360.0 else turned


def _known(**values: float) -> dict[str, Any]:
    """The finite ones of these values."""
    return {name: float(value) for name, value in values.items() if math.isfinite(value)}
