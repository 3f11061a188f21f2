"""The results of a run, and the errors of its estimate."""

import math
from collections.abc import Sequence

import numpy as np

from steerway.core.angles import wrap_array
from steerway.core.arrays import Floats
from steerway.core.statistics import rms, share_within
from steerway.guidance.mission_log import Passage
from steerway.pilot import Mode
from steerway.simulation.loop import Run
from steerway.vessels.vessel import Actuator

SETTLING = 30.0
"""Initial time (s) that is not evaluated: the filter converges, the boat accelerates."""


def errors(run: Run) -> dict[str, np.ndarray]:
    """Estimate minus truth, (n,) each: north, east, position (the length of both), sog, cog, heading, course_rate."""
    north = run["estimated_north"] - run["true_north"]
    east = run["estimated_east"] - run["true_east"]
    turn = run["estimated_cog"] - run.true_cog
    return {
        "position": np.hypot(north, east),
        "north": north,
        "east": east,
        "sog": run["estimated_sog"] - run.true_sog,
        "cog": wrap_array(turn),
        "course_rate": run["estimated_course_rate"] - run["true_course_rate"],
        "heading": wrap_array(run["estimated_heading"] - run["true_heading"]),
    }


def crab_angle(run: Run) -> np.ndarray:
    """(n,) true angle from the bow to the velocity over ground, rad in [−π, π)."""
    return wrap_array(run.true_cog - run["true_heading"])


def evaluated(run: Run) -> np.ndarray:
    """(n,) bool: the evaluated rows, under way and after the transient."""
    return (run["mode"] == Mode.UNDER_WAY) & (run.time > min(SETTLING, 0.2 * run.time[-1]))


def numbers(run: Run, passages: Sequence[Passage] = ()) -> dict[str, float]:
    """Results of a run by name; NaN if no row can be evaluated. Results of an unestimated heading are omitted."""
    rows = evaluated(run)
    error = errors(run)
    cross = run["leg_cross_track"]
    true_cross = run.true_cross_track
    heading = error["heading"][rows]
    of_heading = {"heading_rms_deg": math.degrees(_known_rms(heading))} if np.isfinite(heading).any() else {}
    return of_heading | {
        "duration_s": float(run.time[-1]),
        "waypoints_reached": float(sum(each.reached for each in passages)),
        "waypoints_missed": float(sum(not each.reached for each in passages)),
        "sog_rms_mps": _known_rms(error["sog"][rows]),
        "cog_rms_deg": math.degrees(_known_rms(error["cog"][rows])),
        "course_rate_rms_dps": math.degrees(_known_rms(error["course_rate"][rows])),
        "position_rms_m": _known_rms(error["position"][rows]),
        **_coverage(run.rows(rows)),
        "cross_track_rms_m": _known_rms(true_cross[rows]),
        "cross_track_max_m": float(np.max(np.abs(true_cross[rows]), initial=0.0)),
        "estimated_cross_track_rms_m": _known_rms(cross[rows]),
        "crab_angle_max_deg": math.degrees(np.max(np.abs(crab_angle(run)[rows]), initial=0.0)),
        "hand_overs": float(np.abs(np.diff(run["by_course"])).sum()),
        "finished": float(run["mode"][-1] == Mode.STOPPED),
    }


def _coverage(run: Run) -> dict[str, float]:
    """Percentage of rows (for positions: of coordinates) with the true value within ± 2σ of the estimate."""
    error = errors(run)
    both = np.stack([error["north"], error["east"]])
    found = {"position": share_within(both, run["estimated_position_std"])}
    found |= {name: share_within(error[name], run[f"estimated_{name}_std"]) for name in ("sog", "cog", "course_rate")}
    return {f"{name}_within_2sigma_pct": share for name, share in found.items()}


def rudder_numbers(run: Run, actuators: Sequence[Actuator]) -> dict[str, float]:
    """Largest rudder command and largest demanded rudder rate; nothing without a rudder.

    The demanded rate is (command − rudder)/lag. A steering gear would saturate if its rate limit were lower.
    """
    numbers = {}
    for each, command in zip(actuators, run.command.T, strict=True):
        if each.name == "rudder":
            step = float(run.time[1]) if len(run) > 1 else 1.0
            numbers["rudder_max_deg"] = math.degrees(np.abs(command).max(initial=0.0))
            numbers["rudder_rate_max_dps"] = math.degrees(_asked_rate(command, each.lag, step))
    return numbers


def place_numbers(run: Run) -> dict[str, float]:
    """Mean absolute error of the estimated position (north and east, all rows), and the final true position."""
    errors = [run[f"estimated_{axis}"] - run[f"true_{axis}"] for axis in ("north", "east")]
    return {
        "position_mae_m": float(np.mean(np.abs(errors))),
        "final_north_m": float(run["true_north"][-1]),
        "final_east_m": float(run["true_east"][-1]),
    }


def _asked_rate(command: Floats, lag: float, step: float) -> float:
    """Largest demanded rudder rate, rad/s."""
    if lag == 0.0:
        return float(np.abs(np.diff(command)).max(initial=0.0)) / step
    rudder = largest = 0.0
    for wanted in command.tolist():
        largest = max(largest, abs(wanted - rudder) / lag)
        rudder += -math.expm1(-step / lag) * (wanted - rudder)
    return largest


def _known_rms(values: Floats) -> float:
    return rms(values[np.isfinite(values)])


LEG_SETTLING = 20.0
"""Time (s) after a turn begins in which the cross-track error does not count."""
SLOW = 10.0
"""Averaging time (s) for the errors of fixes; the average is the receiver's slow error."""


def leg_rms(run: Run) -> tuple[float, float]:
    """RMS true cross-track error (m), and the RMS with the receiver's slow error added.

    The second is the error as the receiver sees it: an autopilot with positions alone cannot reduce the slow error.
    """
    target, direction = run["leg_target"], run["leg_direction"]
    began = run.time[np.searchsorted(target, target, side="left")]
    rows = evaluated(run) & (run.time - began > LEG_SETTLING)
    true = run.true_cross_track
    north, east = (run[f"read_{axis}"] - run[f"true_{axis}"] for axis in ("north", "east"))
    error = east * np.cos(direction) - north * np.sin(direction)
    fixed = np.isfinite(error)
    if not rows.any() or fixed.sum() < 2:
        return _known_rms(true[rows]), math.nan
    width = max(1, round(SLOW / float(np.median(np.diff(run.time[fixed])))))
    padded = np.pad(error[fixed], (width // 2, width - 1 - width // 2), mode="edge")
    slow = np.interp(run.time, run.time[fixed], np.convolve(padded, np.full(width, 1.0 / width), mode="valid"))
    return _known_rms(true[rows]), _known_rms((true + slow)[rows])
