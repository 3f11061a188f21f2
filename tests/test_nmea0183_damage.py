"""Damage costs what it touches and nothing else; that no bytes whatever raise is in `test_fuzz`."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from steerway.formats.testing import nmea0183
from tests.sentences import sortie

WHOLE = sortie(60)
LINES = WHOLE.splitlines(keepends=True)
quick = settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def readings_of(data):
    """The sentences of a log as their own bytes."""
    return [data[k : data.index(b"*", k) + 3] for k in nmea0183.sentences(data).offset.tolist()]


def assert_same(one, other):
    assert one.counts == other.counts and one.skipped == other.skipped and one.notes == other.notes
    assert list(one.sources) == list(other.sources)
    for name, fixes in one.sources.items():
        for column, values in fixes.columns().items():
            np.testing.assert_array_equal(values, other.sources[name].columns()[column], err_msg=f"{name} {column}")


@quick
@given(st.lists(st.integers(0, len(WHOLE) - 1), min_size=1, max_size=20), st.randoms(use_true_random=False))
def test_flipped_bits_cost_only_their_own_sentences(places, random):
    damaged = bytearray(WHOLE)
    for place in places:
        damaged[place] ^= 1 << random.randrange(8)
    touched, start = set(), 0
    for k, sound in enumerate(LINES):
        if damaged[start : start + len(sound)] != sound:
            touched.add(k)
        start += len(sound)
    kept = readings_of(bytes(damaged))
    expected = [each[: each.index(b"*") + 3] for k, each in enumerate(LINES) if k not in touched]
    position = 0
    for sentence in expected:  # a subsequence: what flips leave sound may stand between
        position = kept.index(sentence, position) + 1


@quick
@given(st.integers(0, len(WHOLE)), st.integers(0, len(WHOLE)))
def test_a_piece_of_a_log_is_read_as_far_as_it_goes(first, last):
    first, last = sorted((first, last))
    whole = [(k, WHOLE.index(b"*", k) + 3) for k in nmea0183.sentences(WHOLE).offset.tolist()]
    expected = [WHOLE[a:b] for a, b in whole if first <= a and b <= last]
    assert readings_of(WHOLE[first:last]) == expected


@quick
@given(st.lists(st.integers(1, 400), min_size=1, max_size=30))
def test_pieces_of_any_size_say_the_same(sizes):
    data = b"2024-07-01T12:00:00.5Z ".join(LINES[:100]) + b"\x00$\xb5b$GP" + b"".join(LINES[100:])
    reader, first = nmea0183.SentenceReader(), 0
    for k in range(len(data)):
        if first >= len(data):
            break
        size = sizes[k % len(sizes)]
        reader.feed(data[first : first + size])
        first += size
    reader.finish()
    assert_same(reader.recording(), nmea0183.read(data))


def test_binary_messages_between_sentences():
    rng = np.random.default_rng(7)
    noise = [b"\xb5b" + rng.bytes(90) for _ in LINES]
    mixed = b"".join(map(bytes.__add__, noise, LINES))
    assert readings_of(mixed) == readings_of(WHOLE)
