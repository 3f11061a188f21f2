"""The bench: a simulated rover and `steerway live` in one process, on one virtual clock, over real MAVLink bytes.

    python -m tests.bench --jobs 2

Each run sails a route of four legs of 80 m with a motorboat of 2 m/s like ArduPilot's, positions 0.2 s late, in a
current: 16 directions, four speeds, three seeds, with and without a compass. A line a run: what each corner was, and
the legs; then a table. Exits with 1 where one misses a limit of `Limits`.
"""

import argparse
import asyncio
import math
import multiprocessing
import re
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import numpy as np

from steerway.core import rms
from steerway.core.testing import displaced
from steerway.live.testing import RunningBoat, Settings
from steerway.simulation.testing import OriginTable
from tests.square import ENDED, GUIDED, Course, by_processes, cross_track, sailed, seen

LEGS, SIDE, AROUND = 4, 80.0, 15.0
"""Number of legs, their length (m), and what of a leg belongs to the turns at its ends (m)."""
NEAR = 30.0
"""m from a waypoint within which its corner is judged."""
LONGEST = 900.0
"""s that a run may take."""

SCENARIO = """
name = "A motorboat of 2 m/s in a current"
seed = {seed}
[vessel]
kind = "motorboat"
turn_rate_deg = {turn_rate}
[environment.current]
speed = {current}
direction_deg = {direction}
[gnss]
rate = 5.0
white = 0.1
markov = []
latency = 0.2
velocity_std = 0.1
{compass}
[route]
waypoints = [{{ north = 0.0, east = 0.0 }}, {{ north = 80.0, east = 0.0 }}]
"""


class Limits(NamedTuple):
    """Limits of a run, m: closest approach to each waypoint, distance outside of its corner, cross-track RMS."""

    closest: float = 1.5
    outside: float = 1.0
    legs: float = 0.35


class Case(NamedTuple):
    """One run: m/s, degrees towards which the current sets, degrees of each corner, degrees/s; told: degrees/s that
    the vehicle says it turns, NaN: what it does; ekf: s until it takes GUIDED; dead: s after the
    start at which the motor dies.
    """

    current: float = 0.5
    direction: float = 45.0
    compass: bool = True
    seed: int = 1
    corner: float = 90.0
    turn_rate: float = 80.0
    told: float = math.nan
    speed: float = 2.0
    acceptance: float = 4.0
    ekf: float = 10.0
    dead: float = math.inf

    @property
    def words(self) -> str:
        """The case in a line."""
        compass = "compass" if self.compass else "no compass"
        return (
            f"{self.current:g} m/s to {self.direction:5.1f}°, {compass}, seed {self.seed}, corners {self.corner:g}°, "
            f"{self.turn_rate:g}°/s"
        )


class Corner(NamedTuple):
    """A corner as it was sailed; degrees and m. planned: the turn of the bow that was planned, NaN where none was."""

    turned: float
    planned: float
    closest: float
    outside: float

    @property
    def is_wrong_way(self) -> bool:
        """Whether the bow did not turn to the side planned."""
        return abs(self.turned - self.planned) > 180.0


class Found(NamedTuple):
    """The result of a run."""

    case: Case
    finished: bool
    seconds: float
    legs: list[float]
    corners: list[Corner]
    why: str = ""
    off: float = math.nan  # m, largest distance from the route while steered

    def misses(self, limits: Limits) -> list[str]:
        """A sentence for each exceeded limit."""
        if not self.finished:
            return [f"not finished: {self.why}"]
        closest = limits.closest if self.case.turn_rate >= 80.0 else self.case.acceptance
        outside = limits.outside if self.case.turn_rate >= 80.0 else self.case.acceptance
        missed = [f"leg {k + 2}: {leg:.2f} m RMS" for k, leg in enumerate(self.legs) if not leg <= limits.legs]
        missed += [f"only {len(self.legs)} legs"] if len(self.legs) < LEGS - 1 else []
        for k, corner in enumerate(self.corners, start=1):
            if corner.is_wrong_way:
                missed.append(f"corner {k}: turned {corner.turned:+.0f}°, planned {corner.planned:+.0f}°")
            if not corner.closest <= closest:
                missed.append(f"corner {k}: {corner.closest:.1f} m from the waypoint")
            if not corner.outside <= outside:
                missed.append(f"corner {k}: {corner.outside:.1f} m outside")
        return missed

    @property
    def words(self) -> str:
        """Legs and corners in a line."""
        legs = " ".join(f"{leg:.2f}" for leg in self.legs)
        corners = ", ".join(
            f"{each.closest:.1f}/{each.outside:.1f} ({each.turned:+.0f}° of {each.planned:+.0f}°)"
            for each in self.corners
        )
        return f"legs {legs} m RMS, corners {corners}, {self.seconds:.0f} s, {self.off:.1f} m off at most"


def route(corner: float) -> tuple[tuple[float, float], ...]:
    """Waypoints (m) of legs that turn to starboard by so many degrees at each corner."""
    points, course = [(0.0, 0.0)], 0.0
    for _ in range(LEGS):
        north, east = points[-1]
        points.append((north + SIDE * math.cos(course), east + SIDE * math.sin(course)))
        course += math.radians(corner)
    return tuple(points)


def course_of(case: Case, directory: str | Path) -> Course:
    """The files of a case, written into a directory."""
    home = OriginTable()
    origin = math.radians(home.latitude_deg), math.radians(home.longitude_deg)
    scenario, mission = Path(directory) / "rover.toml", Path(directory) / "mission.toml"
    keys = case._asdict() | {"compass": "[compass]" if case.compass else ""}
    scenario.write_text(SCENARIO.format(**keys))
    lines = ["lookahead = 10.0", f"acceptance = {case.acceptance}", f"speed_mps = {case.speed}"]
    lines += ["[boat]", "top_speed_mps = 2.0"]
    for place in route(case.corner):
        lat, lon = map(math.degrees, displaced(*origin, *place))
        lines += ["[[waypoint]]", f"lat_deg = {lat!r}", f"lon_deg = {lon!r}"]
    mission.write_text("\n".join(lines))
    vehicle = f"?cruise=2.0&ekf={case.ekf}&compass={int(case.compass)}"
    vehicle += f"&turn={case.turn_rate if math.isnan(case.told) else case.told}"
    # With a profile nothing is inferred beside the run, by a thread whose pace is not that of the virtual clock.
    return Course(scenario, mission, route(case.corner), Settings(profile="small-usv"), vehicle)


async def _to_the_end(log):
    for _ in range(int(LONGEST)):
        if ENDED.search(log()):
            return
        await asyncio.sleep(1.0)


def sail(case: Case, true_pace: bool = False) -> Found:
    """One run, on the virtual clock or by two processes at their true pace."""
    with tempfile.TemporaryDirectory() as directory:
        course = course_of(case, directory)
        try:
            with mock.patch.object(RunningBoat, "_command", _dying(case.dead)):
                run, log = by_processes(course, LONGEST) if true_pace else sailed(course, _to_the_end)
        except AssertionError as error:
            return Found(case, False, math.nan, [], [], str(error))
    stops = [line for line in log.splitlines() if "stopped" in line]
    finished = "autopilot finished" in log
    why = "" if finished else next(iter(stops), f"not within {LONGEST:g} s")
    legs = [rms(leg) for leg in cross_track(run, course.corners, AROUND) if len(leg)]
    steered = run.filter(run["mode"] == GUIDED)
    seconds = float(steered["time_s"][-1] - steered["time_s"][0]) if len(steered) else math.nan
    off = _off_route(steered, course.corners) if len(steered) else math.nan
    return Found(case, finished, seconds, legs, corners_of(steered, course.corners, log), why, off)


def _dying(dead):
    """The boat's commands, which do nothing from a time (s) on."""
    command = RunningBoat._command
    return lambda boat, now: command(boat, now) if now < dead else boat._loops.rest()


def _off_route(run, points):
    """Largest distance (m) from all legs, of what was sailed since the first leg was reached; NaN where it was not."""
    most, reached = 0.0, False
    for place in zip(run["true_north_m"], run["true_east_m"], strict=True):
        nearest = math.inf
        for start, stop in pairwise(points):
            along, across = seen(place, start, stop)
            length = math.dist(start, stop)
            nearest = min(nearest, math.hypot(across, along - min(length, max(0.0, along))))
        reached |= nearest < 2.0
        most = max(most, nearest) if reached else most
    return most if reached else math.nan


def corners_of(run, points, log: str = "") -> list[Corner]:
    """Each corner of a route, by the truth at every fix and the turns that the log says were planned."""
    places = np.column_stack([run["true_north_m"], run["true_east_m"]])
    heading = np.degrees(np.unwrap(np.radians(run["true_heading_deg"].to_numpy())))
    planned = {int(leg): float(turn) for turn, leg in re.findall(r"turns by ([+-]\d+)° into leg (\d+)", log)}
    found, since = [], 0
    for k in range(1, len(points) - 1):
        before, after = _middle(places, points[k - 1], points[k], since), None
        if before is not None:
            after = _middle(places, points[k], points[k + 1], before)
        if after is None:
            break
        found.append(_corner(places, heading, before, after, points[k - 1 : k + 2], planned.get(k + 1, math.nan)))
        since = after
    return found


def _middle(places, start, stop, since):
    """The first row from `since` on at which the middle of a leg is passed near to it; None for none."""
    for row in range(since, len(places)):
        along, across = seen(places[row], start, stop)
        if 0.5 * SIDE <= along <= 0.75 * SIDE and abs(across) < 0.25 * SIDE:
            return row
    return None


def _corner(places, heading, before, after, points, planned):
    """Between two rows, in the middles of the legs."""
    rows = np.arange(before, after, 0.1)
    north, east = (np.interp(rows, np.arange(len(places)), places[:, axis]) for axis in (0, 1))
    closest = float(np.min(np.hypot(north - points[1][0], east - points[1][1])))
    turned = float(heading[after] - heading[before])
    side = math.copysign(1.0, seen(points[2], *points[:2])[1])
    outside = 0.0
    for place in zip(north, east, strict=True):
        if math.dist(place, points[1]) < NEAR:
            outside = max(outside, _outside(place, points, side))
    return Corner(turned, planned, closest, outside)


def _outside(place, points, side):
    """Distance (m) of a place from the two legs of a corner to this side; 0 inside of the corner."""
    off = [seen(place, *points[k : k + 2]) for k in (0, 1)]
    if all(side * across >= 0.0 for _, across in off):
        return 0.0
    first = math.hypot(off[0][1], max(off[0][0] - SIDE, 0.0))
    return min(first, math.hypot(off[1][1], min(off[1][0], 0.0)))


def main() -> None:
    options = argparse.ArgumentParser("python -m tests.bench", description=__doc__.partition("\n")[0])
    options.add_argument("--current", type=float, nargs="+", default=[0.0, 0.5, 1.0, 1.3], help="m/s")
    options.add_argument("--directions", type=int, default=16, help="of the current, evenly over the circle")
    options.add_argument("--first", type=float, default=0.0, help="degrees, the first of them")
    options.add_argument("--compass", choices=("yes", "no", "both"), default="both")
    options.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    options.add_argument("--corner", type=float, nargs="+", default=[90.0], help="degrees of each turn")
    options.add_argument("--turn-rate", type=float, nargs="+", default=[80.0], help="the vehicle's largest, degrees/s")
    options.add_argument("--told", type=float, default=math.nan, help="what the vehicle says of it, degrees/s")
    options.add_argument("--dead", type=float, default=math.inf, help="s after the start at which the motor dies")
    options.add_argument("--speed", type=float, default=2.0, help="of the route, m/s")
    options.add_argument("--acceptance", type=float, default=4.0, help="m")
    options.add_argument("--jobs", type=int, default=1)
    options.add_argument("--true-pace", action="store_true", help="two processes as a user starts them; minutes a run")
    chosen = options.parse_args()
    cases = [
        Case(current, (chosen.first + 360.0 * k / chosen.directions) % 360.0, compass, seed, corner, rate)._replace(
            dead=chosen.dead, told=chosen.told, speed=chosen.speed, acceptance=chosen.acceptance
        )
        for current in chosen.current
        for corner in chosen.corner
        for rate in chosen.turn_rate
        for compass in {"yes": [True], "no": [False], "both": [True, False]}[chosen.compass]
        for k in range(chosen.directions if current else 1)
        for seed in chosen.seeds
    ]
    found: list[Found] = []
    with ProcessPoolExecutor(chosen.jobs, multiprocessing.get_context("spawn")) as workers:
        for each in workers.map(partial(sail, true_pace=chosen.true_pace), cases):
            found.append(each)
            misses = each.misses(Limits())
            print(
                f"{each.case.words}: {'MISSED ' + '; '.join(misses) + '; ' if misses else ''}{each.words}", flush=True
            )
    print(table(found))
    if any(each.misses(Limits()) for each in found):
        sys.exit(1)


def table(found: Sequence[Found]) -> str:
    """A row for each current, corner and compass: how many runs are within the limits, and the worst of them, m."""
    lines = ["current  corner  compass  within  finished  wrong way  closest  outside  legs"]
    groups: dict[tuple[float, float, bool], list[Found]] = {}
    for each in found:
        groups.setdefault((each.case.current, each.case.corner, each.case.compass), []).append(each)
    for (current, corner, compass), runs in groups.items():
        corners = [corner for each in runs for corner in each.corners]
        good, done = sum(not each.misses(Limits()) for each in runs), sum(each.finished for each in runs)
        wrong = sum(each.is_wrong_way for each in corners)
        closest = max((each.closest for each in corners), default=math.nan)
        outside = max((each.outside for each in corners), default=math.nan)
        legs = max((leg for each in runs for leg in each.legs), default=math.nan)
        within, with_compass = f"{good}/{len(runs)}", "yes" if compass else "no"
        lines.append(
            f"{current:7g}  {corner:6g}  {with_compass:>7}  {within:>6}  {done:8}  {wrong:9}  "
            f"{closest:7.1f}  {outside:7.1f}  {legs:4.2f}"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
