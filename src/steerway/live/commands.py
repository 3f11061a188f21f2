"""The command `live`: addresses in, addresses out, and how it ends."""

import math
import time
from typing import Annotated

import typer

from steerway.errors import InputError
from steerway.live.process import log_to_stderr, until_stopped
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
    helm: Annotated[
        str | None,
        typer.Option(
            "--helm", metavar="[HOST:PORT]", help="Serve the helm page; 127.0.0.1:8080 where nothing follows."
        ),
    ] = None,
    helm_token_file: Annotated[
        str | None,
        typer.Option(
            "--helm-token-file", metavar="FILE", help="Its token, which other computers need; or STEERWAY_HELM_TOKEN."
        ),
    ] = None,
) -> None:
    """Estimate on the boat, in real time, between instruments and those who listen.

    From: serial:/dev/ttyACM0?baud=38400, tcp://host:port, udp://:port, gpsd://host:2947, signalk://host:3000,
    mavlink:udpin:host:port (udpout, tcp, or mavlink:/dev/…), file:LOG?speed=10 (or speed=max).
    To: stdout: (JSON lines), tcp-server://127.0.0.1:10110, tcp://host:port, udp://host:port, serial:…,
    signalk://host:3000, mavlink:udpin:host:port (steers in GUIDED), file:RUN.parquet.

    Examples:

        steerway live --from serial:/dev/ttyACM0?baud=38400 --to tcp-server://127.0.0.1:10110

        steerway live --from file:sortie.nmea?speed=max > rows.jsonl
    """
    from steerway.estimation.profiles import Profile
    from steerway.live import addresses
    from steerway.live.autopilot import Autopilot
    from steerway.live.helm.address import address, token_of
    from steerway.live.helm.bridge import Helm
    from steerway.live.mission import GeodeticRoute
    from steerway.live.navigator import Navigator
    from steerway.live.route import Guide
    from steerway.live.service import Service

    log_to_stderr("steerway live")
    if engage and mission is None:
        raise InputError("--engage has nothing to follow, expected --mission with a route")
    found, speed = addresses.sources(listen_to)
    page = None if helm is None else address(helm, token_of(helm_token_file))
    replayed = not math.isnan(speed)
    tuning = Profile.load(profile) if profile.endswith(".toml") else Profile.named(profile)
    aids = tuple(name.strip().replace("-", "_") for name in aid.split(",") if name.strip()) if aid else ()
    navigator = Navigator(tuning, aids, tuple(source or ()), patience, rate=rate)
    ears = [] if replayed else [addresses.listener(each, len(found)) for each in found]
    pairs = [addresses.output(text, rate, patient=replayed, listening=ears) for text in say_to or ["stdout:"]]
    speakers = [speaker for _, speaker in pairs if speaker is not None]
    route = None if mission is None else GeodeticRoute.load(mission)
    guide = None if route is None else Guide(route)
    autopilot = None if route is None else Autopilot(route, tuning, patience, engage)
    service = Service(navigator, [each for each, _ in pairs], rate or RATE, latency, guide, autopilot)
    if page is not None:
        speakers.append(Helm(service, page, route))
    if replayed:
        rows = _rows_of_logs([each.path for each in found])
        until_stopped(service.replay(rows, speed, speakers))
        wanted = ", ".join(source or ())
        if not navigator.counts["taken"] and wanted:
            raise InputError(f"source {wanted!r} has no position in {', '.join(each.path for each in found)}")
    else:
        until_stopped(service.listen(ears, speakers))


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
