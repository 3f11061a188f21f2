import gc
import os
from pathlib import Path

import pytest
from hypothesis import settings

from tests import found_once, overlapping

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


@pytest.fixture(scope="session", autouse=True)
def _found_once(tmp_path_factory):
    """What one test finds, the others take from a file; see `found_once`."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "found"
    folder.mkdir(exist_ok=True)
    with found_once.kept(folder):
        yield


@pytest.fixture
def found_anew():
    """For a test of what is found when the same is asked again."""
    with found_once.anew():
        yield


SLOW = (
    "test_field_studies", "test_recorded_logs", "test_estimator_limits", "test_inference", "test_adaptive_speed_study",
    "test_unseen_logs", "test_mariner_los", "test_otter_path", "test_square_live", "study_", "test_tuning",
)  # fmt: skip
"""Words in the names of tests that take more than half of the time: `-m "not slow"` leaves them out."""


FIRST = (
    "test_estimator_limits", "test_adaptive_speed_study", "test_interval", "test_cybership_study", "test_identify_yaw",
    "test_compass_readings", "test_archive", "test_autopilot", "test_recorded_logs", "test_reference_outputs",
    "test_otter_path", "test_tuning", "test_inference", "test_unseen_logs", "test_field_studies", "test_mariner_los",
)  # fmt: skip
"""Files to begin with: what is begun last is what the other processes wait for. While the first of them compiles the
filter of the course, its smoothers and the inference, those behind it compile what is no part of them; archive and
autopilot find what they share with it."""


def pytest_configure(config):
    if worker := getattr(config, "workerinput", None):
        overlapping.give_way(worker["workerid"], worker["workercount"])


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config):
    return overlapping.processors() + (config.option.dist == "loadfile")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    return overlapping.Overlapping(config, log) if config.option.dist == "loadfile" else None


def pytest_collection_modifyitems(items):
    """Mark the slow tests, and put the files in order."""
    for item in items:
        if any(word in item.nodeid for word in SLOW):
            item.add_marker("slow")
    order = {name: k for k, name in enumerate((*FIRST, *overlapping.WAITING))}
    items.sort(key=lambda item: order.get(item.path.stem, len(order)))


def pytest_collection_finish(session):
    """Do not search what all imports left for garbage again and again: some 4 % of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)
    gc.enable()


def pytest_terminal_summary(terminalreporter):
    """Print what to run for the tests that failed."""
    failed = [each.nodeid for kind in ("failed", "error") for each in terminalreporter.getreports(kind)]
    if failed:
        data = "STEERWAY_DATA=… " if os.environ.get("STEERWAY_DATA") else ""
        shown = " ".join(f"'{nodeid}'" for nodeid in failed[:10])
        terminalreporter.write_line(f"to run again: {data}.venv/bin/python -m pytest {shown}")
