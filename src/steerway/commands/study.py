"""The command for studies."""

from pathlib import Path
from typing import Annotated

import typer

from steerway.commands.terminal import print_pairs, progress_line


def study(
    name: Annotated[str | None, typer.Argument(help="The study; without a name, list the studies.")] = None,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Output directory.")] = Path("study"),
    seeds: Annotated[int | None, typer.Option(min=1, help="Number of seeds; by default the study's own.")] = None,
    first_seed: Annotated[int, typer.Option(min=0, help="The first seed.")] = 0,
) -> None:
    """Run a study: compare published with measured numbers, with figures.

    Example:

        steerway study otter-course -o otter
    """
    import steerway_studies as studies
    from steerway_studies.study import write_results

    if name is None:
        print_pairs([(each, studies.named(each).summary) for each in studies.MODULES])
        return
    chosen = studies.named(name)
    with progress_line(name) as step:
        results = chosen.run(seeds, first_seed, lambda share, what="": step(share, what))
    page = write_results(results, out)
    rows = [(each.what, results.measured(each)) for each in results.comparisons]
    print_pairs(rows)
    for remark in results.remarks:
        print(f"· {remark}")
    print(f"wrote {page}")
