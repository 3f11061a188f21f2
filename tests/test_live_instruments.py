"""What instruments report over a live link of NMEA 0183, beside the receiver: at any rate, from any talker."""

import math

import pytest

from steerway.formats.testing import SentenceReader, rmc
from steerway.live.testing import rows_of
from tests.sentences import sealed

START = 1_719_835_200.0
PLACE = math.radians(54.0), math.radians(10.0)


def rows(others, seconds=3, per_second=10, settles=False):
    """Rows of a receiver at 1 Hz and of `others(k)`, sentences that come `per_second` times a second."""
    reader, found, now = SentenceReader(), [], 500.0

    def take(settled):
        if reader.holds(settled):
            found.extend(rows_of(reader.take(settled).sources))

    for second in range(seconds):
        reader.feed(rmc(START + second, *PLACE, 1.0, 0.5).encode(), now=now)
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
    reader.feed(rmc(START, *PLACE, 1.0, 0.5).encode(), now=now)
    for k in range(100):
        reader.feed(sealed(f"HEHDT,{k},T"), now=now + 0.1 * k)
    headings = values(rows_of(reader.take().sources), "heading")
    assert len(headings) > 95 and headings[-1][0] == pytest.approx(9.8, abs=0.05)
