"""The demo: an Otter sails a survey in a current, steered by the estimate from a low-cost receiver's fixes."""

import math
from collections.abc import Callable
from pathlib import Path

from steerway.commands.terminal import option, print_pairs, progress_line
from steerway.core.locks import only_writer

SCENARIO = """
name = "An Otter on a survey in a crossing current"
description = "Steered by course over ground, estimated from the positions of one small receiver; no compass aboard."
duration = 900.0

[vessel]
kind = "otter"

[environment]
force = [0.0, 5.0]

[environment.current]
speed = 0.3
direction_deg = 90.0

[estimator]
kind = "steering"

[speed]
cruise = 1.2

[route]
acceptance = 4.0
waypoints = [
    { north = 0.0, east = 0.0 },
    { north = 150.0, east = 0.0 },
    { north = 150.0, east = 100.0 },
    { north = 30.0, east = 100.0 },
    { north = 30.0, east = 200.0 },
    { north = 150.0, east = 200.0 },
]
"""

WITH_VELOCITY = """
[gnss]
velocity_std = 0.05
"""
"""Added to `SCENARIO` for a receiver that also reports velocity: 1σ of its north and of its east component, m/s."""


def demo(
    out: Path = option("DIR", "Directory for the log and the page.", Path("demo"), "-o", "--out"),
) -> None:
    """Simulate a survey steered by the estimate, compare the estimate with the truth, and write a log and a page.

    Example:

        steerway demo -o demo && steerway estimate demo/run.nmea --report demo/estimate.html
    """
    with only_writer(out, str(out)), progress_line("simulating the demo") as step:
        rows, written = simulate_demo(out, progress=step)
    print_pairs(rows)
    for path in written:
        print(f"wrote {path}")


def simulate_demo(
    directory: Path, progress: Callable[[float], None] | None = None
) -> tuple[list[tuple[str, str]], list[Path]]:
    """Simulate the demo's mission; write run.parquet, run.nmea, index.html, details.html and results.json.

    Returns (rows, files): (what, value) pairs with the errors of the estimate and a summary of the run, and the paths
    written. Raises InputError for a directory that cannot be written.
    """
    from steerway.core.extras import is_installed
    from steerway.simulation import outcome, run
    from steerway.simulation.advising import advise
    from steerway.simulation.bound import course_bound
    from steerway.simulation.reading import parse_scenario
    from steerway.simulation.runs.files import write, write_results
    from steerway.simulation.runs.page import comparison, summary, write_story

    scenario = parse_scenario(SCENARIO, "demo")
    sailed = run.sail_scenario(scenario, progress=progress)
    remarks = [advise(scenario)[1]]
    written = write(sailed, directory, nmea=True, remarks=remarks)
    page = directory / "index.html"
    if is_installed("report"):  # else there is only the page without figures
        page.replace(page.with_name("details.html"))
        write_story(sailed, page, [*remarks, "details.html has the actuators, the waypoints and the errors over time."])
        written.insert(-1, page.with_name("details.html"))
    with_velocity = run.sail_scenario(parse_scenario(SCENARIO + WITH_VELOCITY, "demo"))
    true, relative = outcome.leg_rms(sailed.run)
    results = {
        "cog_rms_positions_deg": sailed.numbers["cog_rms_deg"],
        "cog_bound_positions_deg": math.degrees(course_bound(scenario, sailed.run)),
        "cog_rms_velocity_deg": with_velocity.numbers["cog_rms_deg"],
        "sog_rms_positions_mps": sailed.numbers["sog_rms_mps"],
        "leg_rms_m": relative,
        "leg_rms_true_m": true,
    }
    write_results(sailed.numbers | results, Path(directory) / "results.json")
    rows = [
        (f"{what}, estimated against true", f"{error} RMS, within ± 2σ {share} (95 % expected)")
        for what, error, share in comparison(sailed.numbers)
    ]
    bound = f"{results['cog_bound_positions_deg']:.2f}° RMS (Cramér–Rao, for a known response of the boat)"
    return [*rows, ("course over ground, lower bound", bound), *summary(sailed.numbers)], written
