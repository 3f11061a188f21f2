"""Commands that compile nothing: from an empty cache they leave it empty."""

import os
import subprocess
import sys

import pytest

from tests.ais_sentences import sentences, tagged
from tests.canboat_lines import line, position
from tests.command_line import STEERWAY
from tests.gpx_documents import WHOLE
from tests.sentences import sortie
from tests.ubx_frames import pvt

LOGS = {
    "NMEA 0183": sortie(300),
    "UBX": b"".join(pvt(second) for second in range(1, 60)),
    "NMEA 2000": "\n".join(line(k, 129025, 52, position(k, -k)) for k in range(1, 60)).encode(),
    "AIS": b"\n".join(tagged(1565222400 + k, *sentences(mmsi=1, second=k)) for k in range(50)),
    "GPX": WHOLE,
    "CSV": b"time_s,lat_deg,lon_deg,sog_mps\n" + b"".join(b"%d,54.%03d,10,2\n" % (k, k) for k in range(100)),
}


def compiled_by(folder, *command) -> list[str]:
    """The kernels that a process leaves in an empty cache."""
    kept = folder / "kernels"
    done = subprocess.run(
        list(map(str, command)), env=os.environ | {"STEERWAY_CACHE": str(kept)}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return [path.name for path in kept.rglob("*.nb?")]


@pytest.mark.parametrize("kind", LOGS)
def test_info(kind, tmp_path):
    (tmp_path / "log").write_bytes(LOGS[kind])
    assert compiled_by(tmp_path, *STEERWAY, "info", tmp_path / "log") == []


@pytest.mark.parametrize(
    "arguments", [["--help"], ["estimate", "--help"], ["profile", "list"], ["profile", "show", "otter"]]
)
def test_help_and_lists(arguments, tmp_path):
    assert compiled_by(tmp_path, *STEERWAY, *arguments) == []


def test_an_empty_cache_is_seen_to_fill(tmp_path):
    code = "from steerway.core import displacement; displacement(0.0, 0.0, 0.0, 0.0)"
    assert compiled_by(tmp_path, sys.executable, "-c", code)
