"""The meaning of a table's columns, from common spellings of their names and units in the names."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from steerway.core.earth import KNOT
from steerway.core.slow_error import USUAL_STD

DEGREE = 0.017453292519943295
SEMICIRCLE = 180.0 / 2**31 * DEGREE
EXPECTED = "time_s, lat_deg and lon_deg or common spellings of them (time, timestamp, latitude, lon, …)"

_SPELLINGS = {
    "time": "header_stamp time timestamp time_stamp datetime date_time basedatetime base_date_time utc time_utc "
    "utc_time t ts epoch unix unix_time unixtime unixtimestamp timestamp_utc datetime_utc date_time_utc utc_datetime "
    "msgtime received_at utc_t lcl_time lcl_t time_unix time_boot",
    "date": "date date_utc utc_date utc_d lcl_date lcl_d",
    "utc_offset": "utc_offset utcofst",
    "fix": "valid fix_valid gps_valid position_valid gps_fix fix_status fix_type fixtype gps_fix_type fix_quality "
    "gps_quality status_status",
    "latitude": "lat latitude latitude_n_s position_lat",
    "longitude": "lon lng long longitude longitude_e_w position_long",
    "north_south": "n_s ns north_south lat_ref latitude_ref lat_dir latitude_dir lat_hemisphere latitude_hemisphere "
    "n_s_indicator ns_indicator",
    "east_west": "e_w ew east_west lon_ref longitude_ref lon_dir longitude_dir lon_hemisphere longitude_hemisphere "
    "e_w_indicator ew_indicator",
    "position_std": "position_std hacc h_acc horizontal_accuracy position_accuracy ehpe eph accuracy hdop",
    "sog": "sog speed_over_ground speedoverground ground_speed groundspeed gspeed speed rx_sog gps_sog gnss_sog "
    "gndspd enhanced_speed vel",
    "cog": "cog course_over_ground courseoverground ground_course course track headmot rx_cog gps_cog gnss_cog trk",
    "heading": "heading true_heading heading_true trueheading hdt hdg",
    "water_speed": "water_speed stw speed_through_water waterspeed",
    "yaw_rate": "yaw_rate yawrate rate_of_turn rateofturn rot",
    "mmsi": "mmsi",
}
_UNITS: dict[str, Mapping[str, float | None]] = {
    "time": {"s": 1.0, "sec": 1.0, "seconds": 1.0, "unix": None, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    | {"msec": 1e-3, "usec": 1e-6, "nsec": 1e-9},
    "angle": {"semicircles": SEMICIRCLE}
    | {"deg": DEGREE, "degrees": DEGREE, "degree": DEGREE, "dd": DEGREE, "rad": 1.0, "radians": 1.0},
    "speed": {"mps": 1.0, "m_s": 1.0, "ms": 1.0, "kn": KNOT, "kt": KNOT, "kts": KNOT, "knot": KNOT, "knots": KNOT}
    | {"kmh": 1 / 3.6, "km_h": 1 / 3.6, "kph": 1 / 3.6, "mph": 0.44704},
    "rate": {"dps": DEGREE, "deg_s": DEGREE, "degps": DEGREE, "deg_per_s": DEGREE}
    | {"dpm": DEGREE / 60, "deg_min": DEGREE / 60, "degpm": DEGREE / 60, "deg_per_min": DEGREE / 60}
    | {"radps": 1.0, "rad_s": 1.0, "rads": 1.0},
    "length": {"m": 1.0, "metres": 1.0, "meters": 1.0, "mm": 1e-3},
    "none": {},
}
_KINDS = {"time": "time", "latitude": "angle", "longitude": "angle", "cog": "angle", "heading": "angle"}
_KINDS |= {"sog": "speed", "water_speed": "speed", "yaw_rate": "rate", "position_std": "length"}
_RADII = ("hacc", "h_acc", "horizontal_accuracy", "position_accuracy", "ehpe", "eph", "accuracy")
_FACTORS = dict.fromkeys(_RADII, 0.5**0.5) | {"hdop": USUAL_STD}
"""Factors that convert a radius, or an HDOP, to 1σ of north and of east (m)."""
_NO_FIX = frozenset(("no fix", "no_fix", "nofix", "none", "invalid", "void", "v", "no", "false", "0"))
_NO_FIX_OF = {"status_status": frozenset(("-1",))} | dict.fromkeys(
    ("fix_type", "fixtype", "gps_fix_type"), _NO_FIX | {"1"}
)
"""Values that mark a row without a fix, by column: NavSatFix has −1; for u-blox and MAVLink, 1 also means no fix."""
_LOGGERS = ({"index", "tag"}, {"index", "rcr"})
"""Columns of track loggers without a compass; their column "heading" is the course."""
_UNIT_NAMES = {KNOT: "knots", 1 / 3.6: "km/h", 0.44704: "mph", DEGREE: "degrees", DEGREE / 60: "degrees a minute"}
_UNIT_NAMES |= {SEMICIRCLE: "semicircles", 1e-7 * DEGREE: "1e-7 degrees"}
_TIME_UNITS = {1.0: "s", 1e-3: "ms", 1e-6: "µs", 1e-9: "ns"}
_PLAIN_UNITS = {"time": "s", "angle": "radians", "speed": "m/s", "rate": "rad/s", "length": "m"}


@dataclass(frozen=True)
class Column:
    """A known column: its index and name in the file, its meaning, and the factor to SI (None: decided by the data)."""

    index: int
    name: str
    meaning: str
    factor: float | None
    basis: str = ""  # "" if the name states the unit, "assumed" for a default, or how it was inferred

    @property
    def to_si(self) -> float:
        """The factor to SI of a column other than a time, 1 if it has none."""
        return 1.0 if self.factor is None else self.factor

    @property
    def assumed(self) -> bool:
        """Whether the unit is only assumed."""
        return self.basis == "assumed"

    def __str__(self) -> str:
        kind = _KINDS.get(self.meaning, "none")
        if kind == "time" and self.basis and self.factor is not None:
            return f"{self.name} as time in {_TIME_UNITS[self.factor]} ({self.basis})"
        if self.factor is None or kind in ("none", "time"):
            return f"{self.name} as {self.meaning}"
        unit = "degrees a second" if (kind, self.factor) == ("rate", DEGREE) else _UNIT_NAMES.get(self.factor)
        return (
            f"{self.name} as {self.meaning} in {unit or _PLAIN_UNITS[kind]}{f' ({self.basis})' if self.basis else ''}"
        )


def understood(names: Iterable[str]) -> dict[str, Column]:
    """The known columns of a table by meaning. If several have one meaning, the most common spelling is used."""
    best = {each.meaning: each for each in reversed(spelled(names))}
    if "mmsi" in best:
        best.pop("position_std", None)  # accuracy in AIS is only high or low
    plain = set(map(plain_name, names))
    if "cog" not in best and "heading" in best and any(each <= plain for each in _LOGGERS):
        best["cog"] = replace(best.pop("heading"), meaning="cog")
    return dict(sorted(best.items(), key=lambda each: each[1].index))


def spelled(names: Iterable[str]) -> list[Column]:
    """Every known column of a table, those with more common spellings first."""
    found = [(_meaning(name), index, name) for index, name in enumerate(names)]
    is_ais = any(meaning == "mmsi" for (meaning, *_), *_ in found)
    known = sorted(found, key=lambda each: (each[0][1], each[1]))
    return [_column(index, name, meaning, unit, is_ais) for (meaning, _, unit), index, name in known if meaning]


def unit_in(meaning: str, text: str) -> float | None:
    """The factor to SI of a unit written beside a number of this meaning; None for an unknown unit."""
    return _UNITS[_KINDS.get(meaning, "none")].get(plain_name(text))


def no_fix(name: str) -> frozenset[str]:
    """The values (lower case) that mark a row without a fix in a column of this name."""
    return _NO_FIX_OF.get(_plain_field(name), _NO_FIX)


def _column(index: int, name: str, meaning: str, unit: float | None, is_ais: bool) -> Column:
    if unit is not None or _KINDS.get(meaning, "time") == "time":
        return Column(index, name, meaning, unit)
    return Column(index, name, meaning, _default(meaning, name, is_ais), "" if is_ais else "assumed")


def _meaning(name: str) -> tuple[str | None, int, float | None]:
    """(meaning, rank of the spelling, factor to SI if the name states one) of a column; (None, 0, None) if unknown."""
    plain = _plain_field(name)
    for meaning, spellings in _SPELLINGS.items():
        units = _UNITS[_KINDS.get(meaning, "none")]
        for rank, spelling in enumerate(spellings.split()):
            if plain == spelling:
                return meaning, rank, _FACTORS.get(spelling)
            if plain.startswith(spelling + "_") and plain[len(spelling) + 1 :] in units:
                factor = units[plain[len(spelling) + 1 :]]
                return meaning, rank, factor and factor * _FACTORS.get(spelling, 1.0)
    return None, 0, None


def _plain_field(name: str) -> str:
    """A name without the prefix of `rostopic echo -p`."""
    return plain_name(name).removeprefix("field_").removeprefix("pose_position_")


def plain_name(name: str) -> str:
    """A column name in lower case with its parts joined by underscores: "SOG [m/s]" is sog_m_s."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower().replace("°", " deg ")).strip("_")


def _default(meaning: str, name: str, is_ais: bool) -> float | None:
    """The assumed factor to SI if a name states no unit: nautical units for nautical terms, else SI or degrees."""
    if meaning in ("sog", "water_speed"):
        return 1.0 if not is_ais and re.search("speed|vel", name.lower()) else KNOT
    if meaning == "yaw_rate":
        return DEGREE if "yaw" in name.lower() else DEGREE / 60
    return {"angle": DEGREE, "length": 1.0}.get(_KINDS.get(meaning, ""))
