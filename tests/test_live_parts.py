"""Real gpsd, a real Signal K server and a real serial line on this machine; skipped if not installed."""

import asyncio
import contextlib
import json
import math
import os
import shutil
import urllib.error
import urllib.request
from pathlib import Path
from types import SimpleNamespace

import pytest

from steerway.core import InputError
from steerway.core.testing import iso
from steerway.estimation import estimate
from steerway.formats.testing import nmea0183
from steerway.live.testing import Address, ControlPort, addresses, connected
from tests.command_line import run_process
from tests.kept_outputs import serving
from tests.ports import free_port, running, under_way, until
from tests.sentences import START, gga, rmc, sortie

LOOPBACK = """
const { Server } = require('net')
const listen = Server.prototype.listen
Server.prototype.listen = function (port, ...rest) {
  return typeof port === 'object' ? listen.call(this, port, ...rest) : listen.call(this, port, '127.0.0.1', ...rest)
}
"""
"""Makes the Signal K server listen on the loopback only, instead of all interfaces."""
PILOTS = "/signalk/v2/api/vessels/self/autopilots"


def installed(name):
    """The path of a program, also from npm packages in STEERWAY_NODE_MODULES; without it the test is skipped."""
    beside = Path(os.environ.get("STEERWAY_NODE_MODULES", "node_modules"), ".bin", name).absolute()
    path = shutil.which(name) or (str(beside) if beside.exists() else None)
    if path is None:
        pytest.skip(f"{name} is not installed")
    return path


@contextlib.contextmanager
def signalk_server(folder, off=()):
    """The port of a Signal K server on the loopback."""
    server, port = installed("signalk-server"), free_port()
    off = (*off, "appstore", "nmea-tcp", "tcp", "webapps", "logfiles")
    settings = {"interfaces": dict.fromkeys(off, False), "mdns": False, "ssl": False, "pipedProviders": []}
    (folder / "settings.json").write_text(json.dumps(settings))
    (folder / "loopback.js").write_text(LOOPBACK)
    surroundings = os.environ | {
        "PORT": str(port),
        "SIGNALK_NODE_CONFIG_DIR": str(folder),
        "NODE_OPTIONS": f"--require {folder / 'loopback.js'}",
        "HOME": str(folder),
    }

    async def answers():
        for _ in range(300):
            try:
                return await asyncio.open_connection("127.0.0.1", port)
            except OSError:
                await asyncio.sleep(0.1)
        pytest.skip("the Signal K server does not start here")

    with running(server, env=surroundings, cwd=folder):
        asyncio.run(answers())
        yield port


def test_the_plugin_steers_by_the_autopilot_api_of_a_server(tmp_path):
    """The plugin of `integrations/signalk`, installed in a server, connected to the control port."""
    plugin = Path(__file__).parents[1] / "integrations" / "signalk"
    installed("signalk-server")
    token, control = "token of the control port", free_port()
    (tmp_path / "node_modules").mkdir()
    shutil.copytree(plugin, tmp_path / "node_modules" / "signalk-steerway")
    package = {"name": "config", "version": "0.0.1", "dependencies": {"signalk-steerway": "0.1.0"}}
    (tmp_path / "package.json").write_text(json.dumps(package))
    (tmp_path / "token").write_text(token)
    (tmp_path / "plugin-config-data").mkdir()
    options = {"enabled": True, "configuration": {"port": control, "tokenFile": str(tmp_path / "token")}}
    (tmp_path / "plugin-config-data" / "signalk-steerway.json").write_text(json.dumps(options))

    def call(method, path="", value=None):
        body = None if value is None else json.dumps({"value": value}).encode()
        request = urllib.request.Request(
            f"http://127.0.0.1:{port}{PILOTS}{path}", body, {"Content-Type": "application/json"}, method=method
        )
        try:
            with urllib.request.urlopen(request) as reply:
                return reply.status, json.loads(reply.read())
        except urllib.error.HTTPError as error:
            return error.code, json.loads(error.read())
        except OSError:
            return 0, {}

    requests = []

    def do(what, value, who):
        if what == "hold-position":
            raise InputError("the position is not known, expected one that can be held")
        requests.append((what, value))

    state = {"state": "ready", "reason": "", "mode": "course", "target": 1.25, "engaged": False}
    asked = SimpleNamespace(do=do, state=lambda: state)

    async def chain():
        task = asyncio.create_task(ControlPort(asked, Address("127.0.0.1", control, token)).run())
        for _ in range(200):
            status, found = await asyncio.to_thread(call, "GET", "/steerway")
            if status == 200 and found["state"] != "offline":
                break
            await asyncio.sleep(0.1)
        answers = [found, (await asyncio.to_thread(call, "GET"))[1]]
        for method, path, value in (
            ("POST", "/_default/engage", None),
            ("PUT", "/steerway/target", 1.25),
            ("PUT", "/steerway/target/adjust", -0.125),
            ("PUT", "/steerway/mode", "route"),
            ("POST", "/steerway/tack/port", None),
            ("PUT", "/steerway/mode", "wind"),
            ("PUT", "/steerway/mode", "position"),
            ("POST", "/steerway/disengage", None),
        ):
            answers.append(await asyncio.to_thread(call, method, path, value))
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        await asyncio.sleep(0.3)
        return (
            answers,
            await asyncio.to_thread(call, "GET", "/steerway/state"),
            await asyncio.to_thread(call, "POST", "/steerway/engage"),
        )

    with signalk_server(tmp_path) as port:
        (found, devices, *answers), offline, refused = asyncio.run(chain())
    assert (found["state"], found["mode"], found["target"], found["engaged"]) == ("standby", "course", 1.25, False)
    assert devices["steerway"]["provider"] == "signalk-steerway"
    assert requests == [("start", None), ("hold-course", 1.25), ("adjust", -0.125), ("route", None), ("stop", None)]
    assert [status for status, _ in answers] == [200, 200, 200, 200, 501, 501, 400, 200]
    assert "tacking is not supported" in answers[4][1]["message"] and "mode wind" in answers[5][1]["message"]
    assert "the position is not known" in answers[6][1]["message"]
    assert offline[1] == {"value": "offline"} and refused[0] == 503


def in_signal_k(motion, k):
    """The values that a Signal K server should have after a row."""
    return {
        "navigation.position": {
            "latitude": math.degrees(motion.latitude[k]),
            "longitude": math.degrees(motion.longitude[k]),
        },
        "navigation.speedOverGround": motion.sog[k],
        "navigation.courseOverGroundTrue": motion.cog[k] % (2.0 * math.pi),
        "navigation.rateOfTurn": motion.course_rate[k],
    }


def assert_held(value, wanted):
    """Equal within 1e-6, positions within 1e-9° (0.1 mm); null for NaN."""
    if isinstance(wanted, dict):
        assert value == pytest.approx(wanted, abs=1e-9)
    else:
        assert math.isnan(wanted) if value is None else value == pytest.approx(wanted, abs=1e-6)


def test_gpsfake_to_signal_k_and_read_back(tmp_path):
    gpsfake = installed("gpsfake")
    installed("gpsd")
    port, deltas, log = free_port(), [], tmp_path / "log.nmea"
    # Positions that are exact in degrees and in minutes, so that no format rounds them.
    places = [(START + k, 54.0 + 3e-5 * k, 10.0 + 6e-5 * k) for k in range(60)]
    log.write_bytes(b"".join(gga(*place) + rmc(*place) for place in places))

    async def read_back(server):
        async with connected(addresses.sources([server])[0][0]) as stream:
            wanted = [{"path": "navigation.*", "policy": "instant"}]
            await stream.send(json.dumps({"context": "vessels.self", "subscribe": wanted}))
            async for message in stream:
                deltas.extend(json.loads(message).get("updates", []))

    async def chain(signalk_port):
        server = f"signalk://127.0.0.1:{signalk_port}"
        async with under_way(read_back(server)), serving([f"gpsd://127.0.0.1:{port}"], [server]) as kept:
            await asyncio.sleep(0.5)
            with running(gpsfake, "-1", "-q", "-c", "0.05", "-P", str(port), str(log)):
                await until(lambda: kept.fixes and kept.fixes[-1].time >= START + 59.0, 30.0)
                await asyncio.sleep(0.5)
                address = f"http://127.0.0.1:{signalk_port}/signalk/v1/api/vessels/self/navigation"
                rest = json.loads(await asyncio.to_thread(lambda: urllib.request.urlopen(address).read()))
        return kept, rest

    with signalk_server(tmp_path, ("plugins",)) as signalk_port:
        kept, rest = asyncio.run(chain(signalk_port))
    (fixes,) = nmea0183.read(log.read_bytes()).sources.values()
    motion = estimate(fixes.between(kept.fixes[0].time - 0.5), "small-usv", causal=True)
    assert len(kept.fixes) == len(motion) >= 30  # gpsd uses the first sentences to find the receiver's protocol
    for path, wanted in in_signal_k(motion, -1).items():
        held = rest[path.removeprefix("navigation.")]
        assert held["$source"] == "steerway" and held["timestamp"] == "2024-07-01T12:00:59Z"
        assert_held(held["value"], wanted)
    row_of = {iso(time): k for k, time in enumerate(motion.time)}
    given = {update["timestamp"]: update for update in deltas if update["$source"] == "steerway"}
    assert len(given.keys() & row_of.keys()) >= len(motion) - 1
    for moment in given.keys() & row_of.keys():
        wanted = in_signal_k(motion, row_of[moment])
        for pair in given[moment]["values"]:
            assert_held(pair["value"], wanted[pair["path"]])


def test_the_command_from_end_to_end(tmp_path):
    log = tmp_path / "sortie.nmea"
    log.write_bytes(sortie(30))
    ends = ("--from", f"file:{log}?speed=max", "--to", "stdout:", "--to", f"file:{tmp_path}/run.csv")
    code, said, logged = run_process("live", *ends, "--source", "GP", "--profile", "small-usv")
    assert code == 0 and "30 used" in logged
    lines = [json.loads(line) for line in said.splitlines()]
    motion = estimate(nmea0183.read(log.read_bytes()).sources["GP"], "small-usv", causal=True).to_frame()
    assert lines == motion.to_dicts()
    assert (tmp_path / "run.csv").read_text().count("\n") == 31
