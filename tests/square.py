"""The loop on a desk, in two processes: the simulated boat as a MAVLink vehicle, and `steerway live` that steers her.

`python -m tests.square --current 1.0` sails a square of 80 m, at its true pace, in a current towards the north-east,
with a motorboat of 2 m/s like ArduPilot's: it turns 20 °/s, takes GUIDED only once its EKF is ready, and its
positions are 0.2 s late. It exits with 1 when it gives up, or is more than 0.6 m RMS off its legs. `--times 10`
repeats that in ten directions of the current, `--no-compass` takes its compass away.
"""

import argparse
import math
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.ports import free_port

ROOT = Path(__file__).parent.parent
GUIDED = 15.0
TURN = 10.0  # m of a leg that belong to the turn before it
REACHED = 4.0  # m from a corner at which it is rounded
MOST = {"mavlink": 1.0, "propellers": 1.7}
"""m RMS off a leg of the Otter."""


class Course(NamedTuple):
    """What is sailed: the boat's scenario, the mission, its corners (m); how `live` is started."""

    scenario: Path
    mission: Path
    corners: tuple[tuple[float, float], ...]
    options: tuple[str, ...] = ()
    vehicle: str = ""  # options of its MAVLink address


def _square(side):
    return (0.0, 0.0), (side, 0.0), (side, side), (0.0, side), (0.0, 0.0)


OTTER = Course(
    ROOT / "examples" / "otter-square.toml",
    ROOT / "examples" / "live" / "square.toml",
    _square(60.0),
    ("--profile", "otter"),
)


class Program:
    """A steerway command in a world that is `factor` times faster; what it says on stderr is at hand as it comes."""

    def __init__(self, factor, directory, *arguments):
        self.log = Path(directory) / f"{arguments[0]}.log"
        self._file = open(self.log, "w")
        command = [sys.executable, "-m", "tests.hurried", str(factor), *map(str, arguments)]
        self.process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=self._file)

    @property
    def output(self) -> str:
        return self.log.read_text()

    def until(self, pattern, patience=150.0) -> float:
        """The moment at which it has said something, monotonic; it must not have ended before."""
        begun = time.monotonic()
        while not re.search(pattern, self.output):
            assert time.monotonic() - begun < patience, f"{pattern!r} was never said in:\n{self.output}"
            assert self.process.poll() is None, f"it ended:\n{self.output}"
            time.sleep(0.005)
        return time.monotonic()

    def tell(self, number) -> None:
        self.process.send_signal(number)

    def end(self) -> None:
        """Ended as a user ends it, and its file closed."""
        if self.process.poll() is None:
            self.tell(signal.SIGCONT)
            self.tell(signal.SIGINT)
            try:
                self.process.wait(20.0)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self._file.close()


@contextmanager
def desk(directory, factor, by="mavlink", course=OTTER):
    """The boat and the computer aboard, engaged; they talk MAVLink, or sentences and propeller commands."""
    there, here = (f"127.0.0.1:{free_port(socket.SOCK_DGRAM)}" for _ in range(2))
    if by == "mavlink":
        links = "--mavlink", f"udpout:{here}{course.vehicle}"
        ends = f"mavlink:udpin:{here}", f"mavlink:udpin:{here}"
    else:
        links = "--to", f"udp://{here}", "--propellers", f"udp://{there}"
        ends = f"udp://{here}", f"udp://{there}?format=propellers"
    boat = Program(factor, directory, "simulate", course.scenario, "--live", *links, "-o", directory)
    route = "--mission", course.mission, *course.options, "--engage"
    computer = Program(factor, directory, "live", "--from", ends[0], "--to", ends[1], *route)
    try:
        yield boat, computer
    finally:
        computer.end()
        boat.end()


def truth(directory):
    """What the boat kept of her run, a polars DataFrame."""
    import polars as pl

    return pl.read_parquet(Path(directory) / "run.parquet")


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
    from steerway.core.testing import displaced
    from steerway.simulation.testing import OriginTable

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
    return Course(scenario, mission, _square(SIDE), (), f"?cruise=2.0&ekf={ekf}&compass={int(compass)}")


def sail(current, direction, compass, seed, factor=1.0, ekf=10.0) -> tuple[bool, str]:
    """One square: whether it was sailed within the limit, and what came of it."""
    with tempfile.TemporaryDirectory() as directory:
        course = rover(directory, current, direction, compass, seed, ekf)
        with desk(directory, factor, course=course) as (_, computer):
            begun = time.monotonic()
            while "stopped" not in computer.output and time.monotonic() - begun < 300.0 / factor:
                if computer.process.poll() is not None:
                    break
                time.sleep(0.1)
            output, lasted = computer.output, factor * (time.monotonic() - begun)
        legs = [rms(leg) for leg in cross_track(truth(directory), course.corners, AROUND) if len(leg)]
    finished = "the route is finished" in output
    sailed = finished and len(legs) == 3 and max(legs) <= ROVER_MOST
    why = "" if finished else "; " + (output.strip().splitlines() or ["it said nothing"])[-1]
    return sailed, f"legs {' '.join(f'{leg:.2f}' for leg in legs)} m RMS in {lasted:.0f} s{why}"


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("--current", type=float, default=0.5, help="m/s")
    options.add_argument("--times", type=int, default=1, help="squares, each in another direction of the current")
    options.add_argument("--no-compass", action="store_true")
    options.add_argument("--factor", type=float, default=1.0, help="times faster than the true pace")
    options.add_argument("--ekf", type=float, default=10.0, help="s until the vehicle takes GUIDED")
    chosen = options.parse_args()
    good = 0
    for k in range(chosen.times):
        direction = 45.0 + 360.0 * k / chosen.times
        sailed, words = sail(chosen.current, direction, not chosen.no_compass, k + 1, chosen.factor, chosen.ekf)
        good += sailed
        print(
            f"current {chosen.current:g} m/s to {direction % 360.0:.0f}°: {'sailed' if sailed else 'MISSED'}, {words}",
            flush=True,
        )
    print(f"{good} of {chosen.times}")
    if good < chosen.times:
        sys.exit(1)


if __name__ == "__main__":
    main()
