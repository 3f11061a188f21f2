"""What messages mean together: angles from true north, positions with their accuracy. For logs and for the wire."""

import math
from collections import Counter, deque
from typing import Any

from steerway.formats import dilution
from steerway.formats.nmea2000.fields import MAGNETIC, MESSAGES, TRUE

_FIRST_DATE = 946771200.0  # 2000-01-02, a year before the standard was published: earlier ones are of no fix
_LATEST = 1000  # system times that are kept
_FRESH = 3.0  # s for which a dilution of precision holds


class Decoder:
    """Takes the messages of all senders in the order in which they come.

    Attributes:
        variation: rad, + east, the last on the bus; NaN before the first.
        skipped: reason → count of what has no value.
        corrected: (sender, "COG" or "heading") of magnetic angles that were made true.
        late: s by which the network's system time is ahead of the times of receipt.
    """

    def __init__(self) -> None:
        self.variation = math.nan
        self.skipped: Counter[str] = Counter[str]()
        self.corrected: set[tuple[int, str]] = set()
        self.late: deque[float] = deque(maxlen=_LATEST)
        self._accuracy: dict[int, tuple[float, float]] = {}

    def values(self, pgn: int, source: int, raw: tuple[int, ...], received: float) -> dict[str, float]:
        """SI values, by the names of `Fixes`, of a message received at a Unix time; nothing for a position without fix.

        129029 has a `time` of its own. 129025 has the accuracy of the last 129029 of its sender.
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
    """A place in degrees as one in rad."""
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        return {"latitude": math.nan, "longitude": math.nan}
    return {"latitude": math.radians(latitude), "longitude": math.radians(-180.0 if longitude == 180.0 else longitude)}
