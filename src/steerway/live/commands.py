"""The command `live`: addresses in, addresses out, and how it ends."""

import asyncio
import contextlib
import logging
import math
import os
import signal
import sys
import time
from typing import Annotated

import typer

from steerway.errors import InputError
from steerway.live.service import RATE


def live(
    listen_to: Annotated[list[str], typer.Option("--from", metavar="ADDRESS", help="Where fixes come from.")],
    say_to: Annotated[
        list[str] | None, typer.Option("--to", metavar="ADDRESS", help="Where to say the estimate; stdout: by default.")
    ] = None,
    profile: Annotated[
        str, typer.Option("--profile", metavar="NAME|FILE.toml", help="Tuning of the filter.")
    ] = "small-usv",
    source: Annotated[
        list[str] | None, typer.Option("--source", metavar="NAME", help="Sources of positions in order of priority.")
    ] = None,
    aid: Annotated[
        str | None,
        typer.Option("--aid", metavar="LIST", help="Use also, of: sog, cog, heading, water-speed, yaw-rate."),
    ] = None,
    rate: Annotated[
        float | None, typer.Option("--rate", metavar="HZ", help="Rows a second; by default a row a fix.")
    ] = None,
    mission: Annotated[
        str | None,
        typer.Option(
            "--mission", metavar="FILE", help="A route (.toml .gpx .geojson): say also how to steer along it."
        ),
    ] = None,
    patience: Annotated[
        float, typer.Option("--patience", metavar="S", help="How long to go by dead reckoning without a fix.")
    ] = 10.0,
    engage: Annotated[
        bool, typer.Option("--engage", help="Let the autopilot start by itself, once it is ready.")
    ] = False,
    latency: Annotated[
        float, typer.Option("--latency", metavar="S", help="How late the receiver tells its fixes at the least.")
    ] = 0.0,
) -> None:
    """Estimate on the boat, in real time, between instruments and those who listen.

    From: serial:/dev/ttyACM0?baud=38400, tcp://host:port, udp://:port, gpsd://host:2947, signalk://host:3000,
    file:LOG?speed=10 (or speed=max).
    To: stdout: (JSON lines), tcp-server://127.0.0.1:10110, tcp://host:port, udp://host:port, serial:…,
    signalk://host:3000, file:RUN.parquet.

    Examples:

        steerway live --from serial:/dev/ttyACM0?baud=38400 --to tcp-server://127.0.0.1:10110

        steerway live --from file:sortie.nmea?speed=max > rows.jsonl
    """
    from steerway.estimation.profiles import Profile
    from steerway.live import addresses
    from steerway.live.autopilot import Autopilot
    from steerway.live.mission import GeodeticRoute
    from steerway.live.navigator import Navigator
    from steerway.live.route import Guide
    from steerway.live.service import Service

    _log_to_stderr()
    if engage and mission is None:
        raise InputError("--engage has nothing to follow, expected --mission with a route")
    found, speed = addresses.sources(listen_to)
    replayed = not math.isnan(speed)
    tuning = Profile.load(profile) if profile.endswith(".toml") else Profile.named(profile)
    aids = tuple(name.strip().replace("-", "_") for name in aid.split(",") if name.strip()) if aid else ()
    navigator = Navigator(tuning, aids, tuple(source or ()), patience, rate=rate)
    pairs = [addresses.output(text, rate, patient=replayed) for text in say_to or ["stdout:"]]
    speakers = [speaker for _, speaker in pairs if speaker is not None]
    route = None if mission is None else GeodeticRoute.load(mission)
    guide = None if route is None else Guide(route)
    autopilot = None if route is None else Autopilot(route, tuning, patience, engage)
    service = Service(navigator, [each for each, _ in pairs], rate or RATE, latency, guide, autopilot)
    if replayed:
        rows = _rows_of_logs([each.path for each in found])
        _until_stopped(service.replay(rows, speed, speakers))
        wanted = ", ".join(source or ())
        if not navigator.counts["taken"] and wanted:
            raise InputError(f"source {wanted!r} has no position in {', '.join(each.path for each in found)}")
    else:
        ears = [addresses.listener(each, len(found)) for each in found]
        _until_stopped(service.listen(ears, speakers))


def warm() -> None:
    """Compile what a live run needs, once after installing, so that the boat starts at once.

    Example:

        steerway warm
    """
    from steerway.compiled import CACHE_DIRECTORY
    from steerway.live import warming

    begun = time.monotonic()
    warming.warm()
    where = f"kept in {CACHE_DIRECTORY}" if CACHE_DIRECTORY else "not kept: no directory for it can be written"
    print(f"compiled in {time.monotonic() - begun:.1f} s, {where}")


def _rows_of_logs(paths):
    """The rows of all logs in time order. Raises InputError as `read` does."""
    from steerway.formats.reading import survey
    from steerway.formats.sources import gather
    from steerway.live.heard import rows_of

    logs = survey(*paths)
    return list(rows_of(gather([(log.name, log.recording.sources) for log in logs])))


def _until_stopped(work) -> None:
    """Run to the end, or until SIGINT or SIGTERM, or until nobody reads standard output any more."""

    async def run():
        task = asyncio.ensure_future(work)
        loop = asyncio.get_running_loop()
        for each in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(each, task.cancel)
        with contextlib.suppress(asyncio.CancelledError):
            await task

    try:
        asyncio.run(run())
    except* BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _log_to_stderr():
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("steerway live: %(message)s"))
    log = logging.getLogger("steerway.live")
    log.handlers[:] = [handler]
    log.setLevel(logging.INFO)
    log.propagate = False
