"""python -m benchmarks.orders: how long orders and a STOP take to the wire, with every output of this computer open.

A receiver is imitated over UDP (5 Hz, a boat at 2 m/s); the propeller commands come back over UDP. An order's latency
is from the time of its tick, by the receiver's clock, to its arrival here; that of STOP from the request at the control
port to the first command that is stopped.
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

from steerway.formats.nmea0183.writing import gga, rmc

LIMIT_ORDER, LIMIT_STOP = 0.05, 0.2
"""s, 99 % of the orders, and every STOP."""
_TOKEN = "token of the benchmark"
_STEP = 2.0 / 6.37e6  # rad a second at 2 m/s
_HOME = math.radians(54.0), math.radians(10.0)
_MISSION = "speed_mps = 2.0\n" + "".join(
    f"[[waypoint]]\nlat_deg = {54.0 + north}\nlon_deg = 10.0\n" for north in (0.0, 0.2)
)


def _port(kind):
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def measure(stops: int = 20, seconds: float = 30.0) -> tuple[list[float], list[float]]:
    """Latencies of orders and of STOPs, s."""
    udp, tcp = socket.SOCK_DGRAM, socket.SOCK_STREAM
    receiver, motors, sentences, control, helm = (_port(kind) for kind in (udp, udp, tcp, tcp, tcp))
    orders, ends, running = [], [], threading.Event()
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_INET, udp) as commands:
        commands.bind(("127.0.0.1", motors))
        commands.settimeout(10.0)
        Path(folder, "route.toml").write_text(_MISSION)
        Path(folder, "token").write_text(_TOKEN)
        process = subprocess.Popen(
            [
                *(sys.executable, "-c", "from steerway.commands.cli import main; main()", "live"),
                *(
                    "--from",
                    f"udp://127.0.0.1:{receiver}",
                    "--profile",
                    "small-usv",
                    "--mission",
                    f"{folder}/route.toml",
                ),
                *("--to", f"udp://127.0.0.1:{motors}?format=propellers&period=0.02", "--to", "stdout:"),
                *("--to", f"tcp-server://127.0.0.1:{sentences}", "--to", f"file:{folder}/run.parquet"),
                *("--helm", f"127.0.0.1:{helm}", "--control", f"127.0.0.1:{control}"),
                *("--control-token-file", f"{folder}/token"),
            ],
            stdout=subprocess.DEVNULL,
        )
        running.set()

        def sail():
            with socket.socket(socket.AF_INET, udp) as sender:
                while running.is_set():
                    now = round(time.time() * 5.0) / 5.0 + 0.2
                    time.sleep(max(now - time.time(), 0.0))
                    place = _HOME[0] + _STEP * (now % 10000.0), _HOME[1]
                    sender.sendto((gga(now, *place) + rmc(now, *place)).encode(), ("127.0.0.1", receiver))

        sailing = threading.Thread(target=sail)
        sailing.start()
        try:
            with _connected(control) as talk:
                _send(talk, {"token": _TOKEN})

                def until(states):
                    while True:
                        line = json.loads(commands.recv(4096))
                        if line["state"] in states:
                            return time.time(), line

                for _ in range(stops):
                    until(("ready", "stopped"))
                    while True:
                        _send(talk, {"id": 1, "do": "start"})
                        moment, line = until(("running", "degraded", "stopped", "ready"))
                        if line["state"] in ("running", "degraded"):
                            break
                    end = time.time() + seconds / stops
                    while time.time() < end:
                        moment, line = until(("running", "degraded"))
                        orders.append(moment - line["time"])
                    begun = time.time()
                    _send(talk, {"id": 2, "do": "stop"})
                    moment, _ = until(("stopped",))
                    ends.append(moment - begun)
        finally:
            running.clear()
            sailing.join()
            process.terminate()
            process.wait(20.0)
    return orders, ends


def _connected(port):
    for _ in range(600):
        try:
            return socket.create_connection(("127.0.0.1", port))
        except OSError:
            time.sleep(0.1)
    raise SystemExit("the control port does not open")


def _send(talk, message):
    talk.sendall(json.dumps(message).encode() + b"\n")


def main() -> None:
    """Print both; exit code 1 on a miss."""
    orders, ends = measure()
    worst, usual = statistics.quantiles(orders, n=100)[98], statistics.median(orders)
    print(f"order to wire: {len(orders)} orders, median {1e3 * usual:.1f} ms, 99 % {1e3 * worst:.1f} ms")
    usual = statistics.median(ends)
    print(f"STOP to wire: {len(ends)} times, median {1e3 * usual:.1f} ms, at most {1e3 * max(ends):.1f} ms")
    sys.exit(worst > LIMIT_ORDER or max(ends) > LIMIT_STOP)


if __name__ == "__main__":
    main()
