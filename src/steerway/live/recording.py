"""Records a run as MCAP: every input as received, every estimate and every order; Foxglove displays the file.

Topics: `/raw` the bytes of the links, `/input` the decoded rows as the navigator receives them, `/estimate` a row per
fix, `/order` a row per tick with an autopilot, `/position` for maps, `/learning` when a profile was inferred. The
metadata `steerway` contains the settings that `replay` needs, and the version of the code.
"""

import json
import math
import time
from pathlib import Path
from typing import Any

from steerway import __version__
from steerway.core.errors import InputError
from steerway.core.kernel_cache import source_digest
from steerway.core.leg import Leg
from steerway.core.locks import held_elsewhere
from steerway.formats.mcap import INPUT, require_mcap
from steerway.live.links.file import FileSink
from steerway.live.outputs.output import Output, or_null
from steerway.live.rows import InputRow, Order, Row

RAW, ESTIMATE, ORDER, POSITION, LEARNING = "/raw", "/estimate", "/order", "/position", "/learning"
SETTINGS = "steerway"
"""The name of the metadata, with the keys `settings` and `code`."""
_CHUNK = 1 << 16  # bytes per chunk; a loss of power loses at most one chunk


def code() -> str:
    """Version of the package, and a digest of all code between an input and its estimate."""
    return f"{__version__}-{source_digest('steerway.live.service')}"


class Recorder(Output):
    """Writes a recording: an output that also receives the inputs. Raises InputError for a file it cannot write.

    If the disk is full, recording stops after the last whole chunk, with a line in the log; the run goes on.
    """

    def __init__(self, path: str | Path, settings: dict[str, Any]):
        require_mcap(f"record {path}")
        from mcap.writer import Writer

        if Path(path).suffix != ".mcap":
            raise InputError(f"record {path} ends in {Path(path).suffix or 'nothing'!r}, expected .mcap")
        try:
            file = open(path, "ab", buffering=0)
            if held_elsewhere(file):
                raise InputError(f"record {path} is being written by another process, expected a file of its own")
            file.truncate(0)
        except OSError as error:
            raise InputError(f"record {path} cannot be written: {error.strerror}") from None
        self._sink = FileSink(file, lossless=True, name=str(path), whole=True)
        self.path = path
        self._pieces, self._size = bytearray(), 0
        self._writer = Writer(self, chunk_size=_CHUNK)  # type: ignore[arg-type]
        self._writer.start(profile="", library="steerway")
        self._writer.add_metadata(SETTINGS, {"settings": json.dumps(settings), "code": code()})
        self._channels = {}
        names = {INPUT: "Input", ESTIMATE: "Row", ORDER: "Order", LEARNING: "Learning"}
        for topic, name in names.items():
            self._channels[topic] = self._channel(topic, f"steerway.{name}")
        self._channels[POSITION] = self._channel(POSITION, "foxglove.LocationFix")
        self._channels[RAW] = self._writer.register_channel(RAW, "application/octet-stream", 0)
        self._send()

    def write(self, data: bytes) -> int:
        """See io.RawIOBase. The data are kept until their chunk is complete."""
        self._pieces += data
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        """See io.RawIOBase."""
        return self._size

    def flush(self) -> None:
        """See io.RawIOBase."""

    def raw(self, link: str, data: bytes) -> None:
        """Record bytes received on a link."""
        self._add(RAW, link.encode() + b"\0" + data, time.time())

    def input(self, row: InputRow, arrived: float, chosen: str) -> None:
        """Record a row as the navigator receives it, its arrival (s, monotonic clock) and the chosen source."""
        values = {name: or_null(value) for name, value in row._asdict().items()}
        self._json(INPUT, values | {"arrived": or_null(arrived), "chosen": chosen}, row.time)

    def learning(self, what: str, count: int) -> None:
        """Record the number of the filter's row at which an inference begins or its profile is used; see `learning`."""
        self._json(LEARNING, {"what": what, "row": count}, time.time())

    def fix(self, row: Row) -> None:
        """See Output."""
        self._json(ESTIMATE, {name: or_null(value) for name, value in row._asdict().items()}, row.time)
        if row.valid:
            variance = row.position_std**2
            moment = divmod(round(row.time * 1e9), 1_000_000_000)
            place = {
                "timestamp": {"sec": moment[0], "nsec": moment[1]},
                "frame_id": "boat",
                "latitude": math.degrees(row.latitude),
                "longitude": math.degrees(row.longitude),
                "altitude": 0.0,
                "position_covariance": [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, 0.0],
                "position_covariance_type": 1,
            }
            self._json(POSITION, place, row.time)

    def tick(self, row: Row, leg: Leg | None = None, order: Order | None = None) -> None:
        """See Output."""
        if order is not None:
            values = {name: or_null(value) for name, value in row._asdict().items()}
            values["order"] = {name: or_null(value) for name, value in order._asdict().items()}
            self._json(ORDER, values, row.time)

    def close(self) -> None:
        """See Output."""
        self._writer.finish()
        self._send()
        self._sink.close()
        self._sink.file.close()

    def _channel(self, topic: str, name: str) -> int:
        schema = self._writer.register_schema(name, "jsonschema", b'{"type": "object"}')
        return self._writer.register_channel(topic, "json", schema)

    def _json(self, topic: str, values: dict[str, Any], moment: float) -> None:
        self._add(topic, json.dumps(values).encode(), moment)

    def _add(self, topic: str, data: bytes, moment: float) -> None:
        if self._sink.broken:
            return
        published = round(moment * 1e9) if math.isfinite(moment) and moment > 0.0 else 0
        self._writer.add_message(self._channels[topic], time.time_ns(), data, published)
        self._send()

    def _send(self) -> None:
        """Write the complete chunks only, so that a file that ends early is readable."""
        if self._pieces and not self._sink.broken:
            self._sink.send(bytes(self._pieces))
        self._pieces.clear()
