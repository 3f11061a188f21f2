"""The command for studies. Packages register their studies as entry points of the group `steerway.studies`."""

import sys
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

from steerway.commands import interruption
from steerway.commands.terminal import argument, flag, option, print_pairs, progress_line
from steerway.core.errors import InputError
from steerway.core.extras import install
from steerway.core.locks import only_writer
from steerway.simulation.unfinished import Unfinished

GROUP = "steerway.studies"
"""An entry point loads a dict: study name → module, whose attribute STUDY is a `steerway_studies.study.Study`."""


def study(
    name: str | None = argument("NAME", "The study; without a name, list the studies.", None),
    out: Path = option("DIR", "Output directory.", Path("study"), "-o", "--out"),
    seeds: int | None = option("N", "Number of seeds; by default the study's own.", min=1),
    first_seed: int = option("K", "The first seed.", 0, min=0),
    full: bool = flag("--full", "Study at-sea only: every seed runs all cases; by default, a random selection."),
    figures_only: bool = flag(
        "--figures-only", "Draw only the figures that need no statistics, for the first seed alone; takes seconds."
    ),
    resume: bool = flag("--resume", "Continue an interrupted study; finished parts are kept."),
) -> None:
    """Run a study: compare published with measured numbers, and draw figures.

    Examples:

        steerway study otter-course -o otter

        steerway study otter-course -o otter --figures-only

        steerway study estimator-limits -o limits --resume
    """
    modules = installed()
    if name is None:
        print_pairs([(each, import_module(module).STUDY.summary) for each, module in modules.items()])
        return
    if name not in modules:
        raise InputError(f"study {name!r} is unknown, expected one of {', '.join(modules)}")
    chosen = import_module(modules[name]).STUDY
    chosen.check_installed()
    with only_writer(out, str(out)):
        if figures_only:
            print(f"wrote {chosen.figures_only(first_seed).write(out)}")
            return
        parts = Unfinished(out / "study.unfinished", {"study": name}, resume, (modules[name].split(".")[0],))
        parts.noted = lambda: interruption.keep(f"{len(parts.results)} parts", out)
        if parts.results:
            print(f"resumed: {len(parts.results)} parts are done", file=sys.stderr)
        with progress_line(name) as step:
            results = chosen.run_keeping(parts, seeds, first_seed, lambda share, what="": step(share, what), full)
        page = results.write(out)
        parts.remove()
    print_pairs([(each.what, results.measured(each)) for each in results.comparisons])
    for remark in results.remarks:
        print(f"· {remark}")
    print(f"wrote {page}")


def installed() -> dict[str, str]:
    """Study name → module, of all installed packages. Raises InputError without any."""
    modules: dict[str, str] = {}
    for entry in entry_points(group=GROUP):
        modules |= entry.load()
    if not modules:
        raise InputError(f"no studies are installed, expected {install('studies')}")
    return modules
