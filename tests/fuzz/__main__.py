"""python -m tests.fuzz: rounds of every target until the time is over; then a table, exit code 1 for any finding."""

import argparse
import os
import re
import sys
import time
from contextlib import closing
from pathlib import Path

from steerway.core.testing import in_workers
from tests.fuzz.rounds import Round, fuzz
from tests.fuzz.targets import TARGETS

ROUND = 10.0
"""s of one round, shorter where there is less time for all."""


def main() -> None:
    """Fuzz and report."""
    parser = argparse.ArgumentParser("python -m tests.fuzz", description=__doc__)
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--corpus", type=Path, default=Path.home() / ".cache" / "steerway" / "fuzz")
    parser.add_argument("--only", choices=TARGETS, action="append", help="one target, can be repeated")
    given = parser.parse_args()
    names = given.only or list(TARGETS)
    totals = {name: Round(name) for name in names}
    seconds = 60.0 * given.minutes
    until = time.monotonic() + seconds
    length = min(ROUND, max(0.2, (until - time.monotonic()) * given.processes / len(names)))
    seed = int(time.time())
    while time.monotonic() < until:
        jobs = [(name, length, seed + k, str(given.corpus)) for k, name in enumerate(names)]
        seed += len(jobs)
        try:
            with closing(in_workers(fuzz, jobs, max(given.processes, 2))) as rounds:
                for _, each in rounds:
                    _add(totals[each.target], each)
        except ChildProcessError as error:
            print(error, flush=True)
        _killed(totals, given.corpus, jobs)
        _print(totals, f"{max(until - time.monotonic(), 0.0) / 60.0:.1f} min left")
    _print(totals, "in all")
    sys.exit(any(each.findings for each in totals.values()))


def _add(total: Round, more: Round) -> None:
    total.tried += more.tried
    total.refused += more.refused
    total.crashed += more.crashed
    total.slow += more.slow
    known = {what for _, _, what in total.findings}
    total.findings += [each for each in more.findings if each[2] not in known]


def _killed(totals, corpus, jobs) -> None:
    """Inputs at which a process was ended: what a round has left behind."""
    for name, _, seed, _ in jobs:
        left = corpus / re.sub(r"\W+", "-", name) / f"running-{seed}"
        if left.exists():
            kept = left.with_name(f"killed-{seed}")
            left.rename(kept)
            totals[name].findings.append(("killed or stopped", str(kept), f"seed {seed}"))


def _print(totals, words) -> None:
    print(f"\n{'':<18} {'tried':>10} {'refused':>10} {'crashed':>8} {'slow':>5}   {words}")
    for name, each in totals.items():
        print(f"{name:<18} {each.tried:>10} {each.refused:>10} {each.crashed:>8} {each.slow:>5}")
    sums = [sum(getattr(each, what) for each in totals.values()) for what in ("tried", "refused", "crashed", "slow")]
    print(f"{'all':<18} {sums[0]:>10} {sums[1]:>10} {sums[2]:>8} {sums[3]:>5}")
    for name, each in totals.items():
        for kind, path, what in each.findings:
            print(f"! {name}: {kind}: {what}\n  {path}")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
