"""The logs of the study: public logs by repository and path, and logs in the folder STEERWAY_DATA."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

DEVELOP, REPORT = "develop", "report"
"""The halves: logs that may be used for tuning, and logs that are used for judging only."""


@dataclass(frozen=True)
class PublicLog:
    """A log in a public repository.

    `minutes` of the log are used, None for all. `independent`: the reference is another instrument than the receiver.
    `lasting` (m/s): 1σ of known errors of the reference that last over several rows, along and across the course.
    """

    name: str
    half: str
    repository: str
    path: str
    commit: str
    licence: str
    boat: str
    receiver: str
    reference: str
    remark: str = ""
    minutes: tuple[float, float] | None = None
    independent: bool = False
    lasting: float = 0.0


@dataclass(frozen=True)
class KnownLog:
    """A log in the folder `data` of STEERWAY_DATA. All were used in development, so all are in the develop half.

    `truth` is the log of a better instrument aboard, empty if the receiver's own velocity is the reference. `turns` is
    a table with the yaw rate of a gyro in deg/s, in the column `RATE_COLUMN`.
    """

    path: str
    boat: str
    receiver: str
    reference: str
    source: str | None = None
    truth: str = ""
    turns: str = ""
    half: str = DEVELOP

    @property
    def name(self) -> str:
        """The stem of the file, in lower case with hyphens."""
        return Path(self.path).name.removesuffix("-2014-08-01").split(".")[0].replace("_", "-").lower()


RATE_COLUMN = "p9_rot_dps_1s"
_OWN = "the receiver's own SOG and COG"
_INERTIAL = "palmer_seapath_truth/NBP1406_s330-2014-08-01"
_TURNS = "furuno_scx20_n2k/derived/furuno-130842-{}_scx20.csv"
KNOWN = (
    KnownLog(
        "furuno_scx20_n2k/furuno-130842-figure8-fast.raw",
        "motor boat, figures of eight",
        "Furuno SCX-20, 5 Hz",
        f"{_OWN}; yaw rate of a compass, mean of 1 s",
        source="src 52",
        turns=_TURNS.format("figure8-fast"),
    ),
    KnownLog(
        "furuno_scx20_n2k/furuno-130842-wide-turn.raw",
        "motor boat, a wide turn",
        "Furuno SCX-20, 5 Hz",
        f"{_OWN}; yaw rate of a compass, mean of 1 s",
        source="src 52",
        turns=_TURNS.format("wide-turn"),
    ),
    *(
        KnownLog(
            f"palmer_seapath_truth/NBP1406_{name}-2014-08-01",
            "research ship in swell",
            receiver,
            "its inertial system, Seapath 330",
            truth=_INERTIAL,
        )
        for name, receiver in (
            ("s330", "Seapath 330, 1 Hz"),
            ("seap", "Seapath 200, 1 Hz"),
            ("gp02", "second GPS, 1 Hz"),
        )
    ),
    KnownLog("rob_atlantic_1hz/gx_to_gavres.nmea", "sailing boat, Brittany", "u-blox, 1 Hz", _OWN),
    KnownLog("rob_atlantic_1hz/kernevel_latrinite.nmea", "sailing boat in a seaway", "u-blox, 1 Hz", _OWN),
    KnownLog("rob_atlantic_1hz/nukuhiva_multitalker.nmea", "sailing boat, Pacific", "u-blox among others, 1 Hz", _OWN),
    KnownLog("rob_atlantic_1hz/tomales_kayak.nmea", "kayak", "u-blox, 1 Hz", _OWN),
    KnownLog("anemomind_corrupt/psaros33_20140627_gaps_dups.nmea", "sailing yacht", "instrument bus, 1 Hz", _OWN),
    KnownLog("anemomind_corrupt/irene_flensburg_20130802_corrupt.nmea", "sailing yacht", "instrument bus, 1 Hz", _OWN),
    KnownLog("signalk_samples/plaka.log", "sailing yacht", "plotter, 0.5 Hz", _OWN),
)


def public_logs() -> tuple[PublicLog, ...]:
    """Every public log, by name."""
    entries = tomllib.loads((Path(__file__).parent / "catalogue.toml").read_text(encoding="utf-8"))["log"]
    return tuple(PublicLog(**entry | {"minutes": tuple(entry.get("minutes", ())) or None}) for entry in entries)
