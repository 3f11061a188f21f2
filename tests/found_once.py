"""What tests ask for more than once is found once a session: inferences from a record, and cases of studies.

A study is a test of what it says and, with the same seed, a reference output of its numbers.
"""

import hashlib
import io
import os
import pickle
import sys
from contextlib import ExitStack, contextmanager
from functools import wraps
from unittest.mock import patch

FOUND = (
    "steerway.estimation.inference.whole_log infer",
    "steerway.estimation.inference.tune infer",
    "steerway_studies.adaptive_speed.cases run",
    "steerway_studies.mariner_los.figures voyage",
    "steerway_studies.mariner_los.ship voyage",
    "steerway_studies.otter_course.comparisons noisy_numbers",
    "steerway_studies.otter_path.boat leg",
    "steerway_studies.springer_mission.missions paper_mission",
    "steerway_studies.springer_mission.missions real_mission",
    "steerway_studies.springer_mission.missions unseen_mission",
    "steerway_studies.springer_mission.perturbed missions",
)
"""Modules, and functions in them that return the same for equal arguments."""


def kept(folder):
    """Keep results in a folder that the processes of the session share, as a context."""
    return _changed(lambda function: _kept(function, folder))


def anew():
    """Find everything anew, as a context."""
    return _changed(lambda function: getattr(function, "__wrapped__", function))


@contextmanager
def _changed(change):
    with ExitStack() as stack:
        for module, name in map(str.split, FOUND):
            if module := sys.modules.get(module):  # else no test that was collected needs it
                stack.enter_context(patch.object(module, name, change(getattr(module, name))))
        yield


def _kept(function, folder):
    @wraps(function)
    def found(*arguments):
        path = folder / _key(function.__name__, *(each for each in arguments if not callable(each)))
        if path.exists():
            return pickle.loads(path.read_bytes())
        result = function(*arguments)
        unfinished = path.with_suffix(f".{os.getpid()}")
        unfinished.write_bytes(pickle.dumps(result))
        unfinished.replace(path)
        return result

    return found


def _key(*asked):
    packed = io.BytesIO()
    pickler = pickle.Pickler(packed)
    pickler.fast = True  # equal values are packed alike, also where they are not one object
    pickler.dump(asked)
    return hashlib.sha256(packed.getvalue()).hexdigest()
