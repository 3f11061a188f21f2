"""The simulated boat in real time: its steps, its receiver's sentences, its MAVLink and its propellers."""

import asyncio
import contextlib
import json
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from steerway.core.checks import positive
from steerway.core.errors import InputError
from steerway.core.files import complete_or_absent, made_directory
from steerway.formats.nmea0183.writing import gga, hdt, rmc
from steerway.live import addresses
from steerway.live.links.link import Sink, kept_open
from steerway.live.links.transport import Transport
from steerway.live.mavlink.link import MavlinkLink, RoverMode
from steerway.live.process import log_to_stderr, until_stopped
from steerway.live.simulated.boat import InnerLoops, ReceiverFix, SimulatedBoat
from steerway.live.simulated.rover import TURN_LIMIT, Rover, Skipper, Target
from steerway.live.uri import LOG, Uri
from steerway.simulation.scenario import Scenario
from steerway.vessels.vessel import Actuator

SILENCE = 1.0
"""Time without a command after which a motor driver stops its propellers, s."""


class PropellerReceiver:
    """Receives the autopilot's commands as JSON datagrams with `port` and `starboard`, and keeps the newest command.

    Raises InputError for a vessel without two propellers.
    """

    def __init__(self, uri: Uri, actuators: Sequence[Actuator]):
        if len(actuators) != 2:
            raise InputError(f"{uri.text}: commands two propellers, expected a vessel of kind otter")
        self.uri, self._actuators = uri, actuators
        self._newest = (0.0, 0.0)
        self._received = -math.inf

    async def run(self) -> None:
        """Receive until cancelled."""
        link = Transport(self.uri, "udp", lambda data, _: self.receive(data))
        await kept_open(self.uri.text, link.open)

    @property
    def obeyed(self) -> bool:
        """Whether any command has arrived."""
        return self._received > -math.inf

    def command(self) -> tuple[float, ...] | None:
        """Propeller speeds, rad/s; None without a recent command."""
        if time.monotonic() - self._received > SILENCE:
            return None
        return tuple(
            part * (each.high if part > 0.0 else -each.low)
            for part, each in zip(self._newest, self._actuators, strict=True)
        )

    def receive(self, line: bytes) -> None:
        """Take a datagram; anything but a command is ignored."""
        try:
            command = json.loads(line)
            newest = float(command["port"]), float(command["starboard"])
        except (ValueError, TypeError, KeyError, RecursionError):
            return
        if all(map(math.isfinite, newest)):
            self._newest, self._received = newest, time.monotonic()


if TYPE_CHECKING:
    import polars as pl

_BEHIND = 1.0  # largest delay of steps before they are skipped, s
_TALKER = "GP"


class RunningBoat:
    """A boat under way. From the first propeller command on, they steer it; before, GUIDED, or a skipper in MANUAL.

    sinks:  links on which the receiver sends GGA and RMC, and with a compass HDT.
    mavlink, cruise: the address of the boat as a MAVLink vehicle; its speed at thrust 1, m/s.
    propellers: the address that receives propeller commands.
    speed:  how many times faster than real time.
    keeps:  whether the true state at every fix is recorded for `table`.
    """

    def __init__(
        self,
        boat: SimulatedBoat,
        sinks: Sequence[Sink] = (),
        mavlink: Uri | None = None,
        propellers: Uri | None = None,
        speed: float = 1.0,
        cruise: float | None = None,
        keeps: bool = False,
    ):
        self.boat, self.sinks = boat, tuple(sinks)
        self.speed = positive("speed", speed)
        self.unix = time.time()
        self.link = self.rover = None
        if mavlink is not None:
            self.link = MavlinkLink(mavlink, self._receive)
            self.rover = Rover(
                self.link.messages,
                cruise or boat.known.top_speed,
                self.unix,
                ekf_time=mavlink.number("ekf", 0.0),
                compass=mavlink.number("compass", 1.0) > 0.0,
                turn_limit=math.radians(mavlink.number("turn", math.degrees(TURN_LIMIT))),
            )
        self.propellers = None if propellers is None else PropellerReceiver(propellers, boat.vessel.actuators)
        self._loops = InnerLoops(boat.known)
        self._skipper = Skipper(boat.motion)
        self._target: Target | None = None
        self._kept: list[dict[str, float | None]] | None = [] if keeps else None

    async def run(self) -> None:
        """Run until cancelled."""
        self.boat.step(self._command(0.0))  # compiles before real time begins; its fix is not sent
        self.unix = time.time() - self.boat.time
        if self.rover is not None:
            self.rover.unix = self.unix
        async with asyncio.TaskGroup() as tasks:
            for each in (*self.sinks, self.link, self.propellers):
                if each is not None:
                    tasks.create_task(each.run())
            tasks.create_task(self._sail())

    def table(self) -> "pl.DataFrame":
        """The true state at every fix, as a polars DataFrame.

        `mode` is null without MAVLink; the targets are null with engines off.
        """
        import polars as pl

        rows = pl.DataFrame(self._kept or [self._truth()], infer_schema_length=None)
        return rows.head(len(self._kept or ())).cast(pl.Float64)

    def write(self, directory: str | Path) -> Path:
        """Write the table as run.parquet to a directory; return its path."""
        path = Path(directory) / "run.parquet"
        with complete_or_absent(path) as file:
            self.table().write_parquet(file)
        return path

    async def _sail(self) -> None:
        pace = self.boat.step_length / self.speed
        due = time.monotonic()
        while True:
            await asyncio.sleep(max(due - time.monotonic(), 0.0))
            if time.monotonic() - due > _BEHIND:
                LOG.warning("the simulation is %g s behind: this computer is too slow or was busy", _BEHIND)
                due = time.monotonic()
            self._step()
            due += pace

    def _step(self) -> None:
        now = self.boat.time
        seen = self.boat.step(self._command(now))
        if seen is not None:
            self._send(seen)
        if self.rover is not None and self.link is not None:
            self.rover.heading = self.boat.heading
            is_driven = self.propellers is not None and self.propellers.obeyed  # propeller commands bypass the vehicle
            self.rover.throttle = 1.0 if is_driven else self._loops.throttle
            self.link.send(self.rover.due(self.boat.time, self.boat.motion, self.boat.position()))

    def _command(self, now: float) -> tuple[float, ...]:
        if self.propellers is not None and self.propellers.obeyed:
            self._target = None
            return self.propellers.command() or self._loops.rest()
        rover = self.rover
        if rover is None or (rover.armed and rover.mode is RoverMode.MANUAL):
            target: Target | None = self._skipper.step(self.boat.motion)
        else:
            target = rover.target(now)
        self._target = target
        if target is None:
            return self._loops.rest()
        return self._loops.step(target.yaw_rate, target.speed, self.boat.motion, self.boat.step_length)

    def _send(self, seen: ReceiverFix) -> None:
        when, place = self.unix + seen.epoch, (seen.latitude, seen.longitude)
        text = rmc(when, *place, seen.sog, seen.cog, talker=_TALKER) + gga(when, *place, talker=_TALKER)
        if math.isfinite(self.boat.heading):
            text += hdt(self.boat.heading, talker=_TALKER)
        for sink in self.sinks:
            sink.send(text.encode())
        if self.rover is not None:
            self.rover.see(seen)
        if self._kept is not None:
            self._kept.append(self._truth())

    def _truth(self) -> dict[str, float | None]:
        truth, target, (latitude, longitude) = self.boat.motion, self._target, self.boat.position()
        return {
            "time_s": self.unix + self.boat.time,
            "true_north_m": truth.north,
            "true_east_m": truth.east,
            "true_lat_deg": math.degrees(latitude),
            "true_lon_deg": math.degrees(longitude),
            "true_heading_deg": math.degrees(truth.heading % math.tau),
            "true_sog_mps": truth.sog,
            "true_cog_deg": math.degrees(truth.cog % math.tau),
            "true_yaw_rate_dps": math.degrees(truth.yaw_rate),
            "asked_speed_mps": None if target is None else target.speed,
            "asked_yaw_rate_dps": None if target is None else math.degrees(target.yaw_rate),
            "mode": None if self.rover is None else float(self.rover.mode),
        }

    def _receive(self, message: Any) -> bool:
        if self.link is not None and self.rover is not None:
            self.link.send(self.rover.receive(message, self.boat.time))
        return True


def sail_live(
    scenario: Scenario,
    to: Sequence[str] = (),
    mavlink: str | None = None,
    propellers: str | None = None,
    speed: float = 1.0,
    out: str | Path | None = None,
) -> None:
    """Run until SIGINT or SIGTERM. Raises InputError for invalid addresses, and without any output."""
    if not to and mavlink is None:
        raise InputError("--live has no output, expected --to ADDRESS or --mavlink ADDRESS")
    if out is not None:
        made_directory(out)
    log_to_stderr("steerway simulate")
    sinks = [addresses.stream(each) for each in to]
    vehicle = None if mavlink is None else addresses.vehicle(mavlink)
    driven = None if propellers is None else addresses.datagrams(propellers)
    cruise = None if vehicle is None or "cruise" not in vehicle.options else vehicle.number("cruise", 0.0)
    running = RunningBoat(SimulatedBoat(scenario), sinks, vehicle, driven, speed, cruise, keeps=out is not None)
    commanded = " and ".join(each for each in (mavlink, propellers) if each)
    until = f" until commanded on {commanded}" if commanded else ""
    print(
        f"{scenario.name}: under way until stopped, by hand in a circle{until}; "
        "the scenario's pilot, route and duration are not used",
        file=sys.stderr,
    )
    try:
        until_stopped(running.run())
    finally:
        for sink in sinks:
            with contextlib.suppress(OSError):
                sink.close()
        if out is not None:
            print(f"wrote {running.write(out)}", file=sys.stderr)
