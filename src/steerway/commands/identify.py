"""The commands that identify a model of a boat from a log of a manoeuvre: identify yaw, heading, surge, compass."""

from pathlib import Path

import typer

from steerway.commands.terminal import argument, option, print_notes, print_pairs

app = typer.Typer(no_args_is_help=True, help="Identify a model of the boat from a log of a manoeuvre.")

LOG = argument("LOG", "CSV or Parquet table with named columns.")
COMPASS_LOG = argument("LOG", "A log with positions and headings.")


@app.command()
def yaw(
    log: Path = LOG,
    rudder: str | None = option("COLUMN", "Column of the rudder angle or yaw moment."),
    angle: str | None = option("COLUMN", "Column of the heading or course."),
    bandwidth: float | None = option("RAD/S", "Also print the autopilot gains for this bandwidth, rad/s."),
    damping: float = option("ZETA", "With --bandwidth: damping ratio of the autopilot.", 1.0),
) -> None:
    """Identify Nomoto's K, T and rudder bias from a zigzag or a turning circle, with 95 % intervals.

    The log needs the columns time_s, rudder_deg (or yaw_moment_nm) and heading_deg (or cog_deg). Without heading and
    course, the course is estimated from lat_deg and lon_deg. The rudder bias is printed in rad (or N·m).

    Example:

        steerway identify yaw zigzag.csv --bandwidth 0.5
    """
    from steerway.identification import identify_yaw, identify_yaw_from_fixes
    from steerway.identification.logs import read_steering

    recorded = read_steering(log, rudder, angle)
    if recorded.angle is not None:
        model = identify_yaw(recorded.time, recorded.rudder, recorded.angle)
    else:
        model = identify_yaw_from_fixes(recorded.fixes, recorded.time, recorded.rudder)
    print_notes(recorded.notes)
    print_pairs(
        [
            ("gain K", str(model.gain)),
            ("time constant T", f"{model.time_constant} s"),
            ("rudder bias", str(model.rudder_bias)),
            ("identified from", f"{model.samples} {model.measured}"),
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
def heading(
    log: Path = LOG,
    steering: str | None = option("COLUMN", "Column of the steering input."),
    angle: str | None = option("COLUMN", "Column of the heading."),
) -> None:
    """Identify a second-order heading model, for the heading MPC, from a manoeuvre with pseudo-random binary steering.

    The log needs three columns: time_s at even intervals; the heading (heading_deg, or the one named by --angle); and
    the steering input (rudder_deg, yaw_moment_nm, or the one named by --steering).

    Example:

        steerway identify heading weave.csv --steering rpm_difference
    """
    from steerway.core.errors import InputError
    from steerway.identification import identify_heading
    from steerway.identification.logs import read_steering

    recorded = read_steering(log, steering, angle)
    if recorded.angle is None:
        raise InputError(f"{log} has no heading, expected a column heading_deg or one given by --angle")
    model = identify_heading(recorded.time, recorded.rudder, recorded.angle)
    print_pairs(
        [
            ("poles", ", ".join(f"{pole:.5g}" for pole in model.poles)),
            ("gains", ", ".join(f"{gain:.4g}" for gain in model.gains) + " rad per unit of input and sample"),
            ("steady turn rate", f"{model.turn_rate:.4g} rad/s per unit of input"),
            ("time constant", f"{model.time_constant:.3g} s"),
            ("bias of the input", f"{model.bias:.3g}"),
            ("fit", f"{model.fit:.1f} %, residual {model.residual_rms:.3g} rad RMS at {model.sample:g} s"),
        ]
    )


@app.command()
def surge(
    log: Path = LOG,
    diameter: float | None = option("M", "Propeller diameter, m: separates drag from the loss of thrust with speed."),
    shaft: str | None = option("COLUMN", "Column with the shaft speed, or with a command in any unit."),
    neutral: float = option("VALUE", "Value of the --shaft column at zero thrust.", 0.0),
) -> None:
    """Identify drag and thrust, both over mass, from a staircase of speeds. Reports whether the log determines them.

    The log needs time_s, speed_mps (through the water; over ground if there is no current) and shaft_rps. In place of
    shaft_rps, --shaft names a column with a command (per cent, PWM in µs, …) whose square is proportional to thrust.
    With --diameter, the loss of thrust with speed follows a typical open-water curve; otherwise it is identified.

    Examples:

        steerway identify surge staircase.csv --diameter 0.25

        steerway identify surge staircase.csv --shaft throttle_pct

        steerway identify surge staircase.csv --shaft pwm_us --neutral 1500
    """
    import numpy as np

    from steerway.core.errors import InputError
    from steerway.identification import identify_surge
    from steerway.identification.logs import read_surge_log
    from steerway.vessels import Propeller

    if diameter is not None and shaft is not None:
        raise InputError("--diameter needs shaft speeds in rev/s (column shaft_rps), expected no --shaft with it")
    time, speed, turns = read_surge_log(log, shaft)
    turns = turns - neutral
    found = identify_surge(time, speed, turns, None if diameter is None else Propeller(diameter=diameter))
    model, std = found.model, found.std
    unit = "rev/s" if shaft is None else f"unit of {shaft}"
    rows = [
        ("linear drag d", f"{model.linear_drag:.4g} ± {2.0 * std[0]:.2g} 1/s"),
        ("quadratic drag b", f"{model.quadratic_drag:.4g} ± {2.0 * std[1]:.2g} 1/m"),
        ("thrust at rest", f"{found.thrust_at_rest:.4g} m/s² ± {200.0 * std[2] / model.thrust:.1f} % at one {unit}"),
    ]
    if found.pitch is not None and found.pitch_std is not None:
        falls = f"at {found.pitch:.3g} ± {2.0 * found.pitch_std:.2g} m/s per {unit}"
        rows.append(("thrust vanishes", falls if found.pitch < np.inf else "at no speed in this log"))
    else:
        rows.append(("thrust g", f"{model.thrust:.4g} ± {2.0 * std[2]:.2g} m/rev² at K_t = 1"))
    if found.lag > 0.0:
        rows.append(("shaft lag", f"{found.lag:.2g} ± {2.0 * found.lag_std:.1g} s"))
    full = float(np.nanmax(np.abs(turns)))
    guess = found.guess(full)
    rows += [
        ("residual", f"{found.residual:.3g} m/s RMS"),
        ("for speed control", f"thrust {guess['thrust']:.4g}, high {full:g}, with drag and lag as above"),
        ("verdict", found.verdict),
    ]
    print_pairs(rows)


@app.command()
def compass(log: Path = COMPASS_LOG) -> None:
    """Identify a compass's deviation card, lag and noise from circles to both sides, with 95 % intervals.

    Sail two full circles to each side at constant throttle. Any log that `estimate` reads will do if it has positions
    and headings. The current is identified too. The last lines printed are a [compass] table for a scenario.

    Example:

        steerway identify compass circles.nmea
    """
    import steerway
    from steerway.commands.options import read_logs
    from steerway.identification import identify_compass

    fixes = read_logs([str(log)], None, None, None)
    found = identify_compass(fixes, steerway.estimate(fixes))
    print_notes(fixes.notes)
    print_pairs(found.rows())
    typer.echo(found.toml(), nl=False)
