"""The contents of one log before a source is chosen: the fixes of each source and a count of every message."""

from dataclasses import dataclass, field

import numpy as np

from steerway.core.records import Fixes


@dataclass(frozen=True)
class Recording:
    """The contents of a log by source.

    `sources` maps a name the user can give to `--source` (a talker such as "GP", "src 52", "UBX", "AIS") to its rows
    in time order; a compass without positions is a source too. `counts` has the number of messages read
    of each kind, `skipped` the number left out for each reason, `notes` the corrections (a date, a magnetic heading).
    `formatters` (n,) of a source, in NMEA 0183: bits of the formatters that gave each row's position.
    """

    format: str
    sources: dict[str, Fixes]
    counts: dict[str, int] = field(default_factory=dict)
    skipped: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    formatters: dict[str, np.ndarray] = field(default_factory=dict)
