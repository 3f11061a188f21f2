"""What one log held, before anything is chosen: the fixes of each source and an account of every message."""

from dataclasses import dataclass, field

from steerway.core.records import Fixes


@dataclass(frozen=True)
class Recording:
    """What a log said, source by source.

    `sources` maps a name the user can give to `--source` (a talker such as "GP", "src 52", "UBX", "AIS") to its rows
    in time order; a compass without positions is a source too. `counts` tells how many messages of each kind were
    read, `skipped` how many were left out for which reason, `notes` what was corrected (a date, a magnetic heading).
    """

    format: str
    sources: dict[str, Fixes]
    counts: dict[str, int] = field(default_factory=dict)
    skipped: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
