"""The files of a run: a table with units in its column names, the log of its receiver, its page."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.earth import displaced_all
from steerway.core.files import complete_or_absent, made_directory
from steerway.formats.nmea0183.writing import gga, hdt, rmc
from steerway.simulation import outcome
from steerway.simulation.assembly import begins
from steerway.simulation.loop import COLUMNS, Run
from steerway.simulation.run import Sailed
from steerway.simulation.runs.page import write_run_page
from steerway.vessels.vessel import Actuator

if TYPE_CHECKING:
    import polars as pl

Outward = tuple[str, Callable[[Floats], Floats] | None]
"""Name of a column with its unit, and the conversion to it."""


def _compass(radians: Floats) -> Floats:
    turned = np.mod(np.degrees(radians), 360.0)
    return np.where(turned >= 360.0, 0.0, turned)


_UNITS: tuple[tuple[str, Callable[[Floats], Floats] | None, str], ...] = (
    # yaw: N·m, or rad of rudder
    ("", None, "mode by_course leg_target speed_gain made_up yaw_gain yaw_damping yaw_time yaw"),
    ("_dps2", np.degrees, "desired_acceleration reference_acceleration"),
    ("_mps2", None, "acceleration"),
    ("_n", None, "force force_north force_east"),
    ("_nm", None, "moment"),
    ("_rps", None, "shaft"),
    ("_s", None, "slip_time age"),
    ("_mps", None, "velocity surge sway sog sog_std speed current_north current_east current_std"),
    ("_dps", np.degrees, "yaw_rate course_rate course_rate_std rate yaw_bias"),
    ("_deg", np.degrees, "roll pitch cog_std heading_std"),
    ("_m", None, "north east along_track cross_track remaining distance position_std position_relative_std"),
    ("_deg", _compass, "heading cog angle direction bearing"),
)
"""(unit, conversion to it, endings of the columns with this unit); the first row with a column's ending applies."""


def _outward(name: str) -> Outward:
    """(name with unit, conversion) of a column of `Run`."""
    for unit, convert, endings in _UNITS:
        if any(f"_{name}".endswith(f"_{ending}") for ending in endings.split()):
            return name + unit, convert
    raise KeyError(name)


NAMES = {name: _outward(name) for name in COLUMNS}


def frame(
    run: Run, actuators: Sequence[Actuator] = (), origin: tuple[float, float] = (0.0, 0.0), begins: float = 0.0
) -> "pl.DataFrame":
    """A polars DataFrame of the run: time_s, elapsed_s, the columns with their units, derived ones, actuator commands.

    `origin` is the (latitude, longitude) of north = east = 0 in rad, `begins` the Unix time of the first row. Rudders
    are in degrees, propellers in rad/s; unknown values are null.
    """
    import polars as pl

    columns = {"time_s": begins + run.time, "elapsed_s": run.time}
    for name, (outward, convert) in NAMES.items():
        columns[outward] = convert(run[name]) if convert else run[name]
    for whose in ("true", "estimated"):
        latitude, longitude = displaced_all(*origin, run[f"{whose}_north"], run[f"{whose}_east"])
        columns[f"{whose}_lat_deg"], columns[f"{whose}_lon_deg"] = np.degrees(latitude), np.degrees(longitude)
    columns["true_sog_mps"], columns["true_cog_deg"] = run.true_sog, _compass(run.true_cog)
    columns["true_crab_angle_deg"] = np.degrees(outcome.crab_angle(run))
    for index, command in enumerate(run.command.T):
        name, convert = _actuator(actuators[index].name if index < len(actuators) else f"actuator {index}")
        columns[name] = convert(command)
    return pl.DataFrame([pl.Series(name, values, nan_to_null=True) for name, values in columns.items()])


def _actuator(name: str) -> tuple[str, Callable[[Floats], Floats]]:
    words = "command_" + name.replace(" ", "_")
    if name == "rudder":
        return f"{words}_deg", np.degrees
    return (f"{words}_radps" if name.endswith("propeller speed") else words), np.asarray


def write_log(run: Run, path: Path, begins: float, origin: tuple[float, float], quality: int = 1) -> int:
    """Write the readings of the instruments as an NMEA 0183 log from Unix time `begins`; returns the number of fixes.

    RMC and GGA for every fix, with the receiver's SOG and COG if it reports them, and HDT with the latest compass
    reading since the previous fix. HDT has no time field: readers give it the time of the fix next to it. `origin` is
    the (latitude, longitude) of north = east = 0 in rad; `quality` is the fix quality in GGA.
    """
    read = {name: run[f"read_{name}"] for name in ("north", "east", "sog", "cog", "heading")}
    latitude, longitude = displaced_all(*origin, read["north"], read["east"])
    heading, fixes = math.nan, 0
    with complete_or_absent(path) as file:
        for k in np.flatnonzero(np.isfinite(read["north"]) | np.isfinite(read["heading"])).tolist():
            if math.isfinite(read["heading"][k]):
                heading = float(read["heading"][k])
            if not math.isfinite(latitude[k]):
                continue
            time = begins + float(run.time[k])
            text = rmc(time, latitude[k], longitude[k], float(read["sog"][k]), float(read["cog"][k]))
            text += gga(time, latitude[k], longitude[k], quality=quality)
            if math.isfinite(heading):
                text += hdt(heading)
            file.write(text.encode("ascii"))
            heading, fixes = math.nan, fixes + 1
    return fixes


def write_results(numbers: Mapping[str, float | None], path: Path) -> None:
    """Write results by name as JSON; null for a number that is not finite."""
    known = {name: value if value is not None and math.isfinite(value) else None for name, value in numbers.items()}
    with complete_or_absent(path) as file:
        file.write(json.dumps(known, indent=2).encode() + b"\n")


def write(simulated: Sailed, directory: Path, nmea: bool = False, remarks: Sequence[str] = ()) -> list[Path]:
    """Write run.parquet, results.json, index.html and, on request, run.nmea to `directory`; returns their paths.

    Raises InputError for a directory that cannot be written.
    """
    directory = made_directory(directory)
    table, page, log = directory / "run.parquet", directory / "index.html", directory / "run.nmea"
    results = directory / "results.json"
    write_results(simulated.numbers, results)
    began = begins(simulated.scenario)
    with complete_or_absent(table) as file:
        frame(simulated.run, simulated.assembly.vessel.actuators, simulated.origin, began).write_parquet(file)
    if nmea:
        write_log(simulated.run, log, began, simulated.origin, simulated.scenario.gnss.quality)
    write_run_page(simulated, page, remarks)
    return [table, page, *([log] if nmea else []), results]
