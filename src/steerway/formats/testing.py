"""Names for this package's tests; not part of the public API."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.formats import ais, ais_tables, gpx, mcap, nmea0183, nmea2000, ros2, table, ubx
    from steerway.formats import writing as formats_writing
    from steerway.formats.ais import class_b
    from steerway.formats.dilution import deviation
    from steerway.formats.nmea0183 import SentenceReader, fields
    from steerway.formats.nmea0183.epochs import ROLLOVER
    from steerway.formats.nmea0183.writing import apb, gga, hdt, rmb, rmc, rot, sealed, vtg, xte
    from steerway.formats.nmea2000.fields import MESSAGES
    from steerway.formats.nmea2000.frames import Frame, Joiner, Splitter, frame_of, identifier_of
    from steerway.formats.nmea2000.text import frame_of_line
    from steerway.formats.packed import MAX_SIZE
    from steerway.formats.reading import read, survey
    from steerway.formats.results import read_tracks
    from steerway.formats.writing import endings, write

__getattr__, __dir__ = on_demand(__name__)
