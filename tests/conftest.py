import gc
import os
import sys
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import settings

gc.disable()  # until all is imported and collected: a quarter of that time

# How long an example takes depends on what numba compiles first and on what else the machine does.
settings.register_profile("steerway", deadline=None)
settings.load_profile("steerway")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of recorded logs and reference numbers that STEERWAY_DATA names."""
    folder = os.environ.get("STEERWAY_DATA")
    if not folder:
        pytest.skip("STEERWAY_DATA is not set: no recorded logs and reference numbers on this machine")
    return Path(folder)


@pytest.fixture(autouse=True)
def _docked():
    """Boats on a desk are docked at the end of a test."""
    yield
    if desk := sys.modules.get("tests.desk"):
        desk.dock_all()


def pytest_collection_finish(session):
    """Do not search what all imports left for garbage again and again: some 4 % of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
    gc.enable()


def pytest_terminal_summary(terminalreporter):
    """Print the ten slowest files."""
    spent = Counter()
    for report in (each for reports in terminalreporter.stats.values() for each in reports):
        if hasattr(report, "duration"):
            spent[report.nodeid.partition("::")[0]] += report.duration
    slowest = ", ".join(f"{Path(file).stem} {seconds:.0f} s" for file, seconds in spent.most_common(10))
    terminalreporter.write_line(f"slowest files: {slowest}")
