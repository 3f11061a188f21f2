"""NMEA 0183: one incremental reader for files and for live links."""

from steerway.formats.nmea0183.reader import SentenceReader, Sentences, read, recognises, sentences

__all__ = ["SentenceReader", "Sentences", "read", "recognises", "sentences"]
