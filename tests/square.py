"""The loop on a desk, in two processes: the simulated boat as a MAVLink vehicle, and `steerway live` that steers her.

`python -m tests.square [FACTOR [propellers]]` sails the square of the examples at its true pace, or so many times
faster, and says how far off the legs she was.
"""

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

import numpy as np

from tests.ports import free_port

ROOT = Path(__file__).parent.parent
SQUARE = ROOT / "examples" / "otter-square.toml"
MISSION = ROOT / "examples" / "live" / "square.toml"
CORNERS = ((0.0, 0.0), (60.0, 0.0), (60.0, 60.0), (0.0, 60.0), (0.0, 0.0))
GUIDED = 15.0
REACHED = 4.0  # m from a corner at which it is rounded
MOST = {"mavlink": 1.0, "propellers": 1.7}
"""m RMS off a leg."""
TURN = 10.0  # m of a leg that belong to the turn before it


class Program:
    """A steerway command in a world that is `factor` times faster; what it says on stderr is at hand as it comes."""

    def __init__(self, factor, directory, *arguments):
        self.log = Path(directory) / f"{arguments[0]}.log"
        self._file = open(self.log, "w")
        command = [sys.executable, "-m", "tests.hurried", str(factor), *map(str, arguments)]
        self.process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=self._file)

    @property
    def said(self) -> str:
        return self.log.read_text()

    def until(self, pattern, patience=60.0) -> float:
        """The moment at which it has said something, monotonic; it must not have ended before."""
        begun = time.monotonic()
        while not re.search(pattern, self.said):
            assert time.monotonic() - begun < patience, f"{pattern!r} was never said in:\n{self.said}"
            assert self.process.poll() is None, f"it ended:\n{self.said}"
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
def desk(directory, factor, by="mavlink"):
    """The boat and the computer aboard, engaged; they talk MAVLink, or sentences and propeller commands."""
    there, here = (f"127.0.0.1:{free_port(socket.SOCK_DGRAM)}" for _ in range(2))
    if by == "mavlink":
        links = "--mavlink", f"udpout:{here}"
        ends = f"mavlink:udpin:{here}", f"mavlink:udpin:{here}"
    else:
        links = "--to", f"udp://{here}", "--propellers", f"udp://{there}"
        ends = f"udp://{here}", f"udp://{there}?format=propellers"
    boat = Program(factor, directory, "simulate", SQUARE, "--live", *links, "-o", directory)
    route = "--mission", MISSION, "--profile", "otter", "--engage"
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


def cross_track(run) -> list[np.ndarray]:
    """True distances (m) from the second and each further leg while she was steered, without the turn that leads to it.

    On the first leg she comes from wherever she was.
    """
    import polars as pl

    steered = run.filter((pl.col("mode") == GUIDED) | (pl.col("mode").is_null() & pl.col("asked_speed_mps").is_null()))
    legs = [[]]
    for place in zip(steered["true_north_m"], steered["true_east_m"], strict=True):
        start, stop = CORNERS[len(legs) - 1 : len(legs) + 1]
        along, across = seen(place, start, stop)
        if along > TURN:
            legs[-1].append(across)
        if math.dist(place, stop) < REACHED or along > math.dist(start, stop):
            if len(legs) == len(CORNERS) - 1:
                break
            legs.append([])
    return [np.array(leg) for leg in legs[1:]]


def seen(place, start, stop):
    """Along and across the leg, m."""
    length = math.dist(start, stop)
    ahead = (stop[0] - start[0]) / length, (stop[1] - start[1]) / length
    north, east = place[0] - start[0], place[1] - start[1]
    return north * ahead[0] + east * ahead[1], east * ahead[0] - north * ahead[1]


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def main(factor, by) -> None:
    with tempfile.TemporaryDirectory() as directory:
        with desk(directory, factor, by) as (_, computer):
            computer.until("stopped", 400.0 / factor + 30.0)
            print(computer.said)
        legs = cross_track(truth(directory))
    print("RMS cross-track after the turns, m:", *(f"{rms(leg):.2f}" for leg in legs))
    if len(legs) < 3 or max(map(rms, legs)) > MOST[by]:
        sys.exit(f"more than {MOST[by]} m, or not all of the square")


if __name__ == "__main__":
    chosen = dict(enumerate(sys.argv))
    main(float(chosen.get(1, 1.0)), chosen.get(2, "mavlink"))
