"""A million garbage messages through every link of a boat under autopilot.

`python -m tests.fuzz.garbage [MESSAGES]` prints the results; its exit code is 1 if the service ended.
"""

import logging
import random
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from itertools import count, islice

from steerway.formats.testing import frame_of_line
from steerway.live.testing import (
    Companion,
    GpsdDecoder,
    InputRow,
    N2kDecoder,
    ReceiverDecoder,
    SignalKDecoder,
    addresses,
)
from tests.fuzz import seeds
from tests.fuzz.aboard import Aboard
from tests.fuzz.mutation import mutated

MESSAGES = 1_000_000
_LONGEST, _TOGETHER, _DIFFERENT, _SOUND, _CONNECTED = 2000, 500, 20_000, 0.3, 1000
"""Largest size of a message, bytes; messages per 0.2 s; number of different mutations, drawn at random; sound messages
per mutation; messages per connection."""


def _decoded(decoder) -> Callable[[bytes], list[InputRow]]:
    """A reader of messages that reopens its link every `_CONNECTED` messages."""
    opened = count()

    def read(message):
        if next(opened) % _CONNECTED == 0 and hasattr(decoder, "restart"):
            decoder.restart()
        return [*decoder.feed(message + b"\n"), *decoder.complete_on_silence()]

    return read


def _gateway():
    decoder = N2kDecoder()

    def read(message):
        frame = frame_of_line(message)
        return [] if frame is None else decoder.frame(frame, time.time())

    return read


def _vehicle():
    rows, heard = [], count()

    def opened():
        companion = Companion(addresses.sources(["mavlink:udpin:127.0.0.1:1"])[0][0])
        companion._deliver = lambda given, arrived: rows.extend(given)
        return companion

    link = [opened()]

    def read(message):
        rows.clear()
        if next(heard) % _CONNECTED == 0:
            link[:] = [opened()]
        link[0].link._feed(message)
        return list(rows)

    return read


LINKS = {
    "NMEA 0183 and UBX": (seeds.mixed, lambda: _decoded(ReceiverDecoder())),
    "gpsd": (seeds.gpsd, lambda: _decoded(GpsdDecoder())),
    "Signal K": (seeds.signalk, lambda: _decoded(SignalKDecoder())),
    "NMEA 2000": (seeds.gateway, _gateway),
    "MAVLink": (seeds.mavlink, _vehicle),
}


def garbage(sound: list[bytes], rng: random.Random) -> Iterator[bytes]:
    """An endless mixture of mutated messages, sound messages and random bytes."""
    lines = [each for each in sound if 0 < len(each) <= _LONGEST]  # whole packets, which may contain line ends
    lines += [line for each in sound for line in each.split(b"\n") if 0 < len(line) <= _LONGEST]
    kept = [mutated(rng.choice(lines), lines, rng)[:_LONGEST] for _ in range(_DIFFERENT)]
    kept += rng.choices(lines, k=int(_SOUND * _DIFFERENT)) + [rng.randbytes(rng.randrange(100)) for _ in range(500)]
    while True:
        yield rng.choice(kept)


def endured(link: str, messages: int = MESSAGES, seed: int = 1) -> dict[str, int]:
    """Counts after garbage on a link. Raises AssertionError if the service has ended or an order is not a number."""
    sound, reader = LINKS[link]
    boats, read, counts = [Aboard()], reader(), {"messages": 0, "rows": 0, "failed": 0, "boats": 1}
    source = garbage(sound(), random.Random(seed))
    while counts["messages"] < messages:
        part = list(islice(source, min(_TOGETHER, messages - counts["messages"])))
        rows = [row for message in part for row in read(message)]
        boats[-1].take(rows)
        counts["messages"] += len(part)
        counts["rows"] += len(rows)
        if boats[-1].is_spent:
            counts["failed"] += boats[-1].desk.navigator.counts["failed"]
            boats[-1].dock()
            boats.append(Aboard())
            counts["boats"] += 1
    counts["failed"] += boats[-1].desk.navigator.counts["failed"]
    boats[-1].dock()
    return counts


def main() -> int:
    """Try every link; return 1 if one ended the service or an order was not a number."""
    logging.disable(logging.CRITICAL)  # texts of vehicles would be logged
    messages, missed = int(sys.argv[1]) if len(sys.argv) > 1 else MESSAGES, 0
    for link in LINKS:
        began = time.process_time()
        try:
            said = ", ".join(f"{count} {what}" for what, count in endured(link, messages).items())
        except Exception:
            traceback.print_exc()
            said, missed = "ended", missed + 1
        print(f"{link}: {said} in {time.process_time() - began:.0f} s", flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
