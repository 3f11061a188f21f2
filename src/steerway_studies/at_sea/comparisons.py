"""The numbers of the study and their targets."""

import math

import numpy as np

from steerway.core import rms
from steerway_studies.at_sea.cases import CRAFT, SHARES, SHIP_LENGTH, VARIANTS

SMALL = ("otter", "motorboat")


def compare_all(results, found, without) -> None:
    """`found`: the runs; `without`: those with something taken away."""
    results.section = "Finished"
    _finished(results, found)
    results.section = "Distance from the legs"
    _legs(results, found)
    results.section = "What each part is worth"
    _ablations(results, without)
    results.remarks.append(
        "Legs count from 20 s after a turn begins (the ship: 600 s), the first from twice that. The boat's speed is "
        "that of her route: the Otter 1.2 m/s, the motorboat 2 m/s, which is all she has, the Mariner 15 knots. The "
        "turn radius is that over ground with the current, (U + V)/ω for the largest rate ω that is ordered. "
        "Positions are 0.2 s late, and known to be."
    )


def _pooled(runs) -> float:
    """Root mean square of the runs' distances; unknown where one has none."""
    legs = np.array([each.legs for each in runs])
    return rms(legs) if np.isfinite(legs).all() else math.nan


def _finished(results, found):
    for key, shares, least in (("finished_pct_50", SHARES[:3], 99.5), ("finished_pct_80", SHARES[3:], 97.0)):
        runs = [each for each in found if each.case.share in shares]
        value = 100.0 * float(np.mean([each.finished for each in runs]))
        what = f"routes finished, currents {'up to 50' if len(shares) > 1 else 'of 80'} % ({len(runs)})"
        results.compare(key, value, what, "%", target=f"≥ {least:g}", met=value >= least)
    stops = sum(each.own_stop for each in found)
    what = f"runs that the autopilot aboard had stopped by its own gate (of {len(found)})"
    results.compare("own_gate_stops", stops, what, target="0", met=stops == 0)


def _legs(results, found):
    for key, velocity, most in (("leg_rms_velocity_m", True, 0.3), ("leg_rms_positions_m", False, 0.8)):
        runs = [
            each
            for each in found
            if each.case.craft in SMALL
            and each.case.share <= 0.5
            and each.case.receiver.errors != "wandering"
            and each.case.receiver.rate >= 5.0
            and each.case.receiver.velocity is velocity
        ]
        value = _pooled(runs)
        what = (
            f"RMS distance, {'with velocity' if velocity else 'positions only'}, ≥ 5 Hz, currents ≤ 50 % ({len(runs)})"
        )
        results.compare(key, value, what, "m", target=f"≤ {most:g}", met=value <= most)
        for craft in SMALL:
            for errors in ("rtk", "white"):
                part = [each for each in runs if each.case.craft == craft and each.case.receiver.errors == errors]
                name = f"{key.removesuffix('_m')}_{craft}_{errors}_m"
                results.compare(name, _pooled(part), f"{craft}, {errors} ({len(part)})", "m")
    for velocity in (True, False):
        runs = [
            each
            for each in found
            if each.case.craft in SMALL
            and each.case.receiver.errors == "wandering"
            and each.case.receiver.velocity is velocity
            and each.case.share <= 0.5
        ]
        word = "velocity" if velocity else "positions"
        what = f"wandering receiver, relative to its slow error, {word} ({len(runs)})"
        results.compare(f"leg_rms_wandering_{word}_m", _pooled(runs), what, "m")
    ship = [each for each in found if each.case.craft == "mariner" and each.case.share <= 0.5]
    value = _pooled(ship) / SHIP_LENGTH
    what = f"Mariner, RMS distance in ship lengths, currents ≤ 50 % ({len(ship)})"
    results.compare("mariner_leg_rms_lengths", value, what, target="≤ 0.1", met=value <= 0.1)
    for craft in CRAFT:
        corners = [each.corners for each in found if each.case.craft == craft and each.case.share <= 0.5]
        worst = float(np.nanmax(corners)) if corners else math.nan
        what = f"{craft}: largest distance from the route at corners, in turn radii, currents ≤ 50 %"
        results.compare(f"corner_radii_{craft}", worst, what, target="≤ 1.5", met=worst <= 1.5)


def _ablations(results, without):
    for variant, words in VARIANTS.items():
        runs = [each for each in without if each.case.variant == variant]
        name = (variant or "none").replace("-", "_")
        done = 100.0 * float(np.mean([each.finished for each in runs]))
        kept = [each.legs for each in runs if math.isfinite(each.legs)]
        distance = f"{words}: RMS distance, current 50 % ({len(runs)})"
        results.compare(f"without_{name}_leg_rms_m", rms(kept), distance, "m")
        results.compare(f"without_{name}_finished_pct", done, f"{words}: finished", "%")
