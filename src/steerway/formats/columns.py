"""The meaning of the columns of a table: common spellings of their names, and units in names."""

import re
from dataclasses import dataclass

from steerway.core.earth import KNOT
from steerway.formats.dilution import ALONE, RANGE_ERROR

DEGREE = 0.017453292519943295
EXPECTED = "time_s, lat_deg and lon_deg or common spellings of them (time, timestamp, latitude, lon, …)"

_SPELLINGS = {
    "time": "time timestamp time_stamp datetime date_time basedatetime base_date_time utc time_utc utc_time t ts epoch "
    "unix unix_time unixtime unixtimestamp timestamp_utc datetime_utc date_time_utc utc_datetime msgtime received_at",
    "date": "date date_utc utc_date",
    "latitude": "lat latitude",
    "longitude": "lon lng long longitude",
    "position_std": "position_std hacc h_acc horizontal_accuracy position_accuracy ehpe eph accuracy hdop",
    "sog": "sog speed_over_ground speedoverground ground_speed groundspeed gspeed speed rx_sog gps_sog gnss_sog",
    "cog": "cog course_over_ground courseoverground ground_course course track headmot rx_cog gps_cog gnss_cog",
    "heading": "heading true_heading heading_true trueheading hdt hdg",
    "water_speed": "water_speed stw speed_through_water waterspeed",
    "yaw_rate": "yaw_rate yawrate rate_of_turn rateofturn rot",
    "mmsi": "mmsi",
}
_UNITS = {
    "time": {"s": 1.0, "sec": 1.0, "seconds": 1.0, "unix": None, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    "angle": {"deg": DEGREE, "degrees": DEGREE, "degree": DEGREE, "dd": DEGREE, "rad": 1.0, "radians": 1.0},
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
_FACTORS = dict.fromkeys(_RADII, 0.5**0.5) | {"hdop": float(RANGE_ERROR[ALONE]) * 0.5**0.5}
"""Factors from a radius, and from a dilution of precision, to 1σ of north and of east."""
_UNIT_NAMES = {KNOT: "knots", 1 / 3.6: "km/h", 0.44704: "mph", DEGREE: "degrees", DEGREE / 60: "degrees a minute"}
_PLAIN_UNITS = {"time": "s", "angle": "radians", "speed": "m/s", "rate": "rad/s", "length": "m"}


@dataclass(frozen=True)
class Column:
    """One column understood: its place and name in the file, what it is, and the factor to SI (None: see the data)."""

    index: int
    name: str
    meaning: str
    factor: float | None
    basis: str = ""  # "assumed" where the name states no unit, or how it was inferred

    @property
    def assumed(self) -> bool:
        """Whether the unit is only assumed."""
        return self.basis == "assumed"

    def __str__(self):
        kind = _KINDS.get(self.meaning, "none")
        if self.factor is None or kind in ("none", "time"):
            return f"{self.name} as {self.meaning}"
        unit = "degrees a second" if (kind, self.factor) == ("rate", DEGREE) else _UNIT_NAMES.get(self.factor)
        return (
            f"{self.name} as {self.meaning} in {unit or _PLAIN_UNITS[kind]}{f' ({self.basis})' if self.basis else ''}"
        )


def understood(names) -> dict[str, Column]:
    """The known columns of a table by meaning; of several alike the most common spelling is used."""
    best = {}
    for index, name in enumerate(names):
        meaning, rank, unit = _meaning(name)
        if meaning and (meaning not in best or rank < best[meaning][0]):
            best[meaning] = (rank, index, name, unit)
    is_ais = "mmsi" in best
    if is_ais:
        best.pop("position_std", None)  # what AIS calls accuracy is yes or no
    return {meaning: _column(index, name, meaning, unit, is_ais) for meaning, (_, index, name, unit) in best.items()}


def _column(index, name, meaning, unit, is_ais):
    if unit is not None or _KINDS.get(meaning, "time") == "time":
        return Column(index, name, meaning, unit)
    return Column(index, name, meaning, _default(meaning, name, is_ais), "" if is_ais else "assumed")


def _meaning(name):
    """(meaning, rank of the spelling, factor the name states or None) of a column name; (None, 0, None) if unknown."""
    plain = plain_name(name)
    for meaning, spellings in _SPELLINGS.items():
        units = _UNITS[_KINDS.get(meaning, "none")]
        for rank, spelling in enumerate(spellings.split()):
            if plain == spelling:
                return meaning, rank, _FACTORS.get(spelling)
            if plain.startswith(spelling + "_") and plain[len(spelling) + 1 :] in units:
                factor = units[plain[len(spelling) + 1 :]]
                return meaning, rank, factor and factor * _FACTORS.get(spelling, 1.0)
    return None, 0, None


def plain_name(name):
    """A column name in lower case with its parts joined by underscores: "SOG [m/s]" is sog_m_s."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower().replace("°", " deg ")).strip("_")


def _default(meaning, name, is_ais):
    """The factor of a name that states none: nautical units for nautical terms, SI for others."""
    if meaning in ("sog", "water_speed"):
        return KNOT if is_ais or "speed" not in name.lower() else 1.0
    if meaning == "yaw_rate":
        return DEGREE if "yaw" in name.lower() else DEGREE / 60
    return {"angle": DEGREE, "length": 1.0}.get(_KINDS.get(meaning))
