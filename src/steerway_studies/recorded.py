"""Where studies find recorded logs, which are no part of the package: the folder `data` of STEERWAY_DATA."""

import os
from pathlib import Path

from steerway.core import InputError


def logs_folder() -> Path:
    """The folder of recorded logs. Raises InputError where there is none."""
    named = os.environ.get("STEERWAY_DATA", "")
    folder = Path(named) / "data"
    if not named or not folder.is_dir():
        raise InputError(f"STEERWAY_DATA is {named!r}, expected a folder with recorded logs in its subfolder data")
    return folder
