"""Whether the filter is consistent, and what the form of its correction gains: filters with known modes.

The filter that knows when turns begin and end has nothing to find out: its NEES has to be right, straight and in
turns. The form of a correction is that of a pose in the plane (`rotate_correction`) or the textbook's, which adds a
gain times the innovation to every state.
"""

import math

import numpy as np

from steerway.core import kernel
from steerway.estimation.course import LEAVING
from steerway_studies.estimator_limits.cells import CELLS, PLACES, QUANTITIES, WHAT, WHERE, WORDS, over_cells, sums
from steerway_studies.estimator_limits.consistency import nees, report_nees
from steerway_studies.estimator_limits.particles import begun, go, in_plane, particle_filter, steps
from steerway_studies.estimator_limits.scenarios import straight_and_turning
from steerway_studies.estimator_limits.statistics import errors, over_runs
from steerway_studies.study import Results

SEEDS = 30
HISTORIES = {"o05": 300, "o25": 300}
"""Enough to compare two forms by; in M, where turns are slow, the form matters to nobody."""
POOR_COURSE_STD, EARLY = math.radians(60.0), 60.0
"""A course all but unknown to begin with, and for how long it tells (s)."""
FORMS = {"invariant": True, "textbook": False}
KINDS = {
    "known": "known modes",
    "early": f"known modes, course known to {math.degrees(POOR_COURSE_STD):.0f}° at first, first minute",
    "weighing": "weighing 300 histories of modes",
    "one_model": "one motion model, that of the average",
}


def known_mode_filter(places, start, turning, models, dt, invariant=True) -> tuple[np.ndarray, np.ndarray]:
    """(n, 5) states and (n, 5, 5) covariances of an extended Kalman filter that knows the mode (n,) of every step."""
    step, _ = steps(models, dt)
    x, p = np.empty((len(places), 5)), np.empty((len(places), 5, 5))
    x[0], p[0] = start
    _known(places, turning.astype(np.int64), models, step, invariant, x, p)
    return x, np.triu(p) + np.swapaxes(np.triu(p, 1), 1, 2)


@kernel
def _known(places, mode, models, step, invariant, x, p):
    work = np.empty((5, 5))
    for k in range(1, len(places)):
        m = mode[k - 1]
        x[k], p[k] = x[k - 1], p[k - 1]
        go(x[k], p[k], step[m], models[m], places[k], work, invariant)


def one(name: str, seed: int) -> dict[str, np.ndarray]:
    """`sums` by form and kind of filter on one voyage of a cell, and the NEES of the filter with known modes."""
    cell = CELLS[name]
    voyage, fixes = cell.sailed(seed)
    models, places, dt = cell.profile.modes(), in_plane(fixes), 1.0 / cell.scenario.rate
    average = models.copy()
    average[:, :LEAVING] = cell.profile.on_average.parameters()[0, :LEAVING]  # the same motion model in both modes
    start, poor = begun(voyage, models, seed), begun(voyage, models, seed, POOR_COURSE_STD)
    places_sailed = straight_and_turning(cell.scenario, voyage)
    early = [(voyage.time > 0.0) & (voyage.time <= EARLY)] * 2
    found = {}
    for form, invariant in FORMS.items():
        states, covariance = known_mode_filter(places, start, voyage.turning, models, dt, invariant)
        estimates = {
            "known": (states, places_sailed),
            "early": (known_mode_filter(places, poor, voyage.turning, models, dt, invariant)[0], early),
            "one_model": (known_mode_filter(places, start, voyage.turning, average, dt, invariant)[0], places_sailed),
        }
        if name in HISTORIES:
            weighed, _ = particle_filter(places, start, models, dt, HISTORIES[name], seed, invariant)
            estimates["weighing"] = weighed, places_sailed
        for kind, (of_kind, where) in estimates.items():
            found[f"{form}_{kind}"] = sums(np.square(errors(*of_kind[:, 2:].T, voyage)), where)
        error = errors(*states[:, 2:].T, voyage)
        found[f"{form}_nees"] = nees(error, covariance[:, 2:, 2:], voyage, cell.scenario)
    return found


def measured(seeds, first_seed, progress) -> dict[str, dict[str, np.ndarray]]:
    """Cell → kind → sums, a row a run."""
    return over_cells(one, seeds or SEEDS, first_seed, progress)


def report(results: Results, found) -> None:
    """NEES as comparisons; the cost of the textbook's form as a table of the page."""
    results.section = "Consistency, known modes"
    for form, who in (
        ("invariant", "filter with known modes"),
        ("textbook", "filter with known modes, textbook form"),
    ):
        product = form == "invariant"
        for name, kinds in found.items():
            key = f"known_filter_{name}" if product else f"known_filter_textbook_{name}"
            report_nees(results, key, f"{WORDS[name]}, {who}", kinds[f"{form}_nees"], judged=product)
    cases = [(name, kind) for kind in KINDS for name in found if f"invariant_{kind}" in found[name]]
    rows = [_row(results, name, kind, found[name]) for name, kind in cases]
    results.tables.append((_TITLE, ("filter", "vessel and receiver", *_COLUMNS), rows))


def _row(results, name, kind, kinds):
    row = [KINDS[kind], WORDS[name]]
    for i, what in enumerate(WHAT):
        for k, where in enumerate(WHERE):
            cost = over_runs(kinds[f"textbook_{kind}"][:, k, i], kinds[f"invariant_{kind}"][:, k, i])
            value, low, high = (100.0 * (each - 1.0) for each in cost)
            key = f"textbook_{kind}_{name}_{what}_{where}_pct"
            results.numbers |= {key: value, f"{key}_low": low, f"{key}_high": high}
            if what in _SHOWN:
                row.append("—" if kind == "early" and k else f"{value:z.1f} ({low:z.0f} to {high:z.0f})")
    return row


_SHOWN = ("sog", "cog")
"""Course rate is the same to a hundredth but for one cell."""
_TITLE = "What the textbook's form of a correction costs beside the invariant one: % of the RMS error"
_COLUMNS = tuple(f"{QUANTITIES[what]}, {PLACES[where]}" for what in _SHOWN for where in WHERE)
