"""The page of a run that is looked into: the true motion, the estimate with its ±2σ, and the receiver's fixes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from steerway.core.earth import displaced_all
from steerway.core.records import NO_COURSE, OK, Fixes, Motion
from steerway.report.page import ReportContents, Table
from steerway.simulation.assembly import begins
from steerway.simulation.run import Sailed
from steerway.simulation.runs.page import COMPARED, comparison, summary, within


def write_story(sailed: Sailed, path: Path, remarks: Sequence[str] = ()) -> None:
    """The interactive page of a `run.Sailed`: truth and estimate at every fix."""
    from steerway.report.interactive import write_interactive_page

    run = sailed.run
    run = run.rows(np.isfinite(run["read_north"]))
    time = begins(sailed.scenario) + run.time
    known = np.isfinite(run["estimated_cog"])
    unknown = np.full(len(run), np.nan)
    estimate = Motion(
        time,
        *displaced_all(*sailed.origin, run["estimated_north"], run["estimated_east"]),
        **{name: run[f"estimated_{name}"] for name in ("sog", "cog", "course_rate", "sog_std", "cog_std")},
        course_rate_std=run["estimated_course_rate_std"],
        position_std=run["estimated_position_std"],
        position_relative_std=run["estimated_position_relative_std"],
        nis=unknown,
        status=np.where(known, OK, NO_COURSE).astype(np.uint8),
    )
    zero = np.zeros(len(run))
    truth = Motion(
        time,
        *displaced_all(*sailed.origin, run["true_north"], run["true_east"]),
        sog=run.true_sog,
        cog=run.true_cog,
        course_rate=run["true_course_rate"],
        **{name: zero for name in ("sog_std", "cog_std", "course_rate_std", "position_std")},
        nis=unknown,
        status=np.full(len(run), OK, np.uint8),
    )
    fixes = Fixes(time, *displaced_all(*sailed.origin, run["read_north"], run["read_east"]))
    numbers = sailed.numbers
    lead = (
        f"{sailed.scenario.description} Errors of the estimate: SOG {numbers['sog_rms_mps']:.2f} m/s, "
        f"COG {numbers['cog_rms_deg']:.1f}° RMS; the true course lies within the ±2σ band "
        f"{within(numbers['cog_within_2sigma_pct'])} (95 % expected)."
    )
    tables: list[Table] = [
        ("Estimated against true", COMPARED, comparison(numbers)),
        ("Summary", ("", ""), summary(numbers)),
    ]
    report = ReportContents(sailed.scenario.name, fixes, estimate, tables, remarks, truth=truth, lead=lead.strip())
    write_interactive_page(path, report)
