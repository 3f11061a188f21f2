"""Latency of orders and of STOP up to the wire, with sentences, JSON lines, a table and the helm page open too.

A simulated receiver sends over UDP (5 Hz, a boat at 2 m/s); propeller commands come back over UDP. The latency of an
order is the time from its tick, by the receiver's clock, to its arrival; the latency of STOP is the time from the
request at the control port to the first command with state "stopped".
"""

import json
import math
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from tests.ports import free_port

from benchmarks.support.harness import Result
from steerway.formats.nmea0183.writing import gga, rmc

_STOPS, _SECONDS = 20, 30.0
_TOKEN = "token of the benchmark"
_STEP = 2.0 / 6.37e6  # rad of latitude per second at 2 m/s
_HOME = math.radians(54.0), math.radians(10.0)
_MISSION = "speed_mps = 2.0\n" + "".join(
    f"[[waypoint]]\nlat_deg = {54.0 + north}\nlon_deg = 10.0\n" for north in (0.0, 0.2)
)
_HERE = "127.0.0.1"


def run():
    orders, stops = measure()
    note = f"{len(orders)} orders"
    yield Result("order to wire, median", 1e3 * statistics.median(orders), "ms", note=note)
    yield Result("order to wire, 99 %", 1e3 * statistics.quantiles(orders, n=100)[98], "ms", at_most=50.0)
    yield Result("STOP to wire, median", 1e3 * statistics.median(stops), "ms", note=f"{len(stops)} times")
    yield Result("STOP to wire, most", 1e3 * max(stops), "ms", at_most=200.0)


def measure() -> tuple[list[float], list[float]]:
    """Latencies of orders and of STOPs, s."""
    receiver, motors = (free_port(socket.SOCK_DGRAM) for _ in range(2))
    sentences, control, helm = (free_port() for _ in range(3))
    running = threading.Event()
    running.set()
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as commands:
        commands.bind((_HERE, motors))
        commands.settimeout(10.0)
        Path(folder, "route.toml").write_text(_MISSION)
        Path(folder, "token").write_text(_TOKEN)
        options = {
            "--from": f"udp://{_HERE}:{receiver}",
            "--profile": "small-usv",
            "--mission": f"{folder}/route.toml",
            "--helm": f"{_HERE}:{helm}",
            "--control": f"{_HERE}:{control}",
            "--control-token-file": f"{folder}/token",
        }
        outputs = (
            f"udp://{_HERE}:{motors}?format=propellers&period=0.02",
            f"tcp-server://{_HERE}:{sentences}",
            "stdout:",
        )
        arguments = [part for pair in options.items() for part in pair]
        arguments += [part for each in (*outputs, f"file:{folder}/run.parquet") for part in ("--to", each)]
        command = [sys.executable, "-c", "from steerway.commands.cli import main; main()", "live", *arguments]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        sailing = threading.Thread(target=_sail, args=(running, receiver))
        sailing.start()
        try:
            with _connected(control) as talk:
                return _start_and_stop(talk, commands)
        finally:
            running.clear()
            sailing.join()
            process.terminate()
            process.wait(20.0)


def _sail(running, port):
    """Send the receiver's sentences."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        while running.is_set():
            now = round(time.time() * 5.0) / 5.0 + 0.2
            time.sleep(max(now - time.time(), 0.0))
            place = _HOME[0] + _STEP * (now % 10000.0), _HOME[1]
            sender.sendto((gga(now, *place) + rmc(now, *place)).encode(), (_HERE, port))


def _start_and_stop(talk, commands):
    """Start and stop the autopilot `_STOPS` times."""
    orders, stops = [], []

    def send(**message):
        talk.sendall(json.dumps(message).encode() + b"\n")

    def until(*states):
        while True:
            line = json.loads(commands.recv(4096))
            if line["state"] in states:
                return time.time(), line

    send(token=_TOKEN)
    for _ in range(_STOPS):
        until("ready", "stopped")
        line = {"state": "ready"}
        while line["state"] not in ("running", "degraded"):
            send(id=1, do="start")
            _, line = until("running", "degraded", "stopped", "ready")
        end = time.time() + _SECONDS / _STOPS
        while time.time() < end:
            moment, line = until("running", "degraded")
            orders.append(moment - line["time"])
        begun = time.time()
        send(id=2, do="stop")
        stops.append(until("stopped")[0] - begun)
    return orders, stops


def _connected(port):
    for _ in range(600):
        try:
            return socket.create_connection((_HERE, port))
        except OSError:
            time.sleep(0.1)
    raise SystemExit("the control port does not open")
