import os
from pathlib import Path

import pytest
from hypothesis import settings

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
