"""`python -m tests.fuzz.guided TARGET SECONDS FOLDER`: one target by its branch coverage, with atheris.

A crash ends the process; the input is kept in the folder. Prints the number of inputs, those refused last.
"""

import atexit
import json
import logging
import sys

import atheris

with atheris.instrument_imports(include=["steerway.formats", "steerway.live"]):
    from steerway.core import InputError
    from tests.fuzz.targets import REFUSED, named

    _, name, seconds, folder = sys.argv
    logging.disable()
    target = named(name)
    seeds = target.seeds()
    for each in seeds:
        target.read(each)  # modules that load late are instrumented too

counts = {"tried": 0, "refused": 0}


def one(data: bytes) -> None:
    """Raises what must not happen."""
    counts["tried"] += 1
    try:
        counts["refused"] += target.read(data).startswith(REFUSED)
    except InputError:
        counts["refused"] += 1


@atexit.register
def report() -> None:
    """The counts as the last line."""
    print(json.dumps(counts), flush=True)


if __name__ == "__main__":
    options = [f"-max_total_time={seconds}", "-timeout=5", "-max_len=4096", "-verbosity=0"]
    atheris.Setup([sys.argv[0], *options, f"-artifact_prefix={folder}/crash-", folder], one)
    atheris.Fuzz()
