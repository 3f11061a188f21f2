"""Faults of what surrounds the boat: each is done to the part that meets it, and what that says or gives is kept."""

import io
import json
import logging
import time
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from steerway.core import OK
from steerway.core.testing import iso
from steerway.live.testing import (
    Deltas,
    FileSink,
    Guided,
    Order,
    Row,
    SignalKDecoder,
    State,
    dialect,
    log_to_stderr,
    lost,
)
from tests.disk import Disk

NOON = 1_719_835_200.0
ROW = Row(NOON, 0.9, 0.2, 2.0, 1.0, 0.01, 0.1, 0.02, 0.01, 0.3, 1.2, OK)
LOG = logging.getLogger("steerway.live")


@contextmanager
def logged():
    """The log as a user sees it: a text stream."""
    log_to_stderr("steerway live")
    stream, (handler,) = io.StringIO(), LOG.handlers
    handler.setStream(stream)
    try:
        yield stream
    finally:
        LOG.handlers[:], LOG.propagate = [], True


def full_disk() -> str:
    """Five lines of ten bytes to a disk with room for two and a half."""
    with TemporaryDirectory() as directory, logged() as log:
        path = Path(directory) / "rows.jsonl"
        disk = Disk(path, "w")
        disk.room = 24
        sink = FileSink(disk, name="rows.jsonl")
        for k in range(5):
            sink.send(b"message %d\n" % k)
        while not sink._lines.empty():
            time.sleep(0.01)
        sink.close()
        kept = path.read_bytes().split(b"\n")
    assert kept[-1] == b"", "a torn line"
    return f"{len(kept) - 1} whole lines kept, {sink.lost} lost; {log.getvalue().splitlines()[0]}"


def forged_name() -> str:
    """A vessel's text that would begin a line of its own, and colour it."""
    with logged() as log:
        LOG.warning("vehicle: %s", "ok\nsteerway live: autopilot stopped\x1b[31m")
    lines = log.getvalue().splitlines()
    return f"{len(lines)} line: {lines[0]}"


def unknown_position() -> str:
    """A Signal K server's share of a fix and of what is not known any more."""
    given = []
    sink = type("Sink", (), {"send": staticmethod(given.append)})()
    output = Deltas(sink)
    output.fix(ROW)
    for k in range(30, 60):
        output.tick(lost(NOON + 0.1 * k))
    updates = [json.loads(each)["updates"][0]["values"] for each in given]
    nulls = [each["path"] for each in updates[1] if each["value"] is None]
    assert all(each["value"] is not None for values in updates for each in values if "position" in each["path"])
    return f"null once for {', '.join(name.removeprefix('navigation.') for name in nulls)}; never a null position"


def own_values() -> str:
    """Own deltas that a server sends back."""
    decoder, rows = SignalKDecoder(), []
    value = {"path": "navigation.speedOverGround", "value": 1.0}
    for source in ("steerway", "steerway.XX"):
        rows += decoder.message(
            json.dumps({"updates": [{"$source": source, "timestamp": iso(NOON), "values": [value]}]})
        )
    return f"{len(rows + decoder.settle())} rows used"


def _vehicle(ekf: int = 0x33F, armed: bool = True, answer: str | None = None) -> tuple[str, str]:
    """(obstacle, refusal) of a boat of ArduPilot's of which GUIDED is requested for 5 s."""
    m = dialect("a fault")
    guided, answers = Guided(m), []
    flags = m.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (m.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
    boat = m.MAV_TYPE_SURFACE_BOAT, m.MAV_AUTOPILOT_ARDUPILOTMEGA
    first = ""
    for k in range(60):
        now = 0.1 * k
        reports = [m.MAVLink_heartbeat_message(*boat, flags, 0, m.MAV_STATE_ACTIVE, 3)]
        reports.append(m.MAVLink_ekf_status_report_message(ekf, 0.1, 0.1, 0.1, 0.1, 0.0))
        reports.append(m.MAVLink_gps_raw_int_message(0, m.GPS_FIX_TYPE_3D_FIX, 1, 1, 0, 0, 0, 0, 0, 9))
        for each in reports + answers:
            each._header = m.MAVLink_header(0, srcSystem=1, srcComponent=1)
            guided.receive(each, now)
        answers = []
        first = guided.obstacle(now) if k == 0 else first
        for sent in guided.due(now, Order(State.RUNNING, engaged=True)):
            if answer and sent.get_type() == "COMMAND_LONG" and sent.command == m.MAV_CMD_DO_SET_MODE:
                answers.append(m.MAVLink_command_ack_message(sent.command, getattr(m, answer)))
    return first, guided.refusal


FAULTS = {
    "the disk is full": full_disk,
    "a name with a line end and an escape": forged_name,
    "the position becomes unknown, Signal K": unknown_position,
    "a server sends own values back, Signal K": own_values,
    "the vehicle's EKF knows the attitude only": lambda: _vehicle(ekf=1)[0],
    "the vehicle is not armed": lambda: _vehicle(armed=False)[0],
    "GUIDED is refused, ACK FAILED": lambda: _vehicle(answer="MAV_RESULT_FAILED")[1],
    "GUIDED is refused, ACK DENIED": lambda: _vehicle(answer="MAV_RESULT_DENIED")[1],
    "GUIDED is not answered": lambda: _vehicle()[1],
}
