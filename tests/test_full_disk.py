"""A disk that is full: every writer says so and leaves nothing under the final name; a run goes on."""

import contextlib
import errno
import io
import json
import logging
import os

import numpy as np
import pytest
from matplotlib.figure import Figure

from steerway.core import OK, Fixes, InputError, complete_or_absent
from steerway.estimation import Profile, estimate
from steerway.formats.testing import endings, write
from steerway.live.testing import FileSink, Row, TableFile
from steerway.report.testing import WRITERS as REPORTS
from steerway.report.testing import summarise, write_report
from steerway.simulation import Unfinished, parse_scenario, sail_scenario
from steerway.simulation.testing import write as write_run
from steerway.simulation.testing import write_campaign
from steerway_studies.testing import Results
from tests.ports import wait_until

resource = pytest.importorskip("resource")
SCENARIO = parse_scenario(
    'duration = 15\n[route]\nat_end = "stop"\nwaypoints = [{ north = 0, east = 0 }, { north = 200, east = 0 }]'
)


@contextlib.contextmanager
def full_after(size: int):
    """Files cannot grow beyond `size` bytes meanwhile."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def refused(folder, size, writing) -> None:
    with full_after(size), pytest.raises(InputError, match=r"cannot write '.*': File too large$"):
        writing()
    assert [path.name for path in folder.rglob("*") if path.is_file()] == []


@pytest.fixture(scope="module")
def track():
    t = np.arange(120.0)
    fixes = Fixes(1.7e9 + t, 0.9 + 3e-7 * t, np.full(120, 0.2))
    return fixes, estimate(fixes, "small-usv")


@pytest.mark.parametrize("ending", endings())
def test_estimates(ending, track, tmp_path):
    if ending == ".mcap":
        pytest.importorskip("mcap", reason="mcap is not installed")
    path = tmp_path / f"track{ending}"
    refused(tmp_path, 100, lambda: write(track[1], path))
    path.write_text("before")
    with full_after(100), pytest.raises(InputError):
        write(track[1], path)
    assert path.read_text() == "before" and [each.name for each in tmp_path.iterdir()] == [path.name]


def test_reports_profiles_and_studies(track, tmp_path):
    pytest.importorskip("bokeh", reason="bokeh is not installed")
    summary = summarise(*track, "small-usv")
    for ending in REPORTS:
        refused(tmp_path, 100, lambda ending=ending: write_report(tmp_path / f"a{ending}", "A track", *track, summary))
    refused(tmp_path, 10, lambda: Profile.named("otter").save(tmp_path / "mine.toml"))
    results = Results("A study", {"number": 1.0}, figures={"shown": (Figure(), "A figure")})
    refused(tmp_path, 10, lambda: results.write(tmp_path))
    with full_after(100), pytest.raises(InputError, match=r"cannot write '.*shown.png': File too large"):
        results.write(tmp_path)
    # What was complete before the disk was full stays.
    assert [path.name for path in tmp_path.iterdir()] == ["results.json"]
    assert json.loads((tmp_path / "results.json").read_text()) == {"number": 1.0}


def test_runs_and_campaigns(tmp_path):
    sailed = sail_scenario(SCENARIO)
    refused(tmp_path, 100, lambda: write_run(sailed, tmp_path / "run", nmea=True))
    refused(tmp_path, 100, lambda: write_campaign([0], [sailed.numbers], tmp_path / "many", "Many"))
    path = tmp_path / "campaign.unfinished"
    kept = Unfinished(path, {})
    with full_after(300), pytest.raises(InputError, match=r"cannot write '.*campaign.unfinished': File too large"):
        kept.add(0, sailed.numbers)
    # What was cut off is not taken for a seed.
    assert Unfinished(path, {}, resume=True).results == {}


def test_links_are_followed_and_devices_written_to(tmp_path):
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "target", tmp_path / "link"
    link.symlink_to(target)
    for text in (b"first", b"second"):
        with complete_or_absent(link) as file:
            file.write(text)
        assert link.is_symlink() and target.read_bytes() == text
    with pytest.raises(InputError, match=r"cannot write '.*': Too many levels of symbolic links"):
        (tmp_path / "circle").symlink_to(tmp_path / "circle")
        with complete_or_absent(tmp_path / "circle"):
            pass
    with complete_or_absent("/dev/null") as file:
        file.write(b"gone")
    assert os.path.exists("/dev/null") and not os.path.isfile("/dev/null")
    with pytest.raises(InputError, match="cannot write '/dev/full': No space left on device"):
        with complete_or_absent("/dev/full") as file:
            file.write(b"none")


NOON = 1_719_835_200.0
ROW = Row(NOON, 0.9, 0.2, 2.0, 1.0, 0.01, 0.1, 0.02, 0.01, 0.3, 0.3, 1.2, OK)


class Disk(io.FileIO):
    """A file on a disk with so many bytes of room."""

    room = 10**9

    def write(self, data):
        if self.room <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        part = super().write(bytes(data[: self.room]))
        self.room -= part
        return part


@pytest.mark.parametrize("whole", [False, True])
def test_whole_messages_are_lost_and_the_log_says_so(whole, tmp_path, caplog):
    """A recording ends at its last whole piece."""
    disk = Disk(tmp_path / "lines", "w")
    sink = FileSink(disk, name="lines", whole=whole)
    with caplog.at_level(logging.WARNING, "steerway.live"):
        disk.room = 25
        for k in range(5):
            sink.send(b"message %d\n" % k)
        wait_until(lambda: "the file ends here, the run goes on" in caplog.text if whole else sink.lost == 3)
        assert (tmp_path / "lines").read_bytes() == b"message 0\nmessage 1\n"
        disk.room = 1000
        sink.send(b"message 5\n")
        sink.close()
    assert (tmp_path / "lines").read_bytes() == b"message 0\nmessage 1\n" + (b"" if whole else b"message 5\n")
    if not whole:
        texts = [record.getMessage() for record in caplog.records]
        assert "No space left on device; what cannot be written is lost, the run goes on" in texts[0]
        assert "can be written again, 3 messages are missing" in texts[1] and len(texts) == 3


def test_a_pipe_without_a_reader_ends_the_run():
    read_end, write_end = os.pipe()
    os.close(read_end)
    sink = FileSink(os.fdopen(write_end, "wb", buffering=0))
    with pytest.raises(BrokenPipeError):
        wait_until(lambda: sink.send(b"a\n"))


def test_where_the_table_cannot_be_written_its_rows_are_kept(tmp_path, caplog):
    table = TableFile(tmp_path / "run.parquet")
    table.fix(ROW)
    (tmp_path / "run.parquet").mkdir()
    table.close()
    assert "its rows are kept in" in caplog.text and (tmp_path / "run.parquet.part").exists()
