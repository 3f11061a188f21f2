"""A full disk neither ends nor falsifies a run."""

import logging
import os
import time

import pytest

from steerway.core import OK
from steerway.live.testing import FileSink, Row, TableFile
from tests.disk import Disk

NOON = 1_719_835_200.0
ROW = Row(NOON, 0.9, 0.2, 2.0, 1.0, 0.01, 0.1, 0.02, 0.01, 0.3, 0.3, 1.2, OK)


def until(condition):
    """Until the thread that writes came so far."""
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < 5.0
        time.sleep(0.001)


def test_whole_messages_are_lost_and_the_log_says_so(tmp_path, caplog):
    disk = Disk(tmp_path / "lines", "w")
    sink = FileSink(disk, name="lines")
    with caplog.at_level(logging.WARNING, "steerway.live"):
        disk.room = 25
        for k in range(5):
            sink.send(b"message %d\n" % k)
        until(lambda: sink.lost == 3)
        assert (tmp_path / "lines").read_bytes() == b"message 0\nmessage 1\n"
        disk.room = 1000
        sink.send(b"message 5\n")
        sink.close()
    assert (tmp_path / "lines").read_bytes() == b"message 0\nmessage 1\nmessage 5\n"
    texts = [record.getMessage() for record in caplog.records]
    assert "No space left on device; what cannot be written is lost, the run goes on" in texts[0]
    assert "can be written again, 3 messages are missing" in texts[1] and len(texts) == 3


def test_a_recording_ends_at_its_last_whole_piece(tmp_path, caplog):
    disk = Disk(tmp_path / "pieces", "w")
    sink = FileSink(disk, name="pieces", whole=True)
    disk.room = 25
    for k in range(5):
        sink.send(b"message %d\n" % k)
    until(lambda: "the file ends here, the run goes on" in caplog.text)
    disk.room = 1000
    sink.send(b"message 5\n")
    sink.close()
    assert (tmp_path / "pieces").read_bytes() == b"message 0\nmessage 1\n"


def test_a_pipe_without_a_reader_ends_the_run():
    read_end, write_end = os.pipe()
    os.close(read_end)
    sink = FileSink(os.fdopen(write_end, "wb", buffering=0))
    with pytest.raises(BrokenPipeError):
        until(lambda: sink.send(b"a\n"))


def test_where_the_table_cannot_be_written_its_rows_are_kept(tmp_path, caplog):
    table = TableFile(tmp_path / "run.parquet")
    table.fix(ROW)
    (tmp_path / "run.parquet").mkdir()
    table.close()
    assert "its rows are kept in" in caplog.text and (tmp_path / "run.parquet.part").exists()
