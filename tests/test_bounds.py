"""No index is unchecked: public names with hostile arguments, where NumPy checks every index of every kernel.

The long form is `make bounds`; `make bounds-all` has checks in the compiled kernels too.
"""

import json
import os
import subprocess
import sys

CALLED = 200
"""Least number of public functions, classes and methods."""


def test_public_names_with_hostile_arguments():
    command = [sys.executable, "-m", "tests.hostile_arguments", "--rounds", "5"]
    done = subprocess.run(command, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True)
    found = json.loads(done.stdout)
    assert found["findings"] == {}
    assert found["names"] > CALLED and done.returncode == 0
