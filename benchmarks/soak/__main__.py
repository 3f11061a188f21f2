"""python -m benchmarks.soak [--minutes M]: prints the table; exit code 1 if a target is missed."""

import argparse
import asyncio
import sys

from benchmarks.soak.run import results, soak
from benchmarks.support.harness import machine

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    chosen = parser.parse_args()
    print(machine(), flush=True)
    done = asyncio.run(soak(60.0 * chosen.minutes))
    missed = False
    for result in results(done):
        print(f"  {result}")
        missed |= result.met is False
    if missed:
        print(done.log, file=sys.stderr)
    sys.exit(int(missed))
