"""Faults of files, disks and processes: those of the docs, and the quick ones end as the docs say."""

import re
from pathlib import Path

import pytest

from tests.faults.commands import FAULTS, in_docs, line, tried

QUICK = (
    "a bag of ROS 2",
    "a damaged Parquet",
    "standard output is full",
    "the disk is full: a table",
    "the output is the",
)


def cells(row):
    """Without time and memory."""
    return tuple(cell.strip() for cell in row.strip("|").split(" | ")[:-2])


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


def test_the_docs_name_the_faults_that_are_tried():
    assert [cells(row)[0] for row in in_docs()] == [fault.name for fault in FAULTS]


@pytest.mark.parametrize("fault", [each for each in FAULTS if each.name.startswith(QUICK)], ids=lambda each: each.name)
def test_a_fault_ends_as_the_docs_say(fault):
    found = tried(fault)
    assert cells(line(fault, found)) in [cells(row) for row in in_docs()]
    assert found.seconds < 30.0 and 50.0 < found.memory < 1000.0
