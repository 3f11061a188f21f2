"""Tracks with times in XML formats other than GPX: Garmin's TCX, and KML's gx:Track and placemarks with time stamps.

Schemas: Garmin TrainingCenterDatabase v2; OGC 12-007r2 (KML 2.3). A damaged file is read up to the damage.
"""

import re
import xml.parsers.expat
from collections import Counter
from collections.abc import Sequence

from steerway.core.records import Fixes
from steerway.core.timestamps import unix_times
from steerway.formats.gpx import parser_for
from steerway.formats.places import numbers, places
from steerway.formats.recording import Recording, placed

_ROOT = re.compile(rb"<(TrainingCenterDatabase|kml)[\s>]")
_TEXTS = {"Time", "LatitudeDegrees", "LongitudeDegrees", "Speed", "when", "coord", "coordinates"}


def recognises(head: bytes) -> bool:
    """Whether the first bytes contain the root element of a TCX or KML file."""
    return _ROOT.search(head) is not None


def read(data: bytes) -> Recording:
    """The source "TCX" or "KML": every point that has a time, in time order, with its speed (m/s) if stated."""
    root = _ROOT.search(data)
    kind = "KML" if root and root[1] == b"kml" else "TCX"
    skipped, points = Counter[str](), _Points()
    try:
        parser_for(points).Parse(data, True)
    except xml.parsers.expat.ExpatError:
        skipped["damaged place"] += 1
    rows = points.found
    counts = {"track points": len(rows)}
    if not rows:
        return Recording(kind, {}, counts, dict(skipped))
    stamps, latitude, longitude, speed = zip(*rows, strict=True)
    time = unix_times(stamps)
    place = places(*(numbers(each) for each in (latitude, longitude)))
    fixes = Fixes(time, *place, sog=numbers(speed), source=kind)
    return Recording.of(kind, (placed(fixes, skipped),), counts, skipped)


class _Points:
    """Collects (time, latitude, longitude, speed) as text from TCX track points, placemarks and gx:Track."""

    def __init__(self) -> None:
        self.found: list[tuple[str | None, ...]] = []
        self._text: list[str] | None = None
        self._values: dict[str, str] = {}
        self._whens: list[str] = []
        self._coords: list[str] = []

    def start(self, tag: str, _: object) -> None:
        tag = tag.rpartition(":")[2]
        if tag in ("Trackpoint", "Placemark"):
            self._values = {}
        elif tag == "Track":
            self._whens, self._coords = [], []
        self._text = [] if tag in _TEXTS else None

    def characters(self, text: str) -> None:
        if self._text is not None:
            self._text.append(text)

    def end(self, tag: str) -> None:
        tag = tag.rpartition(":")[2]
        if self._text is not None:
            text = "".join(self._text).strip()
            self._values.setdefault(tag, text)
            if tag in ("when", "coord"):
                (self._whens if tag == "when" else self._coords).append(text)
            self._text = None
        values = self._values
        if tag == "Trackpoint":
            self.found.append(tuple(map(values.get, ("Time", "LatitudeDegrees", "LongitudeDegrees", "Speed"))))
        elif tag == "Track" and self._coords:
            for when, coord in zip(self._whens, self._coords, strict=False):
                self._place(when, coord.split())
        elif tag == "Placemark" and "when" in values and "coordinates" in values and "coord" not in values:
            self._place(values["when"], values["coordinates"].split(","))

    def _place(self, when: str, parts: Sequence[str]) -> None:
        if len(parts) >= 2:
            self.found.append((when, parts[1], parts[0], None))
