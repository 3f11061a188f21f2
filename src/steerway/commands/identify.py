"""The commands that identify a model of a boat from a manoeuvre: identify yaw, heading, surge, compass."""

from pathlib import Path

import typer

from steerway.commands.terminal import argument, option, print_notes, print_pairs

app = typer.Typer(no_args_is_help=True, help="Identify a model of the boat from a log of a manoeuvre.")

LOG = argument("LOG", "CSV or Parquet with named columns.")
COMPASS_LOG = argument("LOG", "A log with positions and headings.")


@app.command()
def yaw(
    log: Path = LOG,
    rudder: str | None = option("COLUMN", "Column of the rudder or yaw moment."),
    angle: str | None = option("COLUMN", "Column of the heading or course."),
    bandwidth: float | None = option("RAD/S", "Also print the autopilot gains for this bandwidth, rad/s."),
    damping: float = option("ZETA", "Relative damping of the autopilot.", 1.0),
) -> None:
    """Identify Nomoto's K, T and rudder bias from a zigzag or a turning circle, with 95 % intervals.

    The log has time_s, a rudder (rudder_deg or yaw_moment_nm) and heading_deg or cog_deg; without these the course is
    estimated from lat_deg and lon_deg.

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
    """Identify a second-order heading model from a pseudo-random binary manoeuvre, for the heading MPC.

    The log has time_s at even intervals, a steering input (rudder_deg, yaw_moment_nm or a column named), heading_deg.

    Example:

        steerway identify heading weave.csv --steering rpm_difference
    """
    from steerway.core.errors import InputError
    from steerway.identification import identify_heading
    from steerway.identification.logs import read_steering

    recorded = read_steering(log, steering, angle)
    if recorded.angle is None:
        raise InputError(f"{log} has no heading, expected heading_deg or a column named with --angle")
    model = identify_heading(recorded.time, recorded.rudder, recorded.angle)
    print_pairs(
        [
            ("poles", ", ".join(f"{pole:.5g}" for pole in model.poles)),
            ("gains", ", ".join(f"{gain:.4g}" for gain in model.gains) + " rad a unit of input and sample"),
            ("steady turn rate", f"{model.turn_rate:.4g} rad/s a unit of input"),
            ("time constant", f"{model.time_constant:.3g} s"),
            ("bias of the input", f"{model.bias:.3g}"),
            ("fit", f"{model.fit:.1f} %, residual {model.residual_rms:.3g} rad RMS at {model.sample:g} s"),
        ]
    )


@app.command()
def surge(
    log: Path = LOG,
    diameter: float | None = option("M", "Diameter of the propeller: tells drag from a loss of thrust."),
    shaft: str | None = option("COLUMN", "Column of the shaft speed, or of a command in any unit."),
    neutral: float = option("VALUE", "Value of the column at which there is no thrust.", 0.0),
) -> None:
    """Identify drag and thrust over mass from a staircase of speeds, and whether the log determines them.

    The log is a CSV with time_s, speed_mps (through the water, or over ground without a current) and shaft_rps, or a
    column given with --shaft, such as per cent or PWM in µs; thrust must be quadratic in it. Thrust falls with speed
    by the open-water curve of a usual propeller of the --diameter given; without it, that is identified too.

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
        raise InputError("--diameter needs the shaft speed in rev/s, expected no --shaft with it")
    time, speed, turns = read_surge_log(log, shaft)
    turns = turns - neutral
    found = identify_surge(time, speed, turns, None if diameter is None else Propeller(diameter=diameter))
    model, std = found.model, found.std
    unit = "rev/s" if shaft is None else f"unit of {shaft}"
    rows = [
        ("linear drag d", f"{model.linear_drag:.4g} ± {2.0 * std[0]:.2g} 1/s"),
        ("quadratic drag b", f"{model.quadratic_drag:.4g} ± {2.0 * std[1]:.2g} 1/m"),
        ("thrust at rest", f"{found.thrust_at_rest:.4g} ± {200.0 * std[2] / model.thrust:.1f} % m/s² for one {unit}"),
    ]
    if found.pitch is not None and found.pitch_std is not None:
        falls = f"at {found.pitch:.3g} ± {2.0 * found.pitch_std:.2g} m/s for one {unit}"
        rows.append(("no thrust", falls if found.pitch < np.inf else "at no speed of this log"))
    else:
        rows.append(("thrust g", f"{model.thrust:.4g} ± {2.0 * std[2]:.2g} m/rev² for a K_t of 1"))
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

    The log is any that `estimate` reads, with positions and headings. Sail two whole circles to each side, at one
    setting of the throttle; the current is identified too. The last lines are the [compass] table of a scenario.

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
