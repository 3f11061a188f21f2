"""Tracks in XML. Read: GPX 1.0 and 1.1, Garmin's TCX, KML (gx:Track, and placemarks with time stamps). Written:
GPX 1.0, because 1.1 has no elements for speed and course.

Files are parsed with expat instead of a GPX library: a point takes microseconds, and after damage (a logger that lost
power) reading continues at the next point, where a library rejects the whole file.
Schemas: topografix.com/GPX/1/0 and /1/1; Garmin TrainingCenterDatabase v2; OGC 12-007r2 (KML 2.3).
"""

import re
import xml.parsers.expat
from collections import Counter
from collections.abc import Iterator
from typing import Any, NoReturn
from xml.parsers.expat import XMLParserType

import numpy as np
import polars as pl

from steerway.core.errors import InputError
from steerway.core.records import Fixes, Record
from steerway.core.timestamps import iso, unix_times
from steerway.formats import dilution
from steerway.formats.places import numbers, places
from steerway.formats.recording import Recording, placed

_ROOT = re.compile(rb"<(gpx|TrainingCenterDatabase|kml)[\s>]")
_WHOLE_ROOT = re.compile(rb"<(?:gpx|TrainingCenterDatabase|kml)\b[^<>]*[^/<>]>")
_KINDS = {b"gpx": "GPX", b"TrainingCenterDatabase": "TCX", b"kml": "KML"}
_POINTS = ("trkpt", "Trackpoint", "Placemark")
_POINT = re.compile(rb"<(?:\w+:)?(?:trkpt|Trackpoint|Placemark)[\s>]")
_INSIDE = {"GPX": b"<trk><trkseg>", "TCX": b"<Track>", "KML": b"<Document>"}
_TEXTS = {each: each for each in ("time", "speed", "course", "hdop", "name", "coordinates", "coord")}
_TEXTS |= {"Time": "time", "when": "time", "Speed": "speed", "LatitudeDegrees": "lat", "LongitudeDegrees": "lon"}
"""Elements whose text is read, and the values that they give."""
_CHUNK = 65536  # bytes
_FIRST_CHUNK = 512  # bytes, after damage: more damage may follow soon
_MOST_PARSED = 8  # bytes parsed per byte of the file: after each damaged place the parser restarts at the next point
_PARSED_ANYWAY = 1 << 20
_MMSI = re.compile(r"(?:MMSI\s*)?([0-9]{9})$")

Point = tuple[*tuple[str | None, ...], str]
"""lat, lon, time, speed, course, HDOP, track name, as text."""


def recognises(head: bytes) -> bool:
    """Whether the first bytes contain the root element of a GPX, TCX or KML file."""
    return _ROOT.search(head) is not None


def read(data: bytes) -> Recording:
    """The source "GPX", "TCX" or "KML": all tracks in time order.

    If every track is named by an MMSI, there is a track per vessel. Speed (m/s) and course of points are read, also
    from extensions. Points without a time are left out and counted.
    """
    root, skipped = _ROOT.search(data), Counter[str]()
    kind = _KINDS[root[1]] if root else "GPX"
    points = _points(data, _INSIDE[kind], skipped)
    counts = {"track points": len(points)}
    if not points:
        return Recording(kind, {}, counts, dict(skipped))
    latitudes, longitudes, stamps, speeds, courses, dilutions, track = zip(*points, strict=True)
    place, time = places(numbers(latitudes), numbers(longitudes)), unix_times(stamps)
    vessels = [int(name.group(1)) for name in map(_MMSI.match, track) if name]
    mmsi = np.array(vessels) if len(vessels) == len(track) else None
    sog, cog = numbers(speeds), np.radians(numbers(courses))
    std = np.array([dilution.deviation(each) for each in numbers(dilutions)])
    fixes = Fixes(time, *place, position_std=std, sog=sog, cog=cog, mmsi=mmsi, source=kind)
    return Recording.of(kind, (placed(fixes, skipped),), counts, skipped)


def _points(data: bytes, inside: bytes, skipped: Counter[str]) -> list[Point]:
    """The points of a document; damaged places are counted. inside: the elements around a point, below the root."""
    handler = _Handler()
    declared = (re.search(rb"<\?xml[^>]*\?>", data), _WHOLE_ROOT.search(data))
    openings = [b"".join(part.group() for part in declared if part), b"<gpx>"]
    start = handler.parse(b"", data, 0)
    while start is not None:
        skipped["damaged place"] += 1
        following = _POINT.search(data, start)
        if following is None:
            break
        start = following.start()
        if handler.parsed > _MOST_PARSED * len(data) + _PARSED_ANYWAY:
            skipped["track point after too many damaged places"] += len(_POINT.findall(data, start))
            break
        if not handler.accepts(openings[0]):
            openings.pop(0)
        start = handler.parse(openings[0] + inside, data, start)
    return handler.points


class _Handler:
    """Collects the points of a document that expat parses."""

    def __init__(self) -> None:
        self.points: list[Point] = []
        self.track, self.parsed = "", 0
        self.whens: list[str] = []  # of a gx:Track
        self.coords: list[str] = []

    def accepts(self, opening: bytes) -> bool:
        """Whether `opening` is a well-formed beginning of a document."""
        try:
            parser_for(None).Parse(opening, False)
        except xml.parsers.expat.ExpatError:
            return False
        return bool(opening)

    def parse(self, opening: bytes, data: bytes, start: int) -> int | None:
        """Parse `data` from `start` on. Returns None, or after damage the index from which to search the next point."""
        self.parser = parser_for(self)
        self.point: dict[str, str | None] | None = None
        self.text: list[str] | None = None
        self.path: list[str] = []
        self.last = -1
        try:
            self.parser.Parse(opening, False)
            at, size = start, _FIRST_CHUNK
            while at < len(data):
                self.parsed += size
                self.parser.Parse(data[at : at + size], False)
                at, size = at + size, min(2 * size, _CHUNK)
            self.parser.Parse(b"", True)
        except (xml.parsers.expat.ExpatError, LookupError, ValueError) as error:
            if isinstance(error, InputError):
                raise
            return start + max(self.last - len(opening), 0) + 1
        return None

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.last = self.parser.CurrentByteIndex
        tag = tag.rpartition(":")[2]
        self.path.append(tag)
        if tag in _POINTS:
            self.point = dict[str, str | None](attributes)
        elif tag == "trk":
            self.track = ""
        elif tag == "Track":
            self.whens, self.coords = [], []
        self.text = [] if tag in _TEXTS else None

    def characters(self, text: str) -> None:
        if self.text is not None:
            self.text.append(text)

    def end(self, tag: str) -> None:
        self.last = self.parser.CurrentByteIndex
        tag = self.path.pop()
        if self.text is not None:
            self._take(tag, "".join(self.text).strip())
            self.text = None
        elif tag == "Track" and self.coords:
            for when, place in zip(self.whens, self.coords, strict=False):
                self._add({"time": when, "coordinates": place.replace(" ", ",")})
            self.point = None
        elif tag in _POINTS and self.point is not None:
            if tag != "Placemark" or {"time", "coordinates"} <= self.point.keys():
                self._add(self.point)
            self.point = None

    def _take(self, tag: str, text: str) -> None:
        if tag in ("when", "coord"):
            (self.whens if tag == "when" else self.coords).append(text)
        if self.point is not None:
            self.point.setdefault(_TEXTS[tag], text)
        elif tag == "name" and self.path[-1:] == ["trk"]:
            self.track = text

    def _add(self, point: dict[str, str | None]) -> None:
        if place := point.get("coordinates"):
            point |= zip(("lon", "lat"), place.split(","), strict=False)
        self.points.append((*map(point.get, ("lat", "lon", "time", "speed", "course", "hdop")), self.track))


def parser_for(handler: Any) -> XMLParserType:
    """A parser that calls `start`, `end` and `characters` of a handler, if any, and rejects entities."""
    parser = xml.parsers.expat.ParserCreate()
    parser.buffer_text = True
    parser.EntityDeclHandler = _refuse
    if handler is not None:
        parser.StartElementHandler, parser.EndElementHandler = handler.start, handler.end
        parser.CharacterDataHandler = handler.characters
    return parser


def _refuse(*_: object) -> NoReturn:
    raise InputError("the file declares XML entities, expected none: they are not read")


def text(record: Record) -> str:
    """A GPX 1.0 document with a track per vessel, from the rows of `Fixes` or `Motion` that have a position.

    The name of a vessel's track is its MMSI. Numbers have the fewest digits that read back the same.
    """
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<gpx version="1.0" creator="Steerway" xmlns="http://www.topografix.com/GPX/1/0">',
    ]
    for mmsi, track in record.tracks():
        lines.append("<trk>" if mmsi is None else f"<trk><name>MMSI {mmsi:09d}</name>")
        lines.append("<trkseg>")
        lines.extend(_point_lines(track.to_frame()))
        lines.append("</trkseg></trk>")
    lines.append("</gpx>\n")
    return "\n".join(lines)


def _point_lines(frame: pl.DataFrame) -> Iterator[str]:
    empty = [None] * len(frame)
    columns = [frame[name].to_list() for name in ("time_s", "lat_deg", "lon_deg")]
    columns += [frame[name].to_list() if name in frame.columns else empty for name in ("sog_mps", "cog_deg")]
    for time, latitude, longitude, sog, cog in zip(*columns, strict=True):
        if None in (time, latitude, longitude):
            continue
        speed = "" if sog is None else f"<speed>{sog!r}</speed>"
        course = "" if cog is None else f"<course>{cog!r}</course>"
        stamp = f"<time>{iso(time)}</time>"
        yield f'<trkpt lat="{latitude!r}" lon="{longitude!r}">{stamp}{course}{speed}</trkpt>'
