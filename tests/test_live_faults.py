"""The fault matrix end to end: the service's reaction to each fault is the one in docs/service.md."""

import math
import re
from functools import cache

import pytest

from tests.faults import measured as running
from tests.faults import stops
from tests.faults.sorties import FAULTS, SPEED
from tests.faults.table import discrete, in_docs, line

SEEN = (
    *("no fix for 15 s", "no fix for 60 s", "jump of 30 m that stays", "position frozen for 20 s"),
    *("every fix 0.3 s late, --latency 0", "status V with a position for 20 s"),
    *("… the first silent for 20 s", "… the same with --source GP --source GN"),
)
"""Faults that show in the outputs; no other fault may show."""
measure = cache(running.measure)


@pytest.fixture(scope="module")
def documented():
    return {discrete(each)[0]: each for each in in_docs()}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_borne_as_the_docs_say(fault, documented):
    found = measure(fault)
    row = line(fault, found)
    assert discrete(row) == discrete(documented[fault.name])
    for measured, written in zip(*(_numbers(each) for each in (row, documented[fault.name])), strict=True):
        assert measured == pytest.approx(written, rel=0.15, abs=0.15)
    assert found.time == pytest.approx(fault.latency - fault.delay, abs=0.15), "output times are the receiver's"
    assert found.silence < 0.11, "rows follow one another without a gap"
    if fault.name not in SEEN:
        assert found.rmc == "A" and found.cog == "always" and found.recovery == 0.0
        assert found.position < 0.5 and found.sog < 0.15 and found.course < math.radians(7.0)


def test_the_docs_name_the_faults_that_are_measured(documented):
    assert list(documented) == [fault.name for fault in FAULTS]


@pytest.mark.parametrize("name", stops.ON_THE_DESK)
def test_when_the_autopilot_stops_is_as_the_docs_say(name):
    written = in_docs(stops.PAGE, stops.BEGIN, stops.END, stops.HEAD)
    rows = {each.split("|")[1].strip(): each for each in written}
    assert list(rows) == [*stops.ON_THE_BENCH, *stops.ON_THE_DESK]
    found = stops.line(name, stops.ON_THE_DESK[name]())
    assert found.split("|")[2] == rows[name].split("|")[2]
    for measured, written in zip(*(_numbers(each, 3) for each in (found, rows[name])), strict=True):
        assert measured == pytest.approx(written, rel=0.15, abs=0.5)


def test_with_the_latency_given_the_present_is_stated():
    stated, unstated = (measure(each) for each in FAULTS if each.name.startswith("every fix 0.3 s late"))
    assert abs(stated.astern) < 0.06, "a tick is 20 ms, 4 cm at 2 m/s"
    assert unstated.astern == pytest.approx(0.3 * SPEED, abs=0.06)
    assert stated.position < 0.5 < unstated.position


def _numbers(row, first=5):
    """The numbers in a line of a table, from cell `first` on."""
    return [float(each) for each in re.findall(r"[\d.]+", "|".join(row.split("|")[first:]))]
