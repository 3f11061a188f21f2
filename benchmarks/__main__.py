"""python -m benchmarks [name…]: runs the named subjects, or all."""

import importlib
import pkgutil
import sys

import benchmarks
from benchmarks.support.harness import machine


def subjects() -> list[str]:
    """Names of the benchmark files."""
    modules = pkgutil.iter_modules(benchmarks.__path__)
    return [each.name for each in modules if not each.ispkg and not each.name.startswith("_")]


def main(names):
    known = subjects()
    unknown = [name for name in names if name not in known]
    if unknown:
        sys.exit(f"{unknown[0]!r} is not a benchmark, expected some of {', '.join(known)}")
    print(machine(), flush=True)
    missed = []
    for name in names or known:
        module = importlib.import_module(f"benchmarks.{name}")
        print(f"\n{name}: {module.__doc__.splitlines()[0]}", flush=True)
        for result in module.run():
            print(f"  {result}", flush=True)
            if result.met is False:
                missed.append(f"{name}: {result.what}")
    print("\nEvery target is met." if not missed else "\nMissed: " + "; ".join(missed))


main(sys.argv[1:])
