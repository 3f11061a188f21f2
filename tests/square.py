"""The loop on a desk: the simulated boat as a vehicle on its links, and what `steerway live` runs, on a virtual clock.

`python -m tests.square --current 1.0` sails a square of 80 m in a current towards the north-east, with a motorboat of
2 m/s like ArduPilot's: it turns 20 °/s, takes GUIDED only once its EKF is ready, and its positions are 0.2 s late. It
exits with 1 when it gives up, or is more than 0.6 m RMS off its legs. `--times 10` repeats that in ten directions of
the current, `--no-compass` takes its compass away.
"""

import argparse
import asyncio
import io
import logging
import math
import socket
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import numpy as np

from steerway.core.testing import displaced
from steerway.live.testing import RunningBoat, Settings, SimulatedBoat, addresses, live_launch
from steerway.simulation import load_scenario
from steerway.simulation.testing import OriginTable
from tests import hastened
from tests.ports import free_port, until

ROOT = Path(__file__).parent.parent
GUIDED = 15.0
TURN = 10.0  # m of a leg that belong to the turn before it
REACHED = 4.0  # m from a corner at which it is rounded
MOST = {"mavlink": 1.0, "propellers": 1.7}
"""m RMS off a leg of the Otter."""


class Course(NamedTuple):
    """What is sailed: the boat's scenario, the mission, its corners (m); the settings of `live`."""

    scenario: Path
    mission: Path
    corners: tuple[tuple[float, float], ...]
    settings: Settings = Settings()
    vehicle: str = ""  # options of its MAVLink address


def _square(side):
    return (0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0)


OTTER = Course(
    ROOT / "examples" / "otter-square.toml",
    ROOT / "examples" / "live" / "square.toml",
    _square(60.0),
    Settings(profile="otter"),
)


def sailed(course, act, by="mavlink"):
    """(truth at every fix as a polars DataFrame, what was logged) of a boat that is engaged and then sails while
    `act(log)` runs, which gets a function that gives the log so far.

    Boat and computer talk MAVLink, or sentences and propeller commands.
    """
    there, here = (f"127.0.0.1:{free_port(socket.SOCK_DGRAM)}" for _ in range(2))
    model = SimulatedBoat(load_scenario(course.scenario))
    if by == "mavlink":
        vehicle = addresses.vehicle(f"udpout:{here}{course.vehicle}")
        cruise = vehicle.number("cruise", 0.0) or None
        boat = RunningBoat(model, mavlink=vehicle, cruise=cruise, keeps=True)
        inputs, outputs = [f"mavlink:udpin:{here}"] * 2
    else:
        driven = addresses.datagrams(f"udp://{there}")
        boat = RunningBoat(model, [addresses.stream(f"udp://{here}")], propellers=driven, keeps=True)
        inputs, outputs = f"udp://{here}", f"udp://{there}?format=propellers"
    ends = {"inputs": (inputs,), "outputs": (outputs,), "mission": str(course.mission), "engage": True}
    with mock.patch.object(live_launch, "until_stopped") as run:
        live_launch.launch(course.settings.overridden(**ends))
    ((computer,), _) = run.call_args
    text = io.StringIO()
    handler, logger = logging.StreamHandler(text), logging.getLogger("steerway.live")

    async def both():
        tasks = [asyncio.create_task(each) for each in (boat.run(), computer)]
        try:
            await until(lambda: "autopilot running" in text.getvalue(), 150.0)
            await act(text.getvalue)
        finally:
            for task in reversed(tasks):  # the computer ends first and gives the boat back
                task.cancel()
                await asyncio.gather(task, return_exceptions=True)

    with mock.patch.object(logger, "level", logging.INFO):
        logger.addHandler(handler)
        try:
            hastened.run(both())
        finally:
            logger.removeHandler(handler)
    return boat.table(), text.getvalue()


def cross_track(run, corners=OTTER.corners, turn=TURN) -> list[np.ndarray]:
    """True distances (m) from the second and each further leg while she was steered, without the turns at its ends.

    On the first leg she comes from wherever she was.
    """
    import polars as pl

    steered = run.filter((pl.col("mode") == GUIDED) | (pl.col("mode").is_null() & pl.col("asked_speed_mps").is_null()))
    legs = [[]]
    for place in zip(steered["true_north_m"], steered["true_east_m"], strict=True):
        start, stop = corners[len(legs) - 1 : len(legs) + 1]
        along, across = seen(place, start, stop)
        length = math.dist(start, stop)
        if turn < along < length - turn:
            legs[-1].append(across)
        is_round = (
            len(legs) < len(corners) - 1 and along > length - turn and _has_turned(place, stop, corners[len(legs) + 1])
        )
        if math.dist(place, stop) < REACHED or along > length or is_round:
            if len(legs) == len(corners) - 1:
                break
            legs.append([])
    return [np.array(leg) for leg in legs[1:]]


def _has_turned(place, corner, after):
    """Whether a boat that cut a corner is on the leg behind it."""
    along, across = seen(place, corner, after)
    return along > 0.0 and abs(across) < REACHED


def seen(place, start, stop):
    """Along and across the leg, m."""
    length = math.dist(start, stop)
    ahead = (stop[0] - start[0]) / length, (stop[1] - start[1]) / length
    north, east = place[0] - start[0], place[1] - start[1]
    return north * ahead[0] + east * ahead[1], east * ahead[0] - north * ahead[1]


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


SIDE, AROUND, ROVER_MOST = 80.0, 15.0, 0.6
"""m: the rover's square, what of a leg belongs to the turns at its ends, and the largest RMS."""

SCENARIO = """
name = "A motorboat of 2 m/s in a current"
seed = {seed}
[vessel]
kind = "motorboat"
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


def rover(directory, current, direction, compass=True, seed=1, ekf=10.0) -> Course:
    """The motorboat in a current (m/s) towards a direction (°); its files are written into a directory."""
    home = OriginTable()
    origin = math.radians(home.latitude_deg), math.radians(home.longitude_deg)
    scenario, mission = Path(directory) / "rover.toml", Path(directory) / "mission.toml"
    text = SCENARIO.format(current=current, direction=direction, seed=seed, compass="[compass]" if compass else "")
    scenario.write_text(text)
    lines = ["lookahead = 10.0", "acceptance = 4.0", "speed_mps = 2.0", "[boat]", "top_speed_mps = 2.0"]
    for corner in _square(SIDE):
        lat, lon = map(math.degrees, displaced(*origin, *corner))
        lines += ["[[waypoint]]", f"lat_deg = {lat!r}", f"lon_deg = {lon!r}"]
    mission.write_text("\n".join(lines))
    return Course(scenario, mission, _square(SIDE), vehicle=f"?cruise=2.0&ekf={ekf}&compass={int(compass)}")


def sail(current, direction, compass, seed, ekf=10.0) -> tuple[bool, str]:
    """One square: whether it was sailed within the limit, and what came of it."""
    lasted = 0.0

    async def to_the_end(log):
        nonlocal lasted
        begun = asyncio.get_running_loop().time()
        await until(lambda: "stopped" in log(), 300.0)
        lasted = asyncio.get_running_loop().time() - begun

    with tempfile.TemporaryDirectory() as directory:
        course = rover(directory, current, direction, compass, seed, ekf)
        try:
            run, log = sailed(course, to_the_end)
        except AssertionError as error:
            return False, str(error)
    legs = [rms(leg) for leg in cross_track(run, course.corners, AROUND) if len(leg)]
    finished = "the route is finished" in log
    why = "" if finished else "; " + next(line for line in log.splitlines() if "stopped" in line)
    good = finished and len(legs) == 3 and max(legs) <= ROVER_MOST
    return good, f"legs {' '.join(f'{leg:.2f}' for leg in legs)} m RMS in {lasted:.0f} s{why}"


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("--current", type=float, default=0.5, help="m/s")
    options.add_argument("--times", type=int, default=1, help="squares, each in another direction of the current")
    options.add_argument("--no-compass", action="store_true")
    options.add_argument("--ekf", type=float, default=10.0, help="s until the vehicle takes GUIDED")
    chosen = options.parse_args()
    good = 0
    for k in range(chosen.times):
        direction = 45.0 + 360.0 * k / chosen.times
        is_good, words = sail(chosen.current, direction, not chosen.no_compass, k + 1, chosen.ekf)
        good += is_good
        print(
            f"current {chosen.current:g} m/s to {direction % 360.0:.0f}°: {'sailed' if is_good else 'MISSED'}, {words}",
            flush=True,
        )
    print(f"{good} of {chosen.times}")
    if good < chosen.times:
        sys.exit(1)


if __name__ == "__main__":
    main()
