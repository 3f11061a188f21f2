"""Targets of fuzzing: every reader of foreign data, with sound inputs to mutate."""

import asyncio
import gzip
import json
import os
import tempfile
from collections.abc import Callable
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple
from unittest.mock import AsyncMock, patch

import numpy as np

from steerway.estimation import Profile
from steerway.estimation.testing import BUILT_IN
from steerway.formats import testing as formats
from steerway.live import testing as live
from steerway.simulation import Unfinished, load_scenario
from tests.fuzz import seeds
from tests.fuzz.aboard import said_aboard
from tests.messages import WHOLE
from tests.test_live_route import MISSION, ROUTES

_MEMORY = Path("/dev/shm" if os.path.isdir("/dev/shm") else tempfile.gettempdir())
_CONNECTED = 20  # inputs that a link reads before it is opened again


class Target(NamedTuple):
    """A target. `read(data)` returns the outcome as a text, equal for inputs of one kind; any exception is a crash.

    Wrong data may raise InputError with a message of one line.
    """

    seeds: Callable[[], list[bytes]]
    read: Callable[[bytes], str]


def check(recording) -> None:
    """Assert what every reader promises about its record."""
    assert all(count > 0 for count in recording.skipped.values())
    for fixes in recording.sources.values():
        assert len(fixes) > 0 and np.isfinite(fixes.time).all()
        with np.errstate(invalid="ignore"):
            assert not (np.abs(fixes.latitude) > np.pi / 2).any()
            assert not ((fixes.longitude < -np.pi) | (fixes.longitude >= np.pi)).any()


def _format(name):
    def read(data):
        module = getattr(formats, name)
        assert module.recognises(data[:65536]) in (True, False)
        recording = module.read(data)
        check(recording)
        return f"{sorted(recording.counts)[:5]} {sorted(recording.skipped)}"

    return read


def _any_log(data):
    logs = formats.survey(data, max_size=1e7)
    for log in logs:
        check(log.recording)
    return str(sorted(log.recording.format for log in logs))


def _file(ending, load):
    """A target that reads a file."""

    def read(data):
        path = _MEMORY / f"fuzzed-{os.getpid()}{ending}"
        path.write_bytes(data)
        try:
            load(path)
        finally:
            path.unlink()
        return "read"

    return read


def _ais_table(path):
    with formats.ais_tables.reports(path, path.parent) as frame:
        if frame is not None:
            frame.collect()


def _unfinished(path):
    assert isinstance(Unfinished(path, {"work": "fuzzed"}, resume=True).results, dict)


def _link(opened):
    """A link whose rows go to a boat under autopilot. `opened()` returns a function from data to (rows, state)."""
    heard, link = count(), []

    def read(data):
        if next(heard) % _CONNECTED == 0:
            link[:] = [opened()]
        rows, state = link[0](data)
        return f"{said_aboard(rows)} {state}"

    return read


def _decoder(name):
    def opened():
        decoder = getattr(live, name)()

        def read(data):
            before, pieces = dict(decoder.skipped), (data[: len(data) // 2], data[len(data) // 2 :] + b"\n")
            rows = [row for piece in pieces for row in decoder.feed(piece)] + decoder.complete_on_silence()
            return rows, [reason for reason, count in decoder.skipped.items() if count != before.get(reason)]

        return read

    return opened


def _gateway():
    """Lines of an NMEA 2000 gateway on TCP."""
    decoder, seconds = live.N2kDecoder(), count()

    def read(data):
        found = filter(None, map(formats.frame_of_line, data.split(b"\n")))
        return [row for frame in found for row in decoder.frame(frame, 1.7e9 + next(seconds))], ""

    return read


def _vehicle():
    """MAVLink packets of a vehicle to the companion computer."""
    companion, rows = live.Companion(live.addresses.sources(["mavlink:udpin:127.0.0.1:1"])[0][0]), []
    companion._deliver = lambda given, arrived: rows.extend(given)

    def read(data):
        rows.clear()
        for part in (data[: len(data) // 2], data[len(data) // 2 :]):
            companion.link._feed(part)
        return list(rows), companion.link.broken > 0

    return read


TOKEN = "correct-horse-battery"


def _helm(data):
    """A request to the helm page, which nobody can reach without a login."""
    head, _, body = data.partition(b"\n\n")
    first, *lines = head.split(b"\n")
    method, path, scheme = [*first.decode("latin-1").split(" "), "", "", ""][:3]
    headers = [tuple(part.strip() for part in line.lower().split(b":", 1)) for line in lines if b":" in line]
    answers = []

    async def inside(scope, receive, send):
        cookies = dict(headers).get(b"cookie", b"").decode("latin-1").split(";")
        assert any(sessions.knows(each.partition("=")[2].strip()) for each in cookies), "reached without login"
        answers.append("inside")

    async def receive():
        return {"type": "http.request", "body": body, "more_body": False}

    async def send(message):
        answers.append(str(message.get("status", message["type"])))

    kind = "websocket" if scheme in ("ws", "wss") else "http"
    scope = {"type": kind, "method": method.upper(), "path": path, "scheme": scheme if scheme in SCHEMES else "http"}
    scope |= {"headers": headers, "query_string": b"", "root_path": "", "client": ("10.0.0.7", 5)}
    sessions = live.Sessions(TOKEN)
    with patch("asyncio.sleep", new=AsyncMock()):  # the pause after a wrong token
        asyncio.run(live.Gate(inside, live.Address("0.0.0.0", 8080, TOKEN))(scope, receive, send))
    assert answers, "no answer"
    return answers[0]


SCHEMES = ("http", "https", "ws", "wss")


def controls():
    """Controls of an autopilot, with a route of two points."""
    route = live.GeodeticRoute(np.radians([54.0, 54.001]), np.radians([10.0, 10.0]))
    return live.Controls(live.Supervisor(route, Profile.named("small-usv"), engage=True))


def _helm_lines(data):
    """Lines from the page's process to the service."""

    async def lines():
        for line in filter(None, data.split(b"\n")):
            yield line

    requested = controls()
    page = live.HelmPage(SimpleNamespace(controls=requested), live.Address("127.0.0.1", 8080, ""))
    try:
        asyncio.run(page._read(lines()))
    except OSError:
        return "failed"
    return requested.state()["state"]


def _packed():
    return [gzip.compress(each[:4000]) for each in seeds.recorded()] + seeds.recorded()


TARGETS = {
    "NMEA 0183": Target(seeds.nmea, _format("nmea0183")),
    "UBX": Target(seeds.ubx, _format("ubx")),
    "NMEA 2000": Target(seeds.canboat, _format("nmea2000")),
    "AIS": Target(seeds.ais, _format("ais")),
    "GPX": Target(lambda: [WHOLE], _format("gpx")),
    "CSV": Target(seeds.csv, _format("table")),
    "Parquet": Target(seeds.parquet, _format("table")),
    "MCAP": Target(seeds.mcap, _format("mcap")),
    "ROS 2 bag": Target(seeds.bags, _format("ros2")),
    "AIS table": Target(seeds.ais_tables, _file(".csv", _ais_table)),
    "unfinished work": Target(seeds.unfinished, _file("", _unfinished)),
    "any log, packed": Target(_packed, _any_log),
    "scenario": Target(lambda: seeds.examples("*.toml"), _file(".toml", load_scenario)),
    "profile": Target(lambda: [each.toml().encode() for each in BUILT_IN.values()], _file(".toml", Profile.load)),
    "settings": Target(lambda: seeds.examples("live/*.toml"), _file(".toml", live.Settings.load)),
    "mission TOML": Target(
        lambda: [MISSION.encode(), *seeds.examples("live/*.toml")], _file(".toml", live.GeodeticRoute.load)
    ),
    "mission GPX": Target(lambda: [ROUTES["r.gpx"].encode()], _file(".gpx", live.GeodeticRoute.load)),
    "mission GeoJSON": Target(lambda: [ROUTES["r.geojson"].encode()], _file(".geojson", live.GeodeticRoute.load)),
    "receiver link": Target(seeds.mixed, _link(_decoder("ReceiverDecoder"))),
    "Signal K": Target(seeds.signalk, _link(_decoder("SignalKDecoder"))),
    "gpsd": Target(seeds.gpsd, _link(_decoder("GpsdDecoder"))),
    "NMEA 2000 wire": Target(seeds.gateway, _link(_gateway)),
    "MAVLink": Target(seeds.mavlink, _link(_vehicle)),
    "helm request": Target(seeds.requests, _helm),
    "helm lines": Target(lambda: [json.dumps(each).encode() for each in seeds.HELM_LINES], _helm_lines),
}
