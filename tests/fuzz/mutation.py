"""Mutations of any bytes, and of numbers and words in text."""

import random
import re

_NUMBERS = (
    b"0", b"-1", b"-0.0", b"1e999", b"-1e999", b"nan", b"inf", b"1e-320", b"9" * 400, b"4294967296", b"-2147483649",
    b"1.7976931348623157e308", b"90.0000001", b"-180.0000001", b"2000-02-30T25:61:61Z", b"true", b"null",
)  # fmt: skip
_PIECES = (
    b"", b"\0", b"\n", b"\r\n", b"$", b"!", b"*", b",", b'"', b"\\", b"{", b"}", b"[", b"]", b"<", b">", b"&#0;",
    b"\xff\xff\xff\xff", b"\xb5\x62", b"\xfd", b"\xfe", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"[" * 3000, b'{"a":' * 3000,
)  # fmt: skip
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:e-?\d+)?")
_WORD = re.compile(rb"[A-Za-z_]{2,}")
LONGEST = 20_000


def mutated(data: bytes, others: list[bytes], rng: random.Random) -> bytes:
    """`data` after a few mutations, some of which insert pieces of `others`."""
    for _ in range(rng.choice((1, 1, 2, 3, 5, 8))):
        data = rng.choice(_KINDS)(data, others, rng)
    return data[:LONGEST]


def absurd(text: bytes) -> list[bytes]:
    """The text with each of its numbers in turn beyond all range, or none."""
    wrong = (b"1e300", b"-1e38", b"NaN", b"-Infinity", b"1" + b"0" * 400)
    return [text[: each.start()] + number + text[each.end() :] for each in _NUMBER.finditer(text) for number in wrong]


def _span(data, rng, longest=64):
    first = rng.randrange(len(data) + 1)
    return first, min(first + rng.randrange(1, longest), len(data))


def _bytes(data, others, rng):
    changed = bytearray(data)
    for _ in range(rng.randrange(1, 5) if changed else 0):
        at = rng.randrange(len(changed))
        changed[at] = rng.choice((rng.randrange(256), changed[at] ^ 1 << rng.randrange(8), 0, 255, 127, 128))
    return bytes(changed)


def _remove(data, others, rng):
    first, last = _span(data, rng, rng.choice((4, 64, 4096)))
    return data[:first] + data[last:]


def _repeat(data, others, rng):
    first, last = _span(data, rng)
    return data[:last] + data[first:last] * rng.choice((1, 2, 50)) + data[last:]


def _insert(data, others, rng):
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice(_PIECES) + data[at:]


def _cut(data, others, rng):
    return data[: rng.randrange(len(data) + 1)]


def _splice(data, others, rng):
    other = rng.choice(others)
    first, last = _span(other, rng, 2000)
    at, behind = _span(data, rng)
    return data[:at] + other[first:last] + data[rng.choice((at, behind)) :]


def _swap_lines(data, others, rng):
    lines = data.split(b"\n")
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _number(data, others, rng):
    return _exchanged(_NUMBER, data, rng, lambda found: rng.choice(_NUMBERS))


def _word(data, others, rng):
    words = _WORD.findall(rng.choice(others)) or [b"x"]
    return _exchanged(_WORD, data, rng, lambda found: rng.choice((rng.choice(words), found.upper(), found + b"_", b"")))


def _exchanged(pattern, data, rng, by):
    found = list(pattern.finditer(data))
    if not found:
        return data
    match = rng.choice(found)
    return data[: match.start()] + by(match[0]) + data[match.end() :]


_KINDS = (_bytes, _bytes, _remove, _repeat, _insert, _cut, _splice, _swap_lines, _number, _number, _word)
