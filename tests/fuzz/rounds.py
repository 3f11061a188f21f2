"""One round of a target: mutate, read, keep what leads to something new, and what must not happen."""

import faulthandler
import hashlib
import logging
import os
import random
import re
import time
import traceback
from dataclasses import dataclass, field
from pathlib import Path

from steerway.core import InputError
from tests.fuzz.mutation import mutated
from tests.fuzz.targets import REFUSED, named

SLOW = 5.0
"""s of processor time for one input; none has more than 20 kB here, the limit is that of a megabyte."""
_STUCK = 60.0  # s beyond its time after which a round is ended from within
_KEPT = 400  # inputs of a corpus


@dataclass
class Round:
    """What one round did; `findings` are (kind, file, last line of the traceback)."""

    target: str
    tried: int = 0
    refused: int = 0
    crashed: int = 0
    slow: int = 0
    findings: list[tuple[str, str, str]] = field(default_factory=list)


def fuzz(job: tuple[str, float, int, str]) -> Round:
    """A round: (target, seconds, seed, folder of the corpus)."""
    name, seconds, seed, folder = job
    place = Path(folder, re.sub(r"\W+", "-", name))
    place.mkdir(parents=True, exist_ok=True)
    logging.disable()
    target, rng, done = named(name), random.Random(seed), Round(name)
    corpus = target.seeds() + [path.read_bytes() for path in sorted(place.glob("seen-*"))]
    outcomes = {_outcome(target, each, done, place) for each in corpus}
    faulthandler.dump_traceback_later(seconds + _STUCK, exit=True)
    present = os.open(place / f"running-{seed}", os.O_RDWR | os.O_CREAT)
    until = time.monotonic() + seconds
    try:
        while time.monotonic() < until:
            data = mutated(rng.choice(corpus), corpus, rng)
            os.ftruncate(present, 0)
            os.pwrite(present, data, 0)  # what is left when the process is ended
            outcome = _outcome(target, data, done, place)
            if outcome not in outcomes and len(corpus) < _KEPT:
                outcomes.add(outcome)
                corpus.append(data)
                (place / f"seen-{_name(data)}").write_bytes(data)
    finally:
        faulthandler.cancel_dump_traceback_later()
        os.close(present)
    (place / f"running-{seed}").unlink()
    return done


def _outcome(target, data, done, place):
    began = time.process_time()
    done.tried += 1
    try:
        outcome = target.read(data)
    except InputError as error:
        outcome = f"{REFUSED} {error}"
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        outcome = f"crashed {type(error).__name__} {where.filename}:{where.lineno}"
        done.crashed += 1
        if all(outcome != known for _, _, known in done.findings):
            done.findings.append(("crashed", str(_saved(place, "crash", data)), outcome))
    if time.process_time() - began > SLOW:
        done.slow += 1
        done.findings.append(("slow", str(_saved(place, "slow", data)), f"{time.process_time() - began:.1f} s"))
    done.refused += outcome.startswith(REFUSED)
    return re.sub(r"\d+", "0", outcome)[:200]


def _saved(place, kind, data):
    path = place / f"{kind}-{_name(data)}"
    path.write_bytes(data)
    return path


def _name(data):
    return hashlib.sha256(data).hexdigest()[:12]
