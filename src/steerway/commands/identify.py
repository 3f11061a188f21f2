"""The commands that find out what a boat is from a manoeuvre: identify yaw, identify surge."""

import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from steerway.commands.terminal import print_pairs
from steerway.errors import InputError

app = typer.Typer(no_args_is_help=True, help="Find a model of the boat from a log of a manoeuvre.")

Log = Annotated[Path, typer.Argument(metavar="LOG", help="CSV or Parquet with named columns.")]

_TIMES = {"time_s": 1.0, "t": 1.0, "time": 1.0}
_RUDDERS = {"rudder_deg": math.pi / 180.0, "rudder_rad": 1.0, "yaw_moment_nm": 1.0, "yaw": 1.0}
_ANGLES = {"heading_deg": math.pi / 180.0, "cog_deg": math.pi / 180.0, "true_heading_deg": math.pi / 180.0}
_SPEEDS = {"speed_mps": 1.0, "water_speed_mps": 1.0, "sog_mps": 1.0}
_SHAFTS = {"shaft_rps": 1.0, "shaft_rpm": 1.0 / 60.0}


@app.command()
def yaw(
    log: Log,
    bandwidth: Annotated[
        float | None, typer.Option(metavar="RAD/S", help="Give the autopilot's gains for this bandwidth, too.")
    ] = None,
    damping: Annotated[float, typer.Option(metavar="ZETA", help="Damping of the autopilot.")] = 1.0,
) -> None:
    """Nomoto's K, T and rudder bias from a zigzag or a turning circle, with 95 % intervals.

    The log has time_s, a rudder (rudder_deg, or yaw_moment_nm) and heading_deg or cog_deg; without an angle it is
    found from lat_deg and lon_deg.

    Example:

        steerway identify yaw zigzag.csv --bandwidth 0.5
    """
    from steerway.formats.reading import read
    from steerway.identification import identify_yaw, identify_yaw_from_fixes

    columns = _columns(log)
    time, rudder = _taken(log, columns, _TIMES), _taken(log, columns, _RUDDERS)
    if any(name in columns for name in _ANGLES):
        model = identify_yaw(time, rudder, _taken(log, columns, _ANGLES))
    else:
        model = identify_yaw_from_fixes(read(log), time, rudder)
    print_pairs(
        [
            ("gain K", str(model.gain)),
            ("time constant T", f"{model.time_constant} s"),
            ("rudder bias", str(model.rudder_bias)),
            ("found from", f"{model.samples} {model.measured}"),
        ]
    )
    if bandwidth is not None:
        gains = model.gains(bandwidth, damping)
        print_pairs(
            [
                ("K_p", f"{gains.proportional:.4g}"),
                ("T_i", f"{gains.integral_time:.4g} s"),
                ("T_d", f"{gains.derivative_time:.4g} s"),
            ]
        )


@app.command()
def surge(log: Log) -> None:
    """Drag and thrust over mass from a staircase of speeds; says when a log cannot tell them.

    The log has time_s, speed_mps (through the water, or sog_mps without a current) and shaft_rps or shaft_rpm.

    Example:

        steerway identify surge staircase.csv
    """
    from steerway.identification import identify_surge

    columns = _columns(log)
    found = identify_surge(_taken(log, columns, _TIMES), _taken(log, columns, _SPEEDS), _taken(log, columns, _SHAFTS))
    model, std = found.model, found.std
    print_pairs(
        [
            ("linear drag d", f"{model.linear_drag:.4g} ± {2.0 * std[0]:.2g} 1/s"),
            ("quadratic drag b", f"{model.quadratic_drag:.4g} ± {2.0 * std[1]:.2g} 1/m"),
            ("thrust g", f"{model.thrust:.4g} ± {2.0 * std[2]:.2g} m/rev² for a K_t of 1"),
            ("residual", f"{found.residual:.3g} m/s RMS"),
            ("verdict", found.verdict),
        ]
    )


def _columns(log: Path) -> dict[str, np.ndarray]:
    """The numeric columns of a table by lower-case name."""
    import polars as pl

    try:
        frame = pl.read_parquet(log) if log.suffix == ".parquet" else pl.read_csv(log, infer_schema_length=None)
    except (OSError, pl.exceptions.PolarsError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{log}: cannot be read as CSV or Parquet ({reason})") from None
    numeric = [name for name, kind in frame.schema.items() if kind.is_numeric()]
    return {name.lower(): frame[name].cast(pl.Float64).to_numpy() for name in numeric}


def _taken(log, columns, known) -> np.ndarray:
    """The first column that is there, in SI."""
    for name, factor in known.items():
        if name in columns:
            return columns[name] * factor
    raise InputError(f"{log}: has columns {', '.join(columns) or 'none'}, expected one of {', '.join(known)}")
