"""Faults of inputs, files, disks and processes: service, autopilot and commands react as the docs say."""

import math
import re
from pathlib import Path

import pytest

from tests.faults import commands, service, stops
from tests.faults.sorties import FAULTS, SPEED
from tests.faults.table import cells

SEEN = (
    *("no fix for 15 s", "no fix for 60 s", "jump of 30 m that stays", "position frozen for 20 s"),
    *("every fix 0.3 s late, --latency 0", "status V with a position for 20 s"),
    *("… the first silent for 20 s", "… the same with --source GP --source GN"),
)
"""Faults that show in the outputs; no other fault may show."""
QUICK = (
    *("a ROS 2 bag with an endless query for messages", "a damaged Parquet file", "standard output is full"),
    *("the disk is full: a table", "the output is the input"),
    "SIGKILL of a campaign on all cores",
)
"""Commands that take no more than a few seconds."""


@pytest.mark.parametrize("module", [service, commands, stops], ids=lambda module: module.__name__)
def test_the_docs_name_the_faults_that_are_measured(module):
    assert list(module.TABLE.cells()) == list(module.FAULTS)


def assert_written(module, name, words, tolerance):
    """Measure a fault: the first cells of its line are those of the docs, the numbers in the others close to them."""
    found = module.measured(name)
    row, written = cells(module.line(name, found)), module.TABLE.cells()[name]
    assert row[:words] == written[:words]
    for one, other in zip(*(re.findall(r"[\d.]+", "|".join(each[words:])) for each in (row, written)), strict=True):
        assert float(one) == pytest.approx(float(other), rel=0.15, abs=tolerance)
    return found


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_borne_as_the_docs_say(name):
    found, fault = assert_written(service, name, 4, 0.15), FAULTS[name]
    assert found.time == pytest.approx(fault.latency - fault.delay, abs=0.15), "output times are the receiver's"
    assert found.silence < 0.11, "rows follow one another without a gap"
    if name not in SEEN:
        assert found.rmc == "A" and found.cog == "always" and found.recovery == 0.0
        assert found.position < 0.5 and found.sog < 0.15 and found.course < math.radians(7.0)


def test_with_the_latency_given_the_present_is_stated():
    stated, unstated = (service.measured(f"every fix 0.3 s late, --latency {latency}") for latency in ("0.3", "0"))
    assert abs(stated.astern) < 0.06, "a tick is 20 ms, 4 cm at 2 m/s"
    assert unstated.astern == pytest.approx(0.3 * SPEED, abs=0.06)
    assert stated.position < 0.5 < unstated.position


@pytest.mark.parametrize("name", stops.ON_THE_DESK)
def test_when_the_autopilot_stops_is_as_the_docs_say(name):
    assert_written(stops, name, 2, 0.5)


@pytest.mark.parametrize("name", QUICK)
def test_a_command_ends_as_the_docs_say(name):
    found = commands.measured(name)
    assert cells(commands.line(name, found))[:4] == commands.TABLE.cells(4)[name]
    assert found.seconds < 30.0 and 50.0 < found.memory < 1000.0


@pytest.mark.parametrize("document", ["SECURITY.md", "docs/faults.md"])
def test_the_tests_that_a_document_names_are_there(document):
    root = Path(__file__).parents[1]
    text = (root / document).read_text(encoding="utf-8")
    named = re.findall(r"(tests/test_\w+\.py)(?:::(\w+))?", text)
    assert len(named) > 5
    named += [("tests/test_live_helm.py", name) for name in re.findall(r"`(test_\w+)`", text)]
    for file, name in named:
        assert f"def {name or 'test_'}" in (root / file).read_text(encoding="utf-8"), f"{file}::{name}"
    for file, word in re.findall(r"(tests/[\w/]+\.py) -k (\w+)", text):
        assert re.search(rf"def test_\w*{word}", (root / file).read_text(encoding="utf-8")), f"{file} -k {word}"
