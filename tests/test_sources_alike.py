"""Of several sources, a log and the live service use the same one; instruments can have any rate and talker."""

import math

import numpy as np
import pytest

import steerway
from steerway.formats.testing import SentenceReader, nmea0183
from steerway.formats.testing import rmc as written_rmc
from steerway.live.testing import SourceChoice, rows_of
from tests.sentences import START, gga, rmc, sealed

SECONDS = 90


def bus(seconds=SECONDS):
    """RMC at 1 Hz, a rare compass (HC) from the start, and one at 1 Hz (HE) that begins later."""
    lines = []
    for k in range(seconds):
        lines.append((k, rmc(START + k, 54.0 + 1e-5 * k, 10.0)))
        if k % 2 == 0:
            lines.append((k + 0.2, sealed("HCHDT,20.0,T")))
        if k >= 3:
            lines.append((k + 0.4, sealed("HEHDT,1.0,T")))
    return lines


def read_and_heard(lines, column="heading"):
    """(Fixes of the log of these lines, source of the last heading, or other column, that a live link uses)."""
    lines = sorted(lines, key=lambda each: each[0])
    reader, choice, used = nmea0183.SentenceReader(), SourceChoice(), ""
    for second, line in lines:
        reader.feed(line, received=START + second)
        for row in rows_of(reader.take().sources):
            if row.has_position:
                choice.uses_position(row, row.time)
            if np.isfinite(getattr(row, column)) and choice.uses_aid(column, row, row.time):
                used = row.source
    assert len(reader.recording().sources.get("GP", ())) < 10, "what was taken is not kept"
    return steerway.read(b"".join(line for _, line in lines)), used


def test_the_compass_that_reports_more_often_is_used_and_the_receivers_own_unless_it_is_rare():
    """Rare: at less than half of its fixes, the other one at each."""
    fixes, heard = read_and_heard(bus())
    assert "heading from HE" in fixes.notes and heard == "HE" and fixes.source == "GP"
    np.testing.assert_allclose(np.degrees(fixes.heading[np.isfinite(fixes.heading)]), 1.0)
    fixes, heard = read_and_heard(bus() + [(k + 0.1, sealed("GPHDT,5.0,T")) for k in range(SECONDS)])
    assert not any("heading from" in note for note in fixes.notes) and heard == "GP"
    lines = [each for each in bus(200) if b"HC" not in each[1]]
    fixes, heard = read_and_heard(lines + [(k + 0.1, sealed("GPHDT,5.0,T")) for k in range(0, 200, 5)])
    assert "heading from HE" in fixes.notes and heard == "HE"


def test_a_receiver_without_sog_gets_none_from_another_receiver():
    """Two antennas move differently. Neither a log nor a live link takes SOG from the other one."""
    places = [(START + k, 54.0 + 1e-5 * k, 10.0) for k in range(SECONDS)]
    lines = [(0, rmc(*places[0], talker="GP", status="V")), *((k, gga(*place)) for k, place in enumerate(places))]
    lines += [(k + 0.3, rmc(*place, talker="GN")) for k, place in enumerate(places) if k % 2 == 0]
    fixes, heard = read_and_heard(lines, "sog")
    assert fixes.source == "GP" and np.isnan(fixes.sog).all() and heard == ""


PLACE = math.radians(54.0), math.radians(10.0)


def rows(others, seconds=3, per_second=10, settles=False):
    """Rows of a receiver at 1 Hz and of `others(k)`, sentences that arrive `per_second` times a second; the reader."""
    reader, found, now = SentenceReader(), [], 500.0

    def take(settled):
        if reader.holds(settled):
            found.extend(rows_of(reader.take(settled).sources))

    for second in range(seconds):
        reader.feed(written_rmc(START + second, *PLACE, 1.0, 0.5).encode(), now=now)
        take(False)
        for k in range(per_second):
            now += 0.5 / per_second
            reader.feed(b"".join(others(per_second * second + k)), now=now)
            take(settles)
            now += 0.5 / per_second
    take(True)
    return found, reader


def values(found, name):
    return [(row.time - START, getattr(row, name)) for row in found if math.isfinite(getattr(row, name))]


@pytest.mark.parametrize(("formatter", "settles"), [("HDG", False), ("HDM", True), ("HDT", False)])
def test_a_compass_keeps_its_rate_whatever_the_receivers_is(formatter, settles):
    forms = {"HDG": "HCHDG,{},,,3.0,E", "HDM": "HCHDM,{},M", "HDT": "HEHDT,{},T"}
    found, reader = rows(lambda k: [sealed(forms[formatter].format(k))], settles=settles)
    headings = values(found, "heading")
    assert len(headings) == 30 and not reader.skipped
    times = [time for time, _ in headings]
    assert times == sorted(times) and 2.8 < times[-1] - times[0] < 3.0
    turned = math.degrees(headings[-1][1] - headings[0][1])
    assert turned == pytest.approx(29.0, abs=0.01)
    variation = {"HDG": 3.0, "HDM": 4.2, "HDT": 0.0}[formatter]  # HDM's by the World Magnetic Model
    assert math.degrees(headings[0][1]) == pytest.approx(variation, abs=0.3)
    assert len(values(found, "latitude")) == 3


def test_a_compass_goes_on_where_the_receiver_falls_silent():
    reader, now = SentenceReader(), 500.0
    reader.feed(written_rmc(START, *PLACE, 1.0, 0.5).encode(), now=now)
    for k in range(100):
        reader.feed(sealed(f"HEHDT,{k},T"), now=now + 0.1 * k)
    headings = values(rows_of(reader.take().sources), "heading")
    assert len(headings) > 95 and headings[-1][0] == pytest.approx(9.8, abs=0.05)
