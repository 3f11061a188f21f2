"""The loop on a desk: the simulated boat on its links, and what `steerway live` runs, on a virtual clock."""

import asyncio
import io
import logging
import math
import re
import signal
import socket
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import numpy as np

from steerway.live.testing import RunningBoat, Settings, SimulatedBoat, addresses, build_service
from steerway.simulation import load_scenario
from tests import hastened
from tests.command_line import STEERWAY
from tests.ports import free_port, until

ROOT = Path(__file__).parent.parent
START = 1_719_835_200.0  # Unix time
GUIDED = 15.0
TURN = 10.0  # m of a leg that belong to the turn before it
REACHED = 4.0  # m from a corner at which it is rounded
ENDED = re.compile("autopilot (stopped|finished)")
MOST = {"mavlink": 1.0, "propellers": 1.7}
"""m RMS off a leg of the Otter."""


class Course(NamedTuple):
    """What is sailed: the boat's scenario, the mission, its corners (m); the settings of `live`."""

    scenario: Path
    mission: Path
    corners: tuple[tuple[float, float], ...]
    settings: Settings = Settings()
    vehicle: str = ""  # options of its MAVLink address


def square_of(side):
    return (0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0)


OTTER = Course(
    ROOT / "examples" / "otter-square.toml",
    ROOT / "examples" / "live" / "square.toml",
    square_of(60.0),
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
    with mock.patch.object(build_service, "until_stopped") as run:
        build_service.launch(course.settings.overridden(**ends))
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

    level = logger.level
    logger.setLevel(logging.INFO)  # sets aside what the logger remembers of a level
    logger.addHandler(handler)
    try:
        hastened.run(both(), START)
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
    return boat.table(), text.getvalue()


@contextmanager
def two_processes(course, out):
    """A boat and a computer that steers it at their true pace, as a user starts them, with their files in a folder: the
    boat's process and the computer's log."""
    here, programs = f"127.0.0.1:{free_port(socket.SOCK_DGRAM)}", []
    ends = ("--from", f"mavlink:udpin:{here}", "--to", f"mavlink:udpin:{here}")
    steers = ("live", *ends, "--mission", course.mission, "--profile", course.settings.profile, "--engage")
    boat = ("simulate", course.scenario, "--live", "--mavlink", f"udpout:{here}{course.vehicle}", "-o", out)
    try:
        for arguments in (boat, steers):
            with open(out / f"{arguments[0]}.log", "w") as file:
                command = [*STEERWAY, *map(str, arguments)]
                programs.append(subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=file))
        yield programs[0], out / "live.log"
    finally:
        for each in reversed(programs):
            each.send_signal(signal.SIGINT)
            each.wait(120.0)


def by_processes(course, longest):
    """The same by two processes, until the autopilot stops or for so many s."""
    import polars as pl

    out, begun = course.scenario.parent, time.monotonic()
    with two_processes(course, out) as (_, log):
        while time.monotonic() - begun < longest and not ENDED.search(log.read_text()):
            time.sleep(0.5)
    return pl.read_parquet(out / "run.parquet"), log.read_text()


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
