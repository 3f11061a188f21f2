"""What is inferred from a record is kept for the session: several tests ask for the same, and it takes seconds."""

import hashlib
import os
import pickle
from contextlib import ExitStack, contextmanager
from functools import wraps
from unittest.mock import patch

from steerway.estimation.inference import tune, whole_log

INFERRING = ((whole_log, "infer"), (tune, "infer"), (tune, "_thorough"))


def kept(folder):
    """Keep results in a folder that the processes of the session share, as a context."""
    return _changed(lambda function: _kept(function, folder))


def anew():
    """Infer in any case, as a context."""
    return _changed(lambda function: function.__wrapped__)


@contextmanager
def _changed(change):
    with ExitStack() as stack:
        for module, name in INFERRING:
            stack.enter_context(patch.object(module, name, change(getattr(module, name))))
        yield


def _kept(function, folder):
    @wraps(function)
    def found(record, *rest):
        asked = [function.__name__, *record, *(each for each in rest if not callable(each))]
        path = folder / hashlib.sha256(pickle.dumps(asked)).hexdigest()
        if path.exists():
            return pickle.loads(path.read_bytes())
        result = function(record, *rest)
        unfinished = path.with_suffix(f".{os.getpid()}")
        unfinished.write_bytes(pickle.dumps(result))
        unfinished.replace(path)
        return result

    return found
