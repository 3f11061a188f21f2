"""P4's figures 2 and 7 to 11, and what they leave out: widths, weights, circuits, rivals, harder worlds."""

import numpy as np
from matplotlib.figure import Figure

from steerway.core import rms
from steerway.estimation.heading import LearnedHeading
from steerway.report import BAD, OURS, QUIET, THEIRS
from steerway.vessels import RPM
from steerway.vessels import SPRINGER_MAX_DIFFERENCE_RPM as MAX_DIFFERENCE_RPM
from steerway_studies.springer_mission.missions import MissionResult
from steerway_studies.springer_mission.navigators import RIVALS, WeightedBounds, nominal
from steerway_studies.springer_mission.world import ACCEPTANCE, MissionTrack, replayed


def all_figures(lost, weighted, navigator, reference, traces, circuits, unseen, worlds) -> dict:
    """(figure, caption) by stem."""
    return {
        "figure02_bounds": (
            bounds(navigator),
            "P4 figure 2: interval filter estimate between its lower and upper bound (± 1 %)",
        ),
        "figure07_nominal": (
            mission(lost),
            "P4 figure 7: (a) way-point tracking with the incorrect TCM2 model, (b) controller output n_d",
        ),
        "figure08_nominal_heading": (
            headings(lost, "KF, incorrect model"),
            "P4 figure 8: reference, actual and estimated heading, Kalman filter with the incorrect TCM2 model",
        ),
        "figure09_weighted": (
            mission(weighted),
            "P4 figure 9: (a) way-point tracking with the weighted estimate, (b) controller output n_d. With the ideal "
            "weight this is the ideal filter",
        ),
        "figure10_weighted_heading": (
            headings(weighted, "wIKF, ideal weight"),
            "P4 figure 10: reference, actual and estimated heading, weighted interval filter",
        ),
        "figure11_errors": (
            errors(lost, weighted),
            "P4 figure 11: estimation errors of the weighted and the traditional Kalman filter",
        ),
        "widths": (
            widths(traces),
            "Width of the interval filters' bounds, and the hull of 17 filters over the same box: what lies between "
            "them is overestimation",
        ),
        "weights": (
            weights(navigator, reference),
            "The ideal weight (20), w = 0.5 and the learned weight; what each gives for a heading on the ideal "
            "filter's voyage",
        ),
        "circuits": (
            circuit_summary(circuits),
            "Random circuits: waypoints reached and cross-track RMS, ideal against nominal filter",
        ),
        "rivals": (
            rivals(unseen),
            "Heading RMS of each estimator on unseen compasses and circuits, one dot a mission, steered by itself",
        ),
        "worlds": (
            world_errors(worlds),
            "Median heading error a mission in harder worlds: the product filter, and GNSS alone on the same voyages",
        ),
    }


def mission(voyage: MissionTrack) -> Figure:
    """Track with waypoints above, propeller difference below."""
    figure = Figure(figsize=(8.0, 9.0), layout="constrained")
    track, output = figure.subplots(2, 1, height_ratios=(3, 1))
    path = np.vstack([[0.0, 0.0], voyage.circuit])
    track.plot(*path.T, "--", color=QUIET, linewidth=1.0, label="legs")
    track.plot(*voyage.position.T, color=OURS, linewidth=1.6, label="track")
    reached = set(voyage.log.reached)
    for i, (x, y) in enumerate(voyage.circuit):
        colour = OURS if i in reached else BAD
        track.plot(x, y, "o" if i in reached else "x", color=colour, markersize=7)
        track.annotate(f"{i + 1}", (x, y), textcoords="offset points", xytext=(9, 5), color=colour)
    track.plot([], [], "o", color=OURS, label=f"reached, within {ACCEPTANCE:g} m")
    if len(reached) < len(voyage.circuit):
        track.plot([], [], "x", color=BAD, label="missed")
    track.set_aspect("equal", adjustable="datalim")
    track.set_xlabel("x (m)")
    track.set_ylabel("y (m)")
    track.legend(frameon=False, loc="upper left")
    track.grid(alpha=0.25)
    output.step(np.arange(len(voyage.difference)), voyage.difference / RPM, where="post", color=OURS, linewidth=1.0)
    for limit in (-MAX_DIFFERENCE_RPM, MAX_DIFFERENCE_RPM):
        output.axhline(limit, color=BAD, linestyle=":", linewidth=1.0)
    output.set_xlabel("time (s)")
    output.set_ylabel("n_d (rpm)")
    output.grid(alpha=0.25)
    return figure


def headings(voyage: MissionTrack, name: str) -> Figure:
    figure = Figure(figsize=(9.0, 4.5), layout="constrained")
    axes = figure.subplots()
    time = np.arange(len(voyage.heading))
    axes.plot(time, np.degrees(voyage.wanted), color=QUIET, linewidth=1.0, label="reference")
    axes.plot(time, np.degrees(voyage.heading), color=OURS, linewidth=1.8, label="actual")
    axes.plot(time, np.degrees(voyage.estimate), "--", color=THEIRS, linewidth=1.4, label=f"estimated ({name})")
    _finish(axes, "time (s)", "heading from x (°)")
    return figure


def errors(lost: MissionTrack, weighted: MissionTrack) -> Figure:
    figure = Figure(figsize=(9.0, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.plot(-lost.error_deg, color=BAD, linewidth=1.4, label="KF, incorrect model")
    axes.plot(-weighted.error_deg, color=OURS, linewidth=1.4, label="wIKF, ideal weight")
    _finish(axes, "time (s)", "true less estimated heading (°)")
    return figure


def bounds(navigator: WeightedBounds) -> Figure:
    """Early, where bounds are close, and the whole mission."""
    figure = Figure(figsize=(10.0, 4.5), layout="constrained")
    early, whole = figure.subplots(1, 2)
    low, high, _, truth = np.degrees(np.array(navigator.record)).T
    for axes, last in ((early, 300), (whole, len(low))):
        time = np.arange(1, last + 1)
        axes.fill_between(
            time, low[:last], high[:last], color=OURS, alpha=0.18, linewidth=0.0, label="between the bounds"
        )
        axes.plot(time, low[:last], color=OURS, linewidth=0.9, label="lower and upper bound")
        axes.plot(time, high[:last], color=OURS, linewidth=0.9)
        axes.plot(time, truth[:last], color=THEIRS, linewidth=1.5, label="ideal filter")
        _finish(axes, "time (s)", "heading estimate (°)")
    early.set_title("first 300 s", fontsize=10)
    whole.set_title("whole mission", fontsize=10)
    return figure


def widths(traces) -> Figure:
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    axes = figure.subplots()
    names = {
        "interval_width_1pct_deg": ("± 1 %", BAD),
        "interval_width_1pct_4x4_deg": ("± 1 %, 4 × 4 sub-boxes", THEIRS),
        "interval_width_05pct_deg": ("± 0.5 %", OURS),
        "interval_width_01pct_deg": ("± 0.1 %", "#38761d"),
    }
    for key, (label, colour) in names.items():
        width, hull = traces[key].T
        axes.semilogy(width, color=colour, linewidth=1.6, label=label)
        if "4x4" not in key:
            axes.semilogy(hull, ":", color=colour, linewidth=1.2)
    axes.plot([], [], ":", color="black", linewidth=1.2, label="hull of 17 filters, same colour")
    axes.set_ylim(1e-3, None)
    _finish(axes, "time (s)", "width (°)")
    return figure


def weights(navigator: WeightedBounds, reference: MissionTrack) -> Figure:
    figure = Figure(figsize=(9.0, 6.5), layout="constrained")
    weight, heading = figure.subplots(2, 1, sharex=True)
    learned, learned_weights = LearnedHeading(), []
    ideal_of_bank, answer = [], []
    for k in range(len(reference.heading)):
        learned.step(reference.difference[k], reference.readings[k])
        learned_weights.append(learned.weight)
        answer.append(learned.heading)
        low, high = learned.low, learned.high
        after = reference.estimate[min(k + 1, len(reference.estimate) - 1)]
        ideal_of_bank.append((after - low) / (high - low) if high - low > 1e-6 else np.nan)
    time = np.arange(1, len(learned_weights) + 1)
    weight.plot(np.array(navigator.record)[:, 2], color=QUIET, linewidth=1.2, label="ideal weight, interval bounds")
    weight.plot(time, ideal_of_bank, color=OURS, linewidth=1.8, label="ideal weight, hull of 17 filters")
    weight.plot(time, learned_weights, "--", color=THEIRS, linewidth=1.3, label="learned weight, hull of 17 filters")
    weight.set_ylim(0.0, 1.0)
    _finish(weight, "", "weight")
    half = replayed(reference, RIVALS["half_bank"]())
    wrong = replayed(reference, nominal())
    heading.plot(np.degrees(half - reference.heading), color=QUIET, linewidth=1.4, label="w = 0.5, hull of 17 filters")
    heading.plot(np.degrees(wrong - reference.heading), color=BAD, linewidth=1.2, label="nominal filter")
    heading.plot(
        time[:-1],
        np.degrees(np.array(answer[:-1]) - reference.heading[1:]),
        color=THEIRS,
        linewidth=1.6,
        label="learned weight",
    )
    _finish(heading, "time (s)", "heading error (°)")
    return figure


def circuit_summary(circuits: dict[str, list[MissionResult]]) -> Figure:
    figure = Figure(figsize=(10.0, 4.5), layout="constrained")
    reached, cross = figure.subplots(1, 2)
    edges = np.arange(-0.5, 8.5)
    sets = [[each.reached for each in circuits[name]] for name in ("ideal", "nominal")]
    reached.hist(sets, bins=edges, color=[OURS, BAD], label=["ideal filter", "nominal filter"])
    _finish(reached, "waypoints reached of 7", "circuits")
    x, y = ([each.cross_track_rms_m for each in circuits[name]] for name in ("ideal", "nominal"))
    cross.plot(x, y, "o", color=OURS, markersize=4, alpha=0.7)
    ends = [0.9 * min(*x, *y), 1.1 * max(*x, *y)]
    cross.plot(ends, ends, "--", color=QUIET, linewidth=1.0, label="equal")
    cross.set_xscale("log")
    cross.set_yscale("log")
    _finish(cross, "cross-track RMS, ideal filter (m)", "cross-track RMS, nominal filter (m)")
    return figure


NAMES = {
    "ideal": "ideal",
    "scale_state": "scale state",
    "weight_net": "learned weight",
    "correction_net": "learned correction",
    "mmae": "81 models (MMAE)",
    "innovations_net": "innovations only",
    "half_bank": "w = 0.5, hull",
    "nominal": "nominal",
}


def rivals(unseen) -> Figure:
    figure = Figure(figsize=(9.0, 4.8), layout="constrained")
    axes = figure.subplots()
    for i, name in enumerate(NAMES):
        values = np.array([own.heading_rms_deg for own, _ in unseen[name]])
        spread = np.linspace(-0.25, 0.25, len(values)) if len(values) > 1 else [0.0]
        axes.semilogx(values, i + np.asarray(spread), ".", color=OURS, alpha=0.45, markersize=5)
        axes.plot([rms(values)] * 2, [i - 0.35, i + 0.35], color=BAD, linewidth=2.0)
    axes.plot([], [], color=BAD, linewidth=2.0, label="RMS over all missions")
    axes.set_yticks(range(len(NAMES)), list(NAMES.values()))
    axes.invert_yaxis()
    _finish(axes, "heading RMS of a mission (°)", "")
    return figure


def world_errors(worlds) -> Figure:
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    axes = figure.subplots()
    labels = []
    for i, (kind, runs) in enumerate(worlds.items()):
        own = np.array([np.median(each) for each in runs["errors"]])
        for offset, values, colour in ((-0.12, own, OURS), (0.12, np.array(runs["gnss_median"]), THEIRS)):
            spread = np.linspace(-0.08, 0.08, len(values)) if len(values) > 1 else [0.0]
            axes.plot(i + offset + np.asarray(spread), values, ".", color=colour, alpha=0.6)
            axes.plot([i + offset - 0.1, i + offset + 0.1], [np.median(values)] * 2, color=colour, linewidth=2.0)
        labels.append(
            {
                "a": "(a) propellers off",
                "b": "(b) and deviation card",
                "c": "(c) varying current",
                "d": "(d) current varies more",
            }[kind]
        )
    axes.plot([], [], ".", color=OURS, label="product filter")
    axes.plot([], [], ".", color=THEIRS, label="GNSS alone")
    axes.set_xticks(range(len(labels)), labels)
    axes.set_ylim(bottom=0.0)
    _finish(axes, "", "median heading error (°)")
    return figure


def _finish(axes, x, y):
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(alpha=0.25)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(frameon=False, loc="best")
