"""The files of one run in a directory."""

from pathlib import Path

from steerway.core.files import made_directory
from steerway.simulation.assembly import begins
from steerway.simulation.run import Sailed
from steerway.simulation.runs.files import write_log, write_table
from steerway.simulation.runs.page import write_run_page


def write(simulated: Sailed, directory: Path, nmea: bool = False, remarks=()) -> list[Path]:
    """run.parquet, index.html and, on request, run.nmea in `directory`; returns what was written.

    Raises InputError for a directory that cannot be written.
    """
    directory = made_directory(directory)
    table, page, log = directory / "run.parquet", directory / "index.html", directory / "run.nmea"
    write_table(simulated.run, table, simulated.assembly.vessel.actuators, simulated.origin)
    if nmea:
        write_log(simulated.run, log, begins(simulated.scenario), simulated.origin)
    write_run_page(simulated, page, remarks)
    return [table, page, *([log] if nmea else [])]
