"""Of several sources a log and the live service use the same."""

import numpy as np
import pytest

import steerway
from steerway.formats.testing import nmea0183
from steerway.live.testing import SourceChoice, rows_of
from tests.sentences import START, rmc, sealed

SECONDS = 90


def bus(*, coarse_every=2, fine_from=3):
    """RMC at 1 Hz, a compass of whole 20 degrees from the start, and a better one at 1 Hz that comes later."""
    lines = []
    for k in range(SECONDS):
        lines.append((k, rmc(START + k, 54.0 + 1e-5 * k, 10.0)))
        if k % coarse_every == 0:
            lines.append((k + 0.2, sealed("HCHDT,20.0,T")))
        if k >= fine_from:
            lines.append((k + 0.4, sealed("HEHDT,1.0,T")))
    return lines


def heading_source_live(lines):
    """The source of the last heading that is used."""
    reader, choice, used = nmea0183.SentenceReader(), SourceChoice(), ""
    for second, line in lines:
        reader.feed(line, received=START + second)
        for row in rows_of(reader.take().sources):
            if row.has_position:
                choice.uses_position(row, row.time)
            if np.isfinite(row.heading) and choice.uses_aid("heading", row, row.time):
                used = row.source
    return used


@pytest.mark.parametrize(("coarse_every", "source"), [(2, "HE"), (4, "HE")])
def test_the_compass_that_reports_more_often_is_used(coarse_every, source):
    lines = bus(coarse_every=coarse_every)
    fixes = steerway.read(b"".join(line for _, line in lines))
    assert f"heading from {source}" in fixes.notes
    assert heading_source_live(lines) == source


def test_a_compass_of_the_receiver_itself_is_preferred():
    lines = [each for k, each in enumerate(bus())]
    lines += [(k + 0.1, sealed("GPHDT,5.0,T")) for k in range(SECONDS)]
    lines.sort(key=lambda each: each[0])
    fixes = steerway.read(b"".join(line for _, line in lines))
    assert not any("heading from" in note for note in fixes.notes)
    assert heading_source_live(lines) == "GP"
