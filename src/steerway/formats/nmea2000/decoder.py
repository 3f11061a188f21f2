"""Combine NMEA 2000 messages, from logs or live: true angles from the variation, positions with their accuracy."""

import math
from collections import Counter, deque
from typing import Any

from steerway.formats import dilution
from steerway.formats.nmea2000.fields import MAGNETIC, MESSAGES, TRUE

_FIRST_DATE = 946771200.0  # Unix s, 2000-01-02: receivers without a fix send earlier dates
_LATEST = 1000  # number of system times in memory
_FRESH = 3.0  # s for which a dilution of precision is valid


class Decoder:
    """Decodes the messages of all senders in order of arrival.

    Attributes:
        variation: last magnetic variation on the bus, rad, east positive; NaN before the first.
        skipped: number of values that could not be used, by reason.
        corrected: (sender, "COG" or "heading") of magnetic angles that were made true.
        late: differences (s) of the network's system time and the receive time, for the last messages.
    """

    def __init__(self) -> None:
        self.variation = math.nan
        self.skipped: Counter[str] = Counter[str]()
        self.corrected: set[tuple[int, str]] = set()
        self.late: deque[float] = deque(maxlen=_LATEST)
        self._accuracy: dict[int, tuple[float, float]] = {}

    def values(self, pgn: int, source: int, raw: tuple[int, ...], received: float) -> dict[str, float]:
        """SI values of a message, by field of `Fixes`; empty for a position without fix. received: Unix s.

        129029 also gives `time`. 129025 gets the accuracy of its sender's last 129029.
        """
        values: dict[str, Any] = MESSAGES[pgn].values(raw)  # some of them whole numbers
        if pgn == 127258:
            self.variation = self.variation if math.isnan(values["variation"]) else values["variation"]
            return {}
        if pgn == 126992:
            if values["days"] + values["clock"] >= _FIRST_DATE:
                self.late.append(values["days"] + values["clock"] - received)
            return {}
        if pgn == 127250:
            return {"heading": self._heading(source, **values)}
        if pgn == 129026:
            cog = self._true((source, "COG"), values["cog"], values["reference"], self.variation)
            return {"sog": values["sog"], "cog": cog}
        if pgn == 129029:
            return self._gnss(source, received, **values)
        if pgn == 129025:
            since, std = self._accuracy.get(source, (-math.inf, math.nan))
            return _placed(**values) | {"position_std": std if 0.0 <= received - since < _FRESH else math.nan}
        return values

    def _heading(self, source: int, heading: float, deviation: float, variation: float, reference: int) -> float:
        if reference & 3 == MAGNETIC and math.isfinite(deviation):
            heading += deviation
        known = variation if math.isfinite(variation) else self.variation
        return self._true((source, "heading"), heading, reference, known)

    def _true(self, which: tuple[int, str], angle: float, reference: int, variation: float) -> float:
        if reference & 3 == TRUE or math.isnan(angle):
            return angle
        if reference & 3 != MAGNETIC:
            return math.nan
        if math.isnan(variation):
            self.skipped["magnetic angle without variation"] += 1
        else:
            self.corrected.add(which)
        return angle + variation

    def _gnss(
        self,
        source: int,
        received: float,
        days: float,
        clock: float,
        latitude: float,
        longitude: float,
        method: int,
        hdop: float,
    ) -> dict[str, float]:
        time = days + clock
        if not 1 <= method <= 5 or not time >= _FIRST_DATE:
            return {}
        std = dilution.deviation(hdop, method)
        self._accuracy[source] = received, std
        return _placed(latitude, longitude) | {"time": time, "position_std": std}


def _placed(latitude: float, longitude: float) -> dict[str, float]:
    """Latitude and longitude in rad, from degrees; NaN if out of range."""
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        return {"latitude": math.nan, "longitude": math.nan}
    return {"latitude": math.radians(latitude), "longitude": math.radians(-180.0 if longitude == 180.0 else longitude)}
