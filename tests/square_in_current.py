"""A square in a current over MAVLink, on a virtual clock: `python -m tests.square_in_current --current 1.0`.

A square of 80 m in a current towards the north-east, with a motorboat of 2 m/s like ArduPilot's: it turns 20 °/s, takes
GUIDED only once its EKF is ready, and its positions are 0.2 s late. Exits with 1 when it gives up, or is more than
0.6 m RMS off its legs. `--times 10` repeats that in ten directions of the current, `--no-compass` takes its compass
away.
"""

import argparse
import asyncio
import math
import sys
import tempfile
from pathlib import Path

from steerway.core.testing import displaced
from steerway.simulation.testing import OriginTable
from tests.ports import until
from tests.square import Course, cross_track, rms, sailed, square_of

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
    for corner in square_of(SIDE):
        lat, lon = map(math.degrees, displaced(*origin, *corner))
        lines += ["[[waypoint]]", f"lat_deg = {lat!r}", f"lon_deg = {lon!r}"]
    mission.write_text("\n".join(lines))
    return Course(scenario, mission, square_of(SIDE), vehicle=f"?cruise=2.0&ekf={ekf}&compass={int(compass)}")


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
    options = argparse.ArgumentParser("python -m tests.square_in_current", description=__doc__)
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
