"""Tracks, and distances from the legs by current."""

import math

import numpy as np

from steerway_studies.at_sea.cases import CRAFT, SHARES, Case, Receiver, waypoints
from steerway_studies.at_sea.sailing import sailed


def all_figures(found, seed) -> dict:
    """Stem → (figure, caption)."""
    return {
        "tracks": (_tracks(seed), _TRACKS),
        "distances": (_by_current(found), _DISTANCES),
    }


_TRACKS = (
    "True tracks of the motorboat round a square of 80 m, from rest and without a compass, by fixes of 0.3 m at 5 Hz "
    "with velocity, in a current towards the north-east of 0, 50 and 80 % of her 2 m/s."
)
_DISTANCES = "RMS distance from the legs of every run, against the current in shares of the boat's speed."


def _tracks(seed):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.2), layout="constrained")
    for axes, share in zip(figure.subplots(1, 3), (0.0, 0.5, 0.8), strict=True):
        case = Case("motorboat", "square", share, 0.25 * math.pi, Receiver("white", 5.0, True))
        run, _ = sailed(case, seed)
        north, east = waypoints(case).T
        axes.plot(east, north, color="0.6", linewidth=1.0)
        axes.plot(run["true_east"], run["true_north"], linewidth=1.2)
        axes.set_aspect("equal")
        axes.set_title(f"current {share * CRAFT['motorboat'].boat.cruise:g} m/s")
        axes.set_xlabel("east (m)")
        axes.set_ylabel("north (m)")
        axes.grid(alpha=0.25)
    return figure


def _by_current(found):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.2), layout="constrained")
    for axes, craft in zip(figure.subplots(1, len(CRAFT)), CRAFT, strict=True):
        for errors, colour in (("rtk", "C0"), ("white", "C1"), ("wandering", "C2")):
            runs = [each for each in found if each.case.craft == craft and each.case.receiver.errors == errors]
            shares = np.array([each.case.share for each in runs])
            moved = {"rtk": -0.015, "white": 0.0, "wandering": 0.015}[errors]
            axes.plot(100.0 * (shares + moved), [each.legs for each in runs], ".", color=colour, label=errors)
        axes.set_title(craft)
        axes.set_yscale("log")
        axes.set_xticks([100.0 * share for share in SHARES])
        axes.set_xlabel("current (% of the boat's speed)")
        axes.set_ylabel("RMS distance (m)")
        axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize=8)
    return figure
