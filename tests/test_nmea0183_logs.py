"""The reader against pynmeagps on recorded logs; damage costs what it touches and nothing else."""

import itertools
import re
from functools import reduce
from operator import xor

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pynmeagps import NMEAReader
from pynmeagps.exceptions import NMEAMessageError, NMEAParseError, NMEATypeError

from steerway.formats.testing import fields as field
from steerway.formats.testing import nmea0183
from tests.reference_outputs.cases import logs
from tests.sentences import sortie

LOGS = [name for name in logs.LOGS if not re.search("ais|furuno|aava|navisys|ublox-[gnz]", name)]
LONGEST = 200_000
"""Bytes read of each log; pynmeagps takes a minute for five million."""

POSITION = re.compile(rb"\$..(?:GGA|RMC|GLL|GNS),[^\r\n]*")
VELOCITY = re.compile(rb"\$..VTG,[^\r\n]*")


def messages(data, pattern):
    """Byte offset and message of every sentence that pynmeagps accepts, also without a checksum, like our reader."""
    for found in pattern.finditer(data):
        raw = found.group()
        if b"*" not in raw:
            raw += b"*%02X" % reduce(xor, raw[1:], 0)
        try:
            message = NMEAReader.parse(raw + b"\r\n")
        except (NMEAMessageError, NMEAParseError, NMEATypeError):
            continue
        if message is not None:
            yield found.start(), message


def is_fix(message):
    """Whether a message of pynmeagps is a fix; it also reads messages with status V, mode N or quality 0."""
    valid = getattr(message, "status", "A") in ("A", "") and getattr(message, "posMode", "A") != "N"
    placed = all(isinstance(getattr(message, name, ""), float) for name in ("lat", "lon"))
    modes = set(getattr(message, "posMode", "A"))
    return valid and modes != {"N"} and getattr(message, "quality", 1) != 0 and placed


def seconds_of_day(time):
    return 3600 * time.hour + 60 * time.minute + time.second + 1e-6 * time.microsecond if time else np.nan


def velocity(message, speed, course):
    """The speed and course fields of a pynmeagps message (knots, degrees), NaN where empty."""
    return [np.nan if (value := getattr(message, name)) == "" else value for name in (speed, course)]


@pytest.mark.parametrize("name", LOGS)
def test_a_recorded_log_is_read_as_pynmeagps_reads_it(name, shared_data):
    data = (shared_data / "data" / name).read_bytes()[:LONGEST]
    data = data[: data.rindex(b"\n") + 1]
    fixes = {offset: message for offset, message in messages(data, POSITION) if is_fix(message)}
    found = nmea0183.sentences(data)
    offsets = found.offset.tolist()
    row_of = {offset: k for k, offset in enumerate(offsets) if np.isfinite(found.values[k, field.LAT])}
    assert set(row_of) == set(fixes)
    for offset, k in row_of.items():
        message, values = fixes[offset], found.values[k]
        # pynmeagps rounds degrees to ten decimals
        assert np.abs(np.degrees(values[[field.LAT, field.LON]]) - [message.lat, message.lon]).max() < 1e-10
        np.testing.assert_allclose(values[field.TOD], seconds_of_day(getattr(message, "time", "")), rtol=0, atol=1e-6)
    velocities = dict(messages(data, VELOCITY))
    moving = {offset: k for k, offset in enumerate(offsets) if found.kind[k] == field.VTG}
    assert set(moving) <= set(velocities)
    expected = [(k, velocity(velocities[offset], "sogn", "cogt")) for offset, k in moving.items()]
    expected = [(k, theirs) for k, theirs in expected if np.isfinite(theirs[0])]
    rmc = [(k, fixes[offset]) for offset, k in row_of.items() if fixes[offset].msgID == "RMC"]
    for k, theirs in expected + [(k, velocity(message, "spd", "cog")) for k, message in rmc]:
        ours = [found.values[k, field.SOG] * 3600 / 1852, np.degrees(found.values[k, field.COG])]
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)


WHOLE = sortie(60)
LINES = WHOLE.splitlines(keepends=True)
PLACE = st.integers(0, len(WHOLE) - 1)
quick = settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def readings_of(data):
    """The bytes of each sentence in a log."""
    return [data[k : data.index(b"*", k) + 3] for k in nmea0183.sentences(data).offset.tolist()]


@quick
@given(st.lists(PLACE, max_size=20), PLACE, PLACE, st.randoms(use_true_random=False))
def test_damage_costs_only_its_own_sentences(flipped, first, last, random):
    """Flipped bits, and a log of which a piece is left."""
    damaged, (first, last) = bytearray(WHOLE), sorted((first, last))
    for place in flipped:
        damaged[place] ^= 1 << random.randrange(8)
    expected, start = [], 0
    for sound in LINES:
        end = start + sound.index(b"*") + 3
        if first <= start and end <= last and damaged[start : start + len(sound)] == sound:
            expected.append(WHOLE[start:end])
        start += len(sound)
    kept, position = readings_of(bytes(damaged[first:last])), 0
    for sentence in expected:  # a subsequence: sentences that flips left valid can be in between
        position = kept.index(sentence, position) + 1
    assert flipped or kept == expected
    between = [b"\xb5b" + random.randbytes(90) + line for line in LINES[:20]]
    assert readings_of(b"".join(between)) == readings_of(b"".join(LINES[:20]))


@settings(quick, max_examples=40)
@given(st.lists(st.integers(1, 400), min_size=1, max_size=30), st.integers(0, 40), st.randoms(use_true_random=False))
def test_pieces_of_any_size_say_the_same_by_kernels_and_by_the_interpreter(sizes, damages, random):
    """Sound and damaged logs; short ones are read without compiling."""
    data = bytearray(b"2024-07-01T12:00:00.5Z ".join(LINES[:30]) + b"\x00$\xb5b$GP" + b"".join(LINES[30:90]))
    for _ in range(damages):
        data[random.randrange(len(data))] = random.choice(b"$*,.\r\n0A" if damages % 2 else range(256))
    for interpreted in (False, True):
        reader, first = nmea0183.SentenceReader(interpreted), 0
        for size in itertools.cycle(sizes):
            reader.feed(bytes(data[first : first + size]))
            first += size
            if first >= len(data):
                break
        reader.finish()
        found, whole = reader.recording(), nmea0183.read(bytes(data))
        assert (found.counts, found.skipped, found.notes) == (whole.counts, whole.skipped, whole.notes)
        assert list(found.sources) == list(whole.sources)
        pairs = zip(found.sources.values(), whole.sources.values(), strict=True)
        assert all(one.to_frame().equals(other.to_frame()) for one, other in pairs)
