"""The simulated boat in real time: her steps at their beat, her receiver's sentences, her MAVLink, her propellers."""

import asyncio
import logging
import math
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from steerway.core.checks import positive
from steerway.formats.nmea0183.writing import gga, hdt, rmc
from steerway.live.links.mavlink import MavlinkLink
from steerway.live.links.speakers import Speaker
from steerway.live.mavlink.dialect import RoverMode
from steerway.live.simulated.boat import SimulatedBoat
from steerway.live.simulated.inner_loops import InnerLoops
from steerway.live.simulated.propellers import Propellers
from steerway.live.simulated.rover import Rover, Target
from steerway.live.simulated.skipper import Skipper
from steerway.live.uri import Uri

LOG = logging.getLogger("steerway.live")
_BEHIND = 1.0  # s by which steps may be late before they are left out
_TALKER = "GP"
COLUMNS = (
    "time_s",
    "true_north_m",
    "true_east_m",
    "true_lat_deg",
    "true_lon_deg",
    "true_heading_deg",
    "true_sog_mps",
    "true_cog_deg",
    "true_yaw_rate_dps",
    "asked_speed_mps",
    "asked_yaw_rate_dps",
    "mode",
)
"""What is kept of every fix; `mode` is null without MAVLink, and what is asked with engines off."""


class Running:
    """A boat under way: by GUIDED where it is on, by her propellers' commands once there were any, else by hand.

    speakers: links on which her receiver says GGA and RMC, and HDT with a compass.
    mavlink, cruise: the address on which she is a MAVLink vehicle, and her speed at thrust 1, m/s.
    propellers: the address on which her propellers are commanded.
    speed:  how many times faster than life.
    keeps:  the truth at every fix, for `table`.
    """

    def __init__(
        self,
        boat: SimulatedBoat,
        speakers: Sequence[Speaker] = (),
        mavlink: Uri | None = None,
        propellers: Uri | None = None,
        speed: float = 1.0,
        cruise: float | None = None,
        keeps: bool = False,
    ):
        self.boat, self.speakers = boat, tuple(speakers)
        self.speed = positive("speed", speed)
        self.unix = time.time()
        self.link = self.rover = None
        if mavlink is not None:
            self.link = MavlinkLink(mavlink, self._heard)
            self.rover = Rover(self.link.messages, cruise or boat.known.top_speed, self.unix)
        self.propellers = None if propellers is None else Propellers(propellers, boat.vessel.actuators)
        self._loops = InnerLoops(boat.known)
        self._skipper = Skipper(boat.motion)
        self._asked: Target | None = None
        self._kept: list[tuple] | None = [] if keeps else None

    async def run(self) -> None:
        """Sail until cancelled."""
        self.boat.step(self._command(0.0))  # compiles, before the time begins to run; a fix of it is not told
        self.unix = time.time() - self.boat.time
        if self.rover is not None:
            self.rover.unix = self.unix
        async with asyncio.TaskGroup() as tasks:
            for each in (*self.speakers, self.link, self.propellers):
                if each is not None:
                    tasks.create_task(each.run())
            tasks.create_task(self._sail())

    def table(self):
        """The truth at every fix, a polars DataFrame of COLUMNS."""
        import polars as pl

        return pl.DataFrame(self._kept, schema=dict.fromkeys(COLUMNS, pl.Float64), orient="row")

    def write(self, directory: str | Path) -> Path:
        """The table as run.parquet in a directory."""
        path = Path(directory) / "run.parquet"
        self.table().write_parquet(path)
        return path

    async def _sail(self):
        pace = self.boat.step_length / self.speed
        due = time.monotonic()
        while True:
            await asyncio.sleep(max(due - time.monotonic(), 0.0))
            if time.monotonic() - due > _BEHIND:
                LOG.warning("the boat is %g s behind: this computer is too slow or was busy", _BEHIND)
                due = time.monotonic()
            self._step()
            due += pace

    def _step(self):
        now = self.boat.time
        seen = self.boat.step(self._command(now))
        if seen is not None:
            self._tell(seen)
        if self.rover is not None:
            self.rover.heading = self.boat.heading
            self.link.send(self.rover.due(self.boat.time, self.boat.motion, self.boat.position()))

    def _command(self, now):
        if self.propellers is not None and self.propellers.obeyed:
            self._asked = None
            return self.propellers.command() or self._loops.rest()
        self._asked = asked = self._skipper.step(self.boat.motion) if self._is_by_hand() else self.rover.target(now)
        if asked is None:
            return self._loops.rest()
        return self._loops.step(asked.yaw_rate, asked.speed, self.boat.motion, self.boat.step_length)

    def _is_by_hand(self):
        return self.rover is None or (self.rover.armed and self.rover.mode is RoverMode.MANUAL)

    def _tell(self, seen):
        when, place = self.unix + seen.epoch, (seen.latitude, seen.longitude)
        said = rmc(when, *place, seen.sog, seen.cog, talker=_TALKER) + gga(when, *place, talker=_TALKER)
        if math.isfinite(self.boat.heading):
            said += hdt(self.boat.heading, talker=_TALKER)
        for speaker in self.speakers:
            speaker.send(said.encode())
        if self.rover is not None:
            self.rover.see(seen)
        if self._kept is not None:
            self._keep(seen)

    def _keep(self, seen):
        truth = self.boat.motion
        degrees = np.degrees((*self.boat.position(), truth.heading % math.tau)).tolist()
        mode = None if self.rover is None else float(self.rover.mode)
        cog, yaw_rate = math.degrees(truth.cog % math.tau), math.degrees(truth.yaw_rate)
        asked = (None, None) if self._asked is None else (self._asked.speed, math.degrees(self._asked.yaw_rate))
        moment = self.unix + self.boat.time
        self._kept.append((moment, truth.north, truth.east, *degrees, truth.sog, cog, yaw_rate, *asked, mode))

    def _heard(self, message):
        self.link.send(self.rover.hear(message, self.boat.time))
        return True
