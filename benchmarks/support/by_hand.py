"""The filter's arithmetic in C, compiled for this machine if it has a compiler."""

import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.support.ours import MODEL
from benchmarks.support.record import Record

FLAGS = ("-O3", "-march=native")
_OF_MODE = "speed_noise", "speed_decay", "rate_noise", "rate_decay", "drift_speed", "start_rate"
_NUMBERS = np.array(
    [*(MODEL.modes[name][0] for name in _OF_MODE), *MODEL.receiver[["fix_variance", "outlier_rate"]][0]]
)
"""Numbers of the model, in the order of the enum in `five_state.c`."""
_SOURCE = Path(__file__).with_name("five_state.c")
_SAID = 10


class Library:
    """The compiled C code; `available()`: whether there is a compiler."""

    @staticmethod
    def available() -> bool:
        return shutil.which("gcc") is not None

    def __init__(self):
        self._folder = tempfile.TemporaryDirectory()
        path = Path(self._folder.name) / "five_state.so"
        subprocess.run(["gcc", *FLAGS, "-shared", "-fPIC", "-o", path, _SOURCE, "-lm"], check=True)
        self._run = ctypes.CDLL(str(path)).five_state_tracks
        self._run.restype = None
        self._run.argtypes = [ctypes.c_size_t] + 6 * [ctypes.c_void_p]

    def tracks(self, bounds, time, north, east, output=None) -> np.ndarray:
        """(n, 10) with the columns of `ours.whole_record`, for tracks one after another."""
        output = np.empty((len(time), _SAID)) if output is None else output
        arrays = [np.ascontiguousarray(bounds, np.int64), time, north, east, _NUMBERS, output]
        self._run(len(bounds) - 1, *[each.ctypes.data for each in arrays])
        return output

    def whole_record(self, record: Record) -> np.ndarray:
        """(n, 10) with the columns of `ours.whole_record`."""
        return self.tracks([0, len(record)], record.time, record.north, record.east)
