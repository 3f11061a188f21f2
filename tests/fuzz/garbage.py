"""A million messages of garbage through every link of a boat that is steered.

`python -m tests.fuzz.garbage [MESSAGES]` says what came of them, and ends with 1 if the service did.
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
"""Bytes of a message; how many come within 0.2 s; how many mutations there are, which come in any order; the share of
sound messages among them; messages of a connection."""


def _decoded(decoder) -> Callable[[bytes], list[InputRow]]:
    """A link that is opened anew now and then."""
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
    """Mutated messages, sound ones and random bytes, without end."""
    lines = [each for each in sound if 0 < len(each) <= _LONGEST]  # packets, which may have any byte
    lines += [line for each in sound for line in each.split(b"\n") if 0 < len(line) <= _LONGEST]
    kept = [mutated(rng.choice(lines), lines, rng)[:_LONGEST] for _ in range(_DIFFERENT)]
    kept += rng.choices(lines, k=int(_SOUND * _DIFFERENT)) + [rng.randbytes(rng.randrange(100)) for _ in range(500)]
    while True:
        yield rng.choice(kept)


def endured(link: str, messages: int = MESSAGES, seed: int = 1) -> dict[str, int]:
    """Counts of what a link made of garbage. AssertionError for a service that ended, or an order that is no number."""
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
    """Every link; 1 if one ended the service or an order was no number."""
    logging.disable(logging.CRITICAL)  # vehicles may say anything
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
