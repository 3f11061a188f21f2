"""MAVLink 2 signing: the key, and what of the vehicle is accepted.

The key is the SHA-256 of a passphrase, as ground stations make it, or 64 hexadecimal digits.
Source: mavlink.io, guide "Message signing".
"""

import hashlib
import re
import time

from steerway.core.errors import InputError
from steerway.live.base.uri import secret_in

_EPOCH = 1_420_070_400.0  # Unix time of 2015-01-01, from which signatures count
_TICK = 1e-5  # s
_SHORTEST = 8


def key_of(path: str) -> bytes:
    """The key in a file. Raises InputError, which does not repeat it."""
    text = secret_in(path, "signing key")
    if re.fullmatch(r"[0-9A-Fa-f]{64}", text):
        return bytes.fromhex(text)
    if len(text) < _SHORTEST:
        raise InputError(f"signing key {path} has {len(text)} characters, expected at least {_SHORTEST}")
    return hashlib.sha256(text.encode()).digest()


def sign(codec, key: bytes, link: int = 0) -> None:
    """Sign what a codec sends, and accept only what is signed with the same key."""
    codec.signing.secret_key = key
    codec.signing.sign_outgoing = True
    codec.signing.link_id = link
    codec.signing.timestamp = int((time.time() - _EPOCH) / _TICK)
