"""Study ais-prediction: where vessels will be, on the Solent log, against dead reckoning on what they transmit.

Every half minute of every vessel's record is made the present: the filter knows what was reported so far, and predicts
the position. The report that arrives then, interpolated between neighbours no more than 20 s apart, is what it is
judged by; its own error (position and moment) is added to the predicted covariance. Dead reckoning goes on from the
last report on its SOG and COG.
"""

import math

import numpy as np

from steerway import read
from steerway.core import Fixes, displacement, wrap
from steerway.estimation import choose_profile, hindcast
from steerway_studies.recorded import logs_folder
from steerway_studies.study import Results, Study

LOG = "solent_ais/SolentAIS_20160112_130211.csv"
HORIZONS = (30.0, 60.0, 120.0, 300.0, 600.0)
SPACING = 30.0
WIDEST_GAP = 20.0
LEAST_SOG = 0.5
CHI_SQUARE = 5.991  # two degrees of freedom, 95 %


def judged_predictions(fixes: Fixes, profile=None, aid=("sog", "cog"), horizons=HORIZONS) -> np.ndarray:
    """Predictions from the past of a record, compared with the reports that followed.

    Returns (n, 6): horizon, SOG transmitted at the time, error (m), error of dead reckoning (m; NaN where no course is
    transmitted), squared error in units of its covariance, area of the 95 % ellipse (m²).
    """
    profile = choose_profile(fixes, profile, aid)
    rows = []
    for _, track in fixes.rows(fixes.has_position).in_order().tracks():
        origins, prediction = hindcast(track, horizons, SPACING, profile, aid)
        for i, k in enumerate(np.repeat(origins, len(horizons))):
            if (there := _reported(track, prediction.time[i])) is not None:
                rows.append((prediction.horizon[i], track.sog[k], *_judged(track, k, prediction, i, profile, there)))
    return np.array(rows).reshape(-1, 6)


def _reported(track, moment):
    """Latitude and longitude at a moment between two reports; None where they are too far apart."""
    j = int(np.searchsorted(track.time, moment))
    if j == 0 or j == len(track) or track.time[j] - track.time[j - 1] > WIDEST_GAP:
        return None
    share = (moment - track.time[j - 1]) / max(track.time[j] - track.time[j - 1], 1e-9)
    turned = wrap(track.longitude[j] - track.longitude[j - 1])
    latitude = track.latitude[j - 1] + share * (track.latitude[j] - track.latitude[j - 1])
    return latitude, wrap(track.longitude[j - 1] + share * turned)


def _judged(track, k, prediction, i, profile, there):
    """Row i of a prediction from row k of a track against the report `there`: the last four columns."""
    latitude, longitude, horizon = prediction.latitude[i], prediction.longitude[i], prediction.horizon[i]
    north, east = displacement(*there, latitude, longitude)
    sailed = displacement(latitude, longitude, track.latitude[k], track.longitude[k])
    mistimed, white = (profile.time_std / horizon) ** 2, profile.position_std**2
    nn = prediction.variance_north[i] + white + mistimed * sailed[0] ** 2
    ee = prediction.variance_east[i] + white + mistimed * sailed[1] ** 2
    ne = prediction.covariance[i] + mistimed * sailed[0] * sailed[1]
    determinant = nn * ee - ne * ne
    squared = (north * north * ee - 2.0 * north * east * ne + east * east * nn) / determinant
    reckoned = displacement(*there, track.latitude[k], track.longitude[k])
    way = track.sog[k] * horizon
    reckoning = math.hypot(reckoned[0] - way * math.cos(track.cog[k]), reckoned[1] - way * math.sin(track.cog[k]))
    return math.hypot(north, east), reckoning, squared, math.pi * CHI_SQUARE * math.sqrt(determinant)


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """The study; there is nothing random in it."""
    fixes = read(logs_folder() / LOG)
    if progress:
        progress(0.1, "predicting")
    found = judged_predictions(fixes)
    results = Results("Motion prediction from AIS: The Solent, 84 minutes, 91 vessels")
    moving = found[(found[:, 1] >= LEAST_SOG) & np.isfinite(found[:, 3])]
    for horizon in HORIZONS:
        rows, everyone = moving[moving[:, 0] == horizon], found[found[:, 0] == horizon]
        name, key = f"{horizon:.0f} s ahead", f"at_{horizon:.0f}s"
        ours, reckoned = np.median(rows[:, 2]), np.median(rows[:, 3])
        coverage = 100.0 * np.mean(rows[:, 4] < CHI_SQUARE)
        named = horizon in (30.0, 120.0, 300.0, 600.0)
        at_two = horizon == 120.0
        results.compare(
            f"error_median_{key}_m",
            ours,
            f"{name}: median error, {len(rows)} predictions of vessels under way",
            "m",
            target=f"below dead reckoning's {reckoned:.1f} m" if at_two else "",
            met=ours < reckoned if at_two else None,
        )
        results.compare(f"dead_reckoning_median_{key}_m", reckoned, f"{name}: dead reckoning, median error", "m")
        results.compare(f"error_q90_{key}_m", np.quantile(rows[:, 2], 0.9), f"{name}: error not exceeded by 90 %", "m")
        results.compare(
            f"dead_reckoning_q90_{key}_m",
            np.quantile(rows[:, 3], 0.9),
            f"{name}: error of dead reckoning not exceeded by 90 %",
            "m",
        )
        results.compare(
            f"coverage_{key}_pct",
            coverage,
            f"{name}: inside the 95 % ellipse",
            "%",
            target="90 to 98 %" if named else "",
            met=90.0 <= coverage <= 98.0 if named else None,
        )
        results.compare(
            f"coverage_all_{key}_pct",
            100.0 * np.mean(everyone[:, 4] < CHI_SQUARE),
            f"{name}: inside the 95 % ellipse, moored vessels included, {len(everyone)} predictions",
            "%",
        )
        results.compare(
            f"ellipse_radius_median_{key}_m",
            np.median(np.sqrt(rows[:, 5] / math.pi)),
            f"{name}: radius of a circle as large as the ellipse, median",
            "m",
        )
    results.figures["errors"] = (_errors(moving), _ERRORS)
    results.figures["vessels"] = (_map(fixes), _MAP)
    results.remarks += [
        "The numbers of the profile `ais` were chosen on this log, the only one with tracks that we have.",
        "Half of what is sailed here are ferries and pilots, whose next turn no past foretells; ships are covered more "
        "often than 95 %, ferries less: one profile serves both.",
        "A moored vessel that casts off within the horizon lies outside its ellipse: predictions are of vessels that "
        "keep their motion.",
    ]
    return results


_ERRORS = (
    "Error of predictions over the horizon, vessels under way: median (solid) and what 90 % do not exceed (dashed), "
    "and the share of reports inside the 95 % ellipse with the band of 90 to 98 %."
)
_MAP = "Three vessels: their reports, and predictions 120, 300 and 600 s ahead from one moment, with 95 % ellipses."


def _errors(rows):
    from matplotlib.figure import Figure

    from steerway.report import OURS, THEIRS

    figure = Figure(figsize=(11.0, 4.5), layout="constrained")
    error, coverage = figure.subplots(1, 2)
    by_horizon = [rows[rows[:, 0] == horizon] for horizon in HORIZONS]
    for column, color, name in ((2, OURS, "predicted"), (3, THEIRS, "dead reckoning")):
        for q, style in ((0.5, "-"), (0.9, "--")):
            values = [np.quantile(each[:, column], q) for each in by_horizon]
            label = f"{name}, {'median' if q == 0.5 else '90 %'}"
            error.loglog(HORIZONS, values, style, color=color, marker="o", markersize=4, label=label)
    error.set_ylabel("error of position (m)")
    coverage.semilogx(HORIZONS, [100.0 * np.mean(e[:, 4] < CHI_SQUARE) for e in by_horizon], "o-", color=OURS)
    coverage.axhspan(90.0, 98.0, color=OURS, alpha=0.12, label="90 to 98 %")
    coverage.set_ylim(80.0, 100.0)
    coverage.set_ylabel("inside the 95 % ellipse (%)")
    for axes in (error, coverage):
        axes.set_xlabel("horizon (s)")
        axes.set_xticks(HORIZONS, [f"{horizon:.0f}" for horizon in HORIZONS])
        axes.minorticks_off()
        axes.grid(alpha=0.25)
        axes.legend(frameon=False)
    return figure


def _map(fixes):
    from matplotlib.figure import Figure
    from matplotlib.patches import Ellipse

    from steerway.estimation import predict
    from steerway.report import OURS, QUIET

    figure = Figure(figsize=(12.0, 4.5), layout="constrained")
    for axes, (track, k) in zip(figure.subplots(1, 3), _busiest(fixes, 3), strict=True):
        middle = track.time[k]
        past = track.rows(slice(0, k + 1))
        origin = track.latitude[k], track.longitude[k]
        places = np.array([displacement(a, b, *origin) for a, b in zip(track.latitude, track.longitude, strict=True)])
        shown = (track.time > middle - 600.0) & (track.time < middle + 600.0)
        axes.plot(*places[shown][:, ::-1].T, ".", color=QUIET, markersize=3, label="reports, ±10 min")
        prediction = predict(past, (120.0, 300.0, 600.0))
        longer, shorter, direction = prediction.ellipse
        for k in range(len(prediction)):
            north, east = displacement(prediction.latitude[k], prediction.longitude[k], *origin)
            i = int(np.argmin(np.abs(track.time - prediction.time[k])))
            color = ("#0b5394", "#8e44ad", "#38761d")[k]
            axes.plot(east, north, "+", color=color, markersize=9)
            axes.plot(places[i, 1], places[i, 0], "o", color=color, markersize=5)
            tilt = 90.0 - math.degrees(direction[k])
            outline = Ellipse((east, north), 2.0 * longer[k], 2.0 * shorter[k], angle=tilt, fill=False, color=color)
            axes.add_patch(outline)
            outline.set_label(f"{prediction.horizon[k]:.0f} s: predicted +, came to be ●")
        axes.plot(0.0, 0.0, "k^", markersize=6, label="now")
        axes.set_aspect("equal", adjustable="datalim")
        axes.autoscale_view()
        axes.set_xlabel("east (m)")
        axes.grid(alpha=0.25)
        axes.set_title(f"MMSI {track.mmsi[0]}", color=OURS, fontsize=10)
    figure.axes[0].set_ylabel("north (m)")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    return figure


def _busiest(fixes, count):
    """(track, row) of the vessels with most reports that go on at more than 3 m/s for ten minutes after that row."""
    found = []
    for _, track in sorted(fixes.tracks(), key=lambda each: -len(each[1])):
        for k in range(20, len(track), 10):
            ahead_of = (track.time >= track.time[k]) & (track.time <= track.time[k] + 600.0)
            whole = track.time[-1] > track.time[k] + 620.0 and np.diff(track.time[ahead_of]).max(initial=0.0) < 60.0
            if whole and track.sog[ahead_of].min() > 3.0:
                found.append((track, k))
                break
        if len(found) == count:
            break
    return found


STUDY = Study(
    "ais-prediction", "positions to come from AIS, against dead reckoning, with the coverage of ellipses", run
)
