"""Faults of files, disks and processes: for each a command, its message, its exit code, its time and memory.

They are the table of docs/faults.md.
"""

import gzip
import os
import re
import resource
import signal
import subprocess
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from mcap.writer import CompressionType

from tests.command_line import STEERWAY
from tests.faults.table import Table
from tests.sentences import sortie
from tests.test_hostile_input import bag, endless, mcap, parquet

TABLE = Table("faults.md", "faults", "| what is tried | command | what it says | exit | time | memory |")
SCENARIO = """duration = 400
[route]
at_end = "stop"
waypoints = [{ north = 0, east = 0 }, { north = 2000, east = 0 }]
"""
HEADER = b"time_s,lat_deg,lon_deg\n"
LOG = "log.nmea"


class Outcome(NamedTuple):
    """Result of a command: last line on standard error, exit code, time, peak memory (MB), number of processes left.

    `seconds`: processor time, or for a signal the time until the last process has ended.
    """

    said: str
    code: int
    seconds: float
    memory: float
    left: int


class Fault(NamedTuple):
    """`prepare(folder)` makes the files; signal `number` follows once `until(folder)`; `limit`: file size, bytes."""

    name: str
    command: str
    prepare: Callable[[Path], None]
    number: int = 0
    until: Callable[[Path], bool] | None = None
    limit: int | None = None
    output: str | None = None


def measured(name: str) -> Outcome:
    """Try a fault in a temporary folder."""
    fault = FAULTS[name]
    with tempfile.TemporaryDirectory() as folder:
        fault.prepare(Path(folder))
        return _run(fault, Path(folder))


def _run(fault, folder):
    def prepared():
        for each in (signal.SIGINT, signal.SIGTERM):
            signal.signal(each, signal.SIG_DFL)
        if fault.limit is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (fault.limit, fault.limit))

    command = [*STEERWAY, *fault.command.split()[1:]]
    with open(fault.output or os.devnull, "w") as output, open(folder / "said", "w+") as said:
        began = time.monotonic()
        process = subprocess.Popen(
            command, cwd=folder, stdout=output, stderr=said, preexec_fn=prepared, start_new_session=True
        )
        while fault.until is not None and not fault.until(folder):
            if process.poll() is not None or time.monotonic() - began > 120.0:
                raise RuntimeError(f"{fault.name}: the command did not reach the moment for the signal")
            time.sleep(0.02)
        peak = _peak(process.pid)
        if fault.number:
            began = time.monotonic()
            os.kill(process.pid, fault.number)
        while (ended := os.wait4(process.pid, os.WNOHANG))[0] == 0:
            peak = max(peak, _peak(process.pid))
            time.sleep(0.01)
        _, status, used = ended
        process.returncode = os.waitstatus_to_exitcode(status)
        while fault.number and of_session(process.pid) and time.monotonic() - began < 10.0:
            time.sleep(0.02)
        seconds = time.monotonic() - began if fault.number else used.ru_utime + used.ru_stime
        left = len(of_session(process.pid))
        said.seek(0)
        lines = said.read().replace(str(folder) + "/", "").strip().splitlines() or [""]
    return Outcome(lines[-1], process.returncode, seconds, peak, left)


def _peak(process: int) -> float:
    """Peak memory of a process so far, MB; `wait4` would include that of the process it was forked from."""
    try:
        status = (Path("/proc") / str(process) / "status").read_text()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1e3 for line in status.splitlines() if line.startswith("VmHWM")), 0.0)


def of_session(leader: int) -> list[int]:
    """Processes of a session that still run."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(fields[3]) == leader and fields[0] != "Z":
                found.append(int(entry.name))
    return found


def _packed_zeros(folder):
    with gzip.open(folder / "log.gz", "wb", compresslevel=9) as file:
        for _ in range(1500):
            file.write(bytes(1_000_000))


def _packed_headers(folder):
    """UBX headers without frames: of all data that unpack within the limit, these take longest to read."""
    (folder / "log.gz").write_bytes(gzip.compress(b"\xb5\x62\x01\x07\x5c\x00" * 2_650_000))


def _packed_table(folder):
    with zipfile.ZipFile(folder / "day.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("day.csv", b"mmsi," + HEADER + bytes(1_000_000_000))


def _file(name, data):
    return lambda folder: (folder / name).write_bytes(data)


def _link(to):
    return lambda folder: (folder / "link.csv").symlink_to(to)


def _log(folder):
    (folder / LOG).write_bytes(sortie(60))


def _log_and(further):
    """A log, and what `further(folder)` makes beside it."""
    return lambda folder: (_log(folder), further(folder))


_scenario = _file("leg.toml", SCENARIO.encode())


def _some_seeds(folder):
    return _size(folder / "many" / "campaign.unfinished") > 1000


def _size(path):
    return path.stat().st_size if path.exists() else 0


ESTIMATE_TO = f"steerway estimate {LOG} --profile small-usv -o"
CAMPAIGN = "steerway simulate leg.toml --seeds 4000 -o many"
_ALL = (
    Fault("a gzip file of 1.5 MB that unpacks to 1.5 GB", "steerway info log.gz", _packed_zeros),
    Fault("a small gzip file of 16 MB of UBX headers", "steerway info log.gz", _packed_headers),
    Fault("a ZIP file of 1 MB that unpacks to 1 GB", "steerway archive run day.zip -o archive", _packed_table),
    Fault("an MCAP chunk that unpacks to 0.5 GB", "steerway info run.mcap",
          lambda folder: (folder / "run.mcap").write_bytes(mcap(CompressionType.ZSTD, 500))),
    Fault("a ROS 2 bag with an endless query for messages", "steerway info bag.db3",
          _file("bag.db3", bag(endless("x'00'")))),
    Fault(
        "1 MB of GPX, every point in a CDATA section without end",
        "steerway info log.gpx",
        _file("log.gpx", b"<gpx>" + b"<trkpt><![CDATA[ " * 59_000),
    ),
    Fault("1 MB of empty lines under a header", "steerway info log.csv", _file("log.csv", HEADER + b"\n" * 999_000)),
    Fault("a damaged Parquet file", "steerway info log.parquet",
          lambda folder: (folder / "log.parquet").write_bytes(b"PAR1" + bytes(36) + parquet(2)[40:])),
    Fault("a directory in place of a log", "steerway info logs", lambda folder: (folder / "logs").mkdir()),
    Fault("times beyond every date", "steerway estimate log.csv", _file("log.csv", HEADER + b"1e300,54,10\n" * 9)),
    Fault("an empty profile", f"steerway estimate {LOG} --profile mine.toml", _log_and(_file("mine.toml", b""))),
    Fault("standard output is full", f"steerway info {LOG}", _log, output="/dev/full"),
    Fault("the disk is full: a table", f"{ESTIMATE_TO} track.parquet", _log, limit=1000),
    Fault("the disk is full: a page", f"{ESTIMATE_TO[:-2]}--report page.html", _log, limit=1000),
    Fault("the disk is full: a picture", f"{ESTIMATE_TO[:-2]}--report page.png", _log, limit=1000),
    Fault("the disk is full: a recording for ROS 2", f"{ESTIMATE_TO} track.mcap", _log, limit=1000),
    Fault("the disk is full: a run", "steerway simulate leg.toml -o run", _scenario, limit=1000),
    Fault("the disk is full: a campaign", "steerway simulate leg.toml --seeds 2 -o many", _scenario, limit=300),
    Fault("the output is a symbolic link", f"{ESTIMATE_TO} link.csv", _log_and(_link("track.csv"))),
    Fault("the output is a link to itself", f"{ESTIMATE_TO} link.csv", _log_and(_link("link.csv"))),
    Fault("the output is the input", "steerway estimate log.csv -o log.csv", _file("log.csv", HEADER)),
    Fault("Ctrl-C in a campaign on all cores", CAMPAIGN, _scenario, signal.SIGINT, _some_seeds),
    Fault("SIGTERM in a campaign on all cores", CAMPAIGN, _scenario, signal.SIGTERM, _some_seeds),
    Fault("SIGKILL of a campaign on all cores", CAMPAIGN, _scenario, signal.SIGKILL, _some_seeds),
    Fault("SIGINT in a study", "steerway study mariner-los -o study", lambda folder: None, signal.SIGINT,
          lambda folder: _size(folder / "study" / "study.unfinished") > 500),
)  # fmt: skip
FAULTS = {each.name: each for each in _ALL}


def line(name: str, found: Outcome) -> str:
    """A line of the table, without counts that depend on the time of the signal."""
    fault = FAULTS[name]
    said = found.said.removeprefix("steerway: ").replace("|", "\\|")
    said = re.sub(r"\b\d+( of \d+)? (seeds|parts)\b", r"… \2", said)
    ended = f"signal {-found.code}" if found.code < 0 else f"{found.code}"
    left = f", {found.left or 'no'} process left" if fault.number else ""
    return (
        f"| {fault.name} | `{fault.command}` | {said or 'nothing'} | {ended}{left} | {found.seconds:.1f} s | "
        f"{found.memory:.0f} MB |"
    )
