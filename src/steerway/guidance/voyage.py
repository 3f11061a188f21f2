"""Missions one after another, with station keeping between them."""

import math
from collections.abc import Sequence
from dataclasses import replace

from steerway.core.checks import not_negative
from steerway.core.errors import InputError
from steerway.core.leg import LegState
from steerway.guidance.mission_log import Passage
from steerway.guidance.route import Route
from steerway.guidance.waypoints import Mission, Passing, Phase


class Voyage:
    """A mission that keeps station at some of its waypoints for a time; steps and phases are those of `Mission`.

    The route between two stays is one mission, which ends holding. The waypoints' indices are those of the whole route.
    """

    given_course = math.nan

    def __init__(
        self,
        route: Route,
        stays: Sequence[float] = (),
        passing: Passing | None = None,
        *,
        start: str = "line",
        at_end: str = "stop",
    ):
        """`stays`: duration (s) at each waypoint of the route, 0 for none; the first and the last must be 0."""
        stays = list(stays) or [0.0] * len(route)
        if len(stays) != len(route):
            raise InputError(f"voyage has {len(stays)} stays, expected one for each of the {len(route)} waypoints")
        for index, stay in enumerate(stays):
            not_negative(f"route.waypoint[{index}].stay", stay)
        if stays[0] > 0.0 or stays[-1] > 0.0:
            index = 0 if stays[0] > 0.0 else len(route) - 1
            raise InputError(
                f"route.waypoint[{index}].stay is {stays[index]:g} s, expected 0 at the first and the last waypoint "
                "(at_end sets what happens at the last)"
            )
        ends = [index for index, stay in enumerate(stays) if stay > 0.0] + [len(route) - 1]
        self._firsts = [0, *ends[:-1]]
        self._stays = [stays[index] for index in ends[:-1]] + [math.inf]
        self.missions = [
            Mission(
                _part(route, first, last),
                passing,
                start=start if first == 0 else "line",
                at_end=at_end if last == len(route) - 1 else "hold",
            )
            for first, last in zip(self._firsts, ends, strict=True)
        ]
        self._part = 0
        self._stayed = 0.0

    @property
    def phase(self) -> Phase:
        """What the boat should be doing."""
        return self.missions[self._part].phase

    @property
    def following(self) -> float:
        """See `Mission.following`."""
        return self.missions[self._part].following

    @property
    def lead(self) -> float:
        """See `Mission`."""
        return self.missions[self._part].lead

    @lead.setter
    def lead(self, lead: float) -> None:
        self.missions[self._part].lead = lead

    @property
    def preview(self) -> float:
        """See `Mission`."""
        return self.missions[self._part].preview

    @preview.setter
    def preview(self, preview: float) -> None:
        self.missions[self._part].preview = preview

    def step(self, north: float, east: float, dt: float, effort: float = 0.0) -> LegState:
        """See `Mission.step`."""
        mission = self.missions[self._part]
        leg = mission.step(north, east, dt, effort)
        if mission.phase is Phase.HOLDING:
            self._stayed += dt
            if self._stayed > self._stays[self._part]:
                self._part, self._stayed = self._part + 1, 0.0
                return self.step(north, east, 0.0)
        first = self._firsts[self._part]
        return leg._replace(target=leg.target + first) if first else leg

    @property
    def passages(self) -> list[Passage]:
        """Passages of the waypoints so far; their times count time under way, without the stays."""
        done, time, sailed = [], 0.0, 0.0
        for first, mission in zip(self._firsts, self.missions, strict=True):
            for each in mission.log.passages:
                done.append(
                    each._replace(waypoint=each.waypoint + first, time=each.time + time, sailed=each.sailed + sailed)
                )
            time += mission.log.time
            sailed += mission.log.distance
        return done


def _part(route: Route, first: int, last: int) -> Route:
    chosen = slice(first, last + 1)
    part = Route(route.north[chosen], route.east[chosen], route.acceptance[chosen], route.speed[chosen])
    return replace(part, corners=route.corners, corner_radius=route.corner_radius)
