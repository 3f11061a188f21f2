"""Targets of fuzzing: every reader of foreign data, with sound inputs to mutate."""

import asyncio
import gzip
import json
import os
import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple
from unittest.mock import AsyncMock, patch

import numpy as np

from steerway.core import InputError
from tests.fuzz import seeds
from tests.fuzz.aboard import said_aboard

REFUSED = "refused"


class Target(NamedTuple):
    """A target. `read(data)` returns the outcome as a text, equal for inputs of one kind; any exception is a crash."""

    seeds: Callable[[], list[bytes]]
    read: Callable[[bytes], str]


def swallow(module, data: bytes):
    """Read data by one format; wrong data may only raise InputError with a message of one line."""
    assert module.recognises(data[:65536]) in (True, False)
    try:
        recording = module.read(data)
    except InputError as error:
        assert "\n" not in str(error)
        return None
    for fixes in recording.sources.values():
        check(fixes)
    assert all(count > 0 for count in recording.skipped.values())
    return recording


def check(fixes) -> None:
    """Assert what every reader promises about its record."""
    assert np.isfinite(fixes.time).all()
    assert len(fixes) > 0
    with np.errstate(invalid="ignore"):
        assert not (np.abs(fixes.latitude) > np.pi / 2).any()
        assert not ((fixes.longitude < -np.pi) | (fixes.longitude >= np.pi)).any()


def _format(name):
    def read(data):
        module = getattr(import_module("steerway.formats.testing"), name)
        recording = swallow(module, data)
        return REFUSED if recording is None else f"{sorted(recording.counts)[:5]} {sorted(recording.skipped)}"

    return read


def _any_log(data):
    from steerway.formats.testing import survey

    try:
        logs = survey(data, max_size=1e7)
    except InputError as error:
        assert "\n" not in str(error)
        return REFUSED
    for log in logs:
        for fixes in log.recording.sources.values():
            check(fixes)
    return str(sorted(log.recording.format for log in logs))


def _file(ending, load):
    """A target that reads a file."""

    def read(data):
        handle, path = tempfile.mkstemp(ending, dir=_MEMORY)
        try:
            os.write(handle, data)
            load(path)
        except InputError as error:
            assert "\n" not in str(error)
            return f"{REFUSED} {str(error).replace(path, '')[:60]}"
        finally:
            os.close(handle)
            os.unlink(path)
        return "read"

    return read


_MEMORY = "/dev/shm" if os.path.isdir("/dev/shm") else None


def _loaded(package, name):
    """A target that calls the `load` of a class, which is imported at its first use."""

    def load(path):
        getattr(import_module(f"steerway.{package}"), name).load(path)

    return load


def _scenario(path):
    from steerway.simulation import load_scenario

    load_scenario(path)


def _ais_table(path):
    from steerway.formats.testing import ais_tables

    with ais_tables.reports(Path(path), Path(path).parent) as frame:
        if frame is not None:
            frame.collect()


def _unfinished(path):
    from steerway.simulation import Unfinished

    results = Unfinished(Path(path), {"work": "fuzzed"}, resume=True).results
    assert isinstance(results, dict)


def _link(name):
    """A decoder of a live link, fed in two pieces; a boat under autopilot receives its rows."""

    def read(data):
        decoder = getattr(import_module("steerway.live.testing"), name)()
        rows = [
            *decoder.feed(data[: len(data) // 2]),
            *decoder.feed(data[len(data) // 2 :] + b"\n"),
            *decoder.complete_on_silence(),
        ]
        return f"{said_aboard(rows)} {sorted(decoder.skipped)}"

    return read


def _n2k(data):
    """Lines of an NMEA 2000 gateway on TCP."""
    from steerway.formats.testing import frame_of_line
    from steerway.live.testing import N2kDecoder

    decoder, rows = N2kDecoder(), []
    for k, line in enumerate(data.split(b"\n")):
        frame = frame_of_line(line)
        if frame is not None:
            rows += decoder.frame(frame, 1.7e9 + k)
    return said_aboard(rows)


def _mavlink(data):
    """MAVLink packets of a vehicle to the companion computer: none of them may raise an exception."""
    from steerway.live.testing import Companion, addresses

    companion = Companion(addresses.sources(["mavlink:udpin:127.0.0.1:1"])[0][0])
    rows = []
    companion._deliver = lambda given, arrived: rows.extend(given)
    for part in (data[: len(data) // 2], data[len(data) // 2 :]):
        companion.link._feed(part)
    return f"{said_aboard(rows)} {companion.link.broken > 0}"


TOKEN = "correct-horse-battery"


def _helm(data):
    """A request to the helm page, which nobody can reach without a login."""
    from steerway.live.testing import Address, access

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
    sessions = access.Sessions(TOKEN)
    with patch("asyncio.sleep", new=AsyncMock()):  # the pause after a wrong token
        asyncio.run(access.Gate(inside, Address("0.0.0.0", 8080, TOKEN))(scope, receive, send))
    assert answers, "no answer"
    return answers[0]


SCHEMES = ("http", "https", "ws", "wss")


def controls():
    """Controls of an autopilot, with a route of two points."""
    from steerway.estimation import Profile
    from steerway.live.testing import Controls, GeodeticRoute, Supervisor

    route = GeodeticRoute(np.radians([54.0, 54.001]), np.radians([10.0, 10.0]))
    supervisor = Supervisor(route, Profile.named("small-usv"), engage=True)
    return Controls(supervisor)


def read_from_page(data, requested) -> None:
    """Lines from the page's process to the service."""
    from steerway.live.testing import Address, HelmPage

    async def lines():
        for line in data.split(b"\n"):
            if line:
                yield line

    page = HelmPage(SimpleNamespace(controls=requested), Address("127.0.0.1", 8080, ""))
    asyncio.run(page._read(lines()))


def _helm_lines(data):
    requested = controls()
    try:
        read_from_page(data, requested)
    except OSError:
        return "failed"
    return requested.state()["state"]


def _packed(given):
    return lambda: [gzip.compress(each[:4000]) for each in given()] + given()


_mission = _loaded("live.testing", "GeodeticRoute")
TARGETS = {
    "NMEA 0183": Target(seeds.nmea, _format("nmea0183")),
    "UBX": Target(seeds.ubx, _format("ubx")),
    "NMEA 2000": Target(seeds.canboat, _format("nmea2000")),
    "AIS": Target(seeds.ais, _format("ais")),
    "GPX": Target(seeds.gpx, _format("gpx")),
    "CSV": Target(seeds.csv, _format("table")),
    "Parquet": Target(seeds.parquet, _format("table")),
    "MCAP": Target(seeds.mcap, _format("mcap")),
    "ROS 2 bag": Target(seeds.bags, _format("ros2")),
    "AIS table": Target(seeds.ais_tables, _file(".csv", _ais_table)),
    "unfinished work": Target(seeds.unfinished, _file("", _unfinished)),
    "NMEA 2000 wire": Target(seeds.gateway, _n2k),
    "any log, packed": Target(_packed(seeds.recorded), _any_log),
    "scenario": Target(lambda: seeds.examples("*.toml"), _file(".toml", _scenario)),
    "profile": Target(seeds.profiles, _file(".toml", _loaded("estimation", "Profile"))),
    "settings": Target(seeds.settings, _file(".toml", _loaded("live.testing", "Settings"))),
    "mission TOML": Target(seeds.missions_toml, _file(".toml", _mission)),
    "mission GPX": Target(seeds.missions_gpx, _file(".gpx", _mission)),
    "mission GeoJSON": Target(seeds.missions_geojson, _file(".geojson", _mission)),
    "receiver link": Target(seeds.mixed, _link("ReceiverDecoder")),
    "Signal K": Target(seeds.signalk, _link("SignalKDecoder")),
    "gpsd": Target(seeds.gpsd, _link("GpsdDecoder")),
    "MAVLink": Target(seeds.mavlink, _mavlink),
    "helm request": Target(seeds.requests, _helm),
    "helm lines": Target(lambda: [json.dumps(each).encode() for each in seeds.HELM_LINES], _helm_lines),
}
