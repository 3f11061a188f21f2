"""The summary of an estimate: a dict of numbers, and the lines that commands and pages show."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from steerway.core.earth import KNOT, NAUTICAL_MILE, displacement
from steerway.core.records import OK, STATUSES, Fixes, Motion
from steerway.estimation.fit.description import is_of_hull
from steerway.estimation.log.latency import UNKNOWN_LATENESS, Lateness
from steerway.report.episodes import CONTRADICTED, episodes_of, gaps, in_words

_REJECTED = "reports outside the gate; an archive rejects only those that no manoeuvre explains"
"""Printed with the rejected rows of many vessels: an archive also models manoeuvres, and rejects fewer reports."""


def distance(motion: Motion) -> float:
    """Distance run (m) while course is defined."""
    total = 0.0
    for _, track in motion.tracks():
        known = np.flatnonzero(np.isfinite(track.cog)).tolist()
        for i, j in pairwise(known):
            if j == i + 1:
                north, east = displacement(track.latitude[j], track.longitude[j], track.latitude[i], track.longitude[i])
                total += math.hypot(north, east)
    return total


def summarise(
    fixes: Fixes,
    motion: Motion,
    profile: str,
    smoothed: bool = False,
    down_weighted: int = 0,
    late: Lateness = UNKNOWN_LATENESS,
    structures: Sequence[dict[str, Any]] = (),
    aids: Sequence[str] = (),
) -> dict[str, Any]:
    """The numbers of an estimate as a dict; the keys end in units.

    smoothed: whether every row of the estimate uses the whole log. down_weighted: number of fixes with less weight
    because of their reported accuracy. structures: see `estimation.fit.description.structures_of`. aids: measurements
    used beside positions.
    """
    accepted = motion.nis[(motion.status == OK) & np.isfinite(motion.nis)]
    placed = fixes.rows(fixes.has_position)
    holes = [gap for mmsi, track in placed.tracks() for gap in gaps(track.time, mmsi is not None)]
    return {
        "source": fixes.source,
        "profile": profile,
        "of_hull": is_of_hull(structures),
        "smoothed": smoothed,
        "aids": list(aids),
        "structures": list(structures),
        "vessels": 1 if fixes.mmsi is None else len(np.unique(fixes.mmsi)),
        "fixes": len(placed),
        "fixes_doubted": down_weighted,
        "receiver_sog_late_s": late.sog,
        "receiver_cog_late_s": late.cog,
        **motion.summary(),
        "gaps": len(holes),
        "longest_gap_s": max((stop - start for start, stop in holes), default=0.0),
        "distance_m": distance(motion),
        "nis_mean": float(accepted.mean()) if len(accepted) else math.nan,
        "episodes": [each.as_dict() for each in episodes_of(fixes, motion)] if fixes.mmsi is None else [],
        "notes": list(fixes.notes),
    }


def sentences(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """The summary as (what, value) pairs: the result first, then the log, then the model."""
    s = summary
    status = ", ".join(f"{s[f'rows_{name}']} {name}" for name in STATUSES if s[f"rows_{name}"])
    vessels = [] if s["vessels"] == 1 else [("vessels", str(s["vessels"]))]
    return [
        ("speed over ground", f"median {_speed(s['sog_median_mps'])}, highest {_speed(s['sog_max_mps'])}"),
        ("course defined", f"{s['course_defined_pct']:.1f} % of rows"),
        ("typical 1σ", _deviations(s)),
        ("distance", f"{s['distance_m'] / 1000.0:.2f} km ({s['distance_m'] / NAUTICAL_MILE:.2f} NM) under way"),
        ("estimate", which_estimate(s["smoothed"])),
        *([("motion", "of the hull: the antenna rolls")] if s["of_hull"] else []),
        *([] if vessels else [("episodes", in_words(s["episodes"]))]),
        ("rows", f"{s['rows']}: {status}"),
        *([("rejected", _REJECTED)] if vessels and s["rows_rejected"] else []),
        ("time", f"{s['start']} to {s['stop']} ({_duration(s['duration_s'])})"),
        ("source", s["source"] or "the only source"),
        *vessels,
        ("fixes", f"{s['fixes']}, {_gaps(s)}"),
        *_receiver(s),
        *([("NIS", f"{s['nis_mean']:.2f} (2 expected)")] if math.isfinite(s["nis_mean"]) else []),
        ("profile", s["profile"]),
        *((f"  weight {each['weight']:.2f}", _structure(each)) for each in s["structures"] if each["weight"]),
    ]


def which_estimate(smoothed: bool) -> str:
    """Which fixes each row of an estimate uses, in words."""
    return "smoothed: every row uses the whole log" if smoothed else "causal: every row uses the fixes up to its time"


def _gaps(s: dict[str, Any]) -> str:
    if not s["gaps"]:
        return "no gap"
    return (
        f"1 gap of {s['longest_gap_s']:.1f} s"
        if s["gaps"] == 1
        else (f"{s['gaps']} gaps, the longest {s['longest_gap_s']:.1f} s")
    )


def _receiver(s: dict[str, Any]) -> list[tuple[str, str]]:
    """Down-weighted fixes and the delay of the receiver's SOG and COG, where there are any."""
    found = []
    if s["fixes_doubted"]:
        found.append(f"{s['fixes_doubted']} fixes of poor reported accuracy, down-weighted")
    late = [
        f"{name} {'lags' if lag > 0.0 else 'leads'} the estimate by {abs(lag):.1f} s"
        for name, lag in (("SOG", s["receiver_sog_late_s"]), ("COG", s["receiver_cog_late_s"]))
        if math.isfinite(lag)
    ]
    found.extend(late)
    contradicted = sum(int(each["rows"]) for each in s["episodes"] if each["kind"] == CONTRADICTED)
    if contradicted:
        hint = "" if s["aids"] else " (use --aid auto)"
        found.append(f"its own SOG contradicts the estimate in {contradicted} rows{hint}")
    return [("receiver", "; ".join(found))] if found else []


def _deviations(s: dict[str, Any]) -> str:
    cog = f"COG {s['cog_std_median_deg']:.2f}°" if math.isfinite(s["cog_std_median_deg"]) else "no course"
    return f"SOG {s['sog_std_median_mps']:.3f} m/s, {cog}, position {s['position_std_median_m']:.2f} m"


def _structure(each: dict[str, Any]) -> str:
    known = math.isfinite(each["log_evidence"])
    return each["words"] + (f" (log evidence {each['log_evidence']:.1f})" if known else " (prior values, not fitted)")


def _speed(mps: float) -> str:
    return f"{mps:.2f} m/s ({mps / KNOT:.2f} kn)"


def _duration(seconds: float) -> str:
    hours, rest = divmod(round(seconds), 3600)
    minutes, seconds = divmod(rest, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {seconds:02d} s"
