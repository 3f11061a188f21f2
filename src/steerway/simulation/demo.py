"""The demo: an Otter sails a survey in a current, steered by what the filter makes of a small receiver's fixes."""

from pathlib import Path

from steerway.simulation import run
from steerway.simulation.reading import parse_scenario
from steerway.simulation.run_page import comparison, summary

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


def demo(directory: str | Path, progress=None) -> tuple[list[tuple[str, str]], list[Path]]:
    """Sail the demo mission; writes run.parquet, run.nmea and index.html into `directory`.

    Returns (rows, files): (what, value) rows of the estimate held against the truth and of what the boat did, and what
    was written. Raises InputError for a directory that cannot be written.
    """
    scenario = parse_scenario(SCENARIO, "demo")
    sailed = run.sail_scenario(scenario, progress=progress)
    written = run.write(sailed, Path(directory), nmea=True, remarks=[run.advise(scenario)[1]])
    rows = [(f"{what}, estimated against true", value) for what, value in comparison(sailed.numbers)]
    return rows + summary(sailed.numbers), written
