"""The paper's figures 3 to 5 from one run of recipe B, and what the study adds to them."""

import numpy as np
from matplotlib.figure import Figure

from steerway.report import BAD, OURS, QUIET
from steerway_studies.cybership_observers import contestants, scenario, trials
from steerway_studies.cybership_observers.scenario import TIME

RED, BLUE = BAD, OURS
_AXES = ("north (m)", "east (m)")


def all_figures(seed: int, numbers: dict, table: dict) -> dict:
    """Figures by file stem, each with its caption."""
    record = scenario.sail(scenario.drawn(seed))
    filtered = scenario.watch(contestants.time_varying(trials.RECIPE_B), record)
    observed = scenario.watch(contestants.stock_observer(), record)
    best = scenario.watch(contestants.product(), record)
    return {
        "figure3": (_figure3(record, filtered, observed), "Figure 3: estimated position of the proposed observer (red) "
                    "and of the nonlinear observer (blue); true position dashed. Recipe B, one run."),
        "figure4": (_estimate_and_truth(record, filtered), "Figure 4: position estimation using the proposed observer. "
                    "Estimate red, truth blue."),
        "figure5": (_estimate_and_truth(record, observed), "Figure 5: position estimation using the nonlinear "
                    "observer. Estimate red, truth blue."),
        "errors": (_errors(filtered, observed, best), "The same run: error of both, and of the nine-state filter that "
                   "estimates the force."),
        "observers": (_observers(numbers), "Mean |error| over north and east at all times on S*, with 95 % intervals "
                      f"over {numbers['seeds']:.0f} seeds. Dashed: the least that any unbiased estimator can reach."),
        "closed_loop": (_closed_loop(table), "Steered by each estimate: share of runs that end within a distance of "
                        "the goal."),
    }  # fmt: skip


def _figure3(record, filtered, observed):
    figure = Figure(figsize=(7.5, 6.5), layout="constrained")
    axes = figure.subplots()
    axes.plot(observed.places[:, 1], observed.places[:, 0], color=BLUE, lw=1.1, label="nonlinear observer")
    axes.plot(filtered.places[:, 1], filtered.places[:, 0], color=RED, lw=1.1, label="proposed observer")
    axes.plot(record.states[:, 1], record.states[:, 0], "k--", lw=1.4, label="true position")
    axes.set_xlabel(_AXES[1])
    axes.set_ylabel(_AXES[0])
    axes.set_aspect("equal", adjustable="datalim")
    _finish(axes)
    return figure


def _estimate_and_truth(record, run):
    figure = Figure(figsize=(9.0, 5.5), layout="constrained")
    for i, axes in enumerate(figure.subplots(2, 1, sharex=True)):
        axes.plot(TIME, record.states[:, i], color=BLUE, lw=1.6, label="true")
        axes.plot(TIME, run.places[:, i], color=RED, lw=1.0, label="estimated")
        axes.set_ylabel(_AXES[i])
        _finish(axes, legend=i == 0)
    axes.set_xlabel("time (s)")
    return figure


def _errors(filtered, observed, best):
    figure = Figure(figsize=(9.0, 5.5), layout="constrained")
    for i, axes in enumerate(figure.subplots(2, 1, sharex=True, sharey=True)):
        axes.plot(TIME, observed.errors[:, i], color=BLUE, lw=1.0, label="nonlinear observer, stock gains")
        axes.plot(TIME, filtered.errors[:, i], color=RED, lw=1.0, label="time-varying EKF, recipe B")
        axes.plot(TIME, best.errors[:, i], color="black", lw=1.4, label="nine-state EKF")
        axes.set_ylabel(f"error {_AXES[i]}")
        _finish(axes, legend=False)
        if i == 0:
            axes.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    axes.set_xlabel("time (s)")
    return figure


_BARS = (
    ("observer_stock_mae", "nonlinear observer, stock gains, held"),
    ("tekf_mae_all", "time-varying EKF, printed Q, GNSS only"),
    ("hold_mae", "last fix repeated"),
    ("tekf_recipe_b_mae", "time-varying EKF, recipe B"),
    ("tekf_tuned_mae", "time-varying EKF, tuned"),
    ("constant_q_tuned_mae", "constant-Q EKF, tuned"),
    ("observer_tuned_mae", "nonlinear observer, tuned, impulsive"),
    ("ekf9_mae", "nine-state EKF with force"),
    ("rts_mae", "nine-state EKF, smoothed"),
)


def _observers(numbers):
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    axes = figure.subplots()
    values = [numbers[key] for key, _ in _BARS]
    spread = [numbers[f"{key}_ci"] for key, _ in _BARS]
    places = np.arange(len(_BARS))[::-1]
    axes.barh(places, values, xerr=spread, color=[QUIET] * 7 + [OURS] * 2, error_kw={"lw": 1.2})
    for place, value, width in zip(places, values, np.nan_to_num(spread), strict=True):
        axes.text(value + width + 0.002, place, f"{value:.4f}", va="center", fontsize=9)
    axes.axvline(numbers["ekf9_bound"], color="black", ls="--", lw=1.0, label="Cramér–Rao bound of a filter")
    axes.set_yticks(places, [name for _, name in _BARS])
    axes.set_xlabel("mean |error| (m)")
    axes.set_xlim(0.0, 1.15 * max(values))
    axes.grid(axis="x", alpha=0.25)
    axes.legend(frameon=False, loc="lower right")
    return figure


_LOOPS = (
    ("truth", "truth", {"color": "black", "ls": "--"}),
    ("ekf9", "nine-state EKF", {"color": OURS}),
    ("observer_tuned", "nonlinear observer, tuned", {"color": "#6aa84f"}),
    ("tekf_tuned", "time-varying EKF, tuned", {"color": "#e69138"}),
    ("ekf9_gnss_only", "nine-state EKF, no compass", {"color": OURS, "ls": ":"}),
    ("tekf_gnss_only", "time-varying EKF, printed, no compass", {"color": RED, "ls": ":"}),
)


def _closed_loop(table):
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    axes = figure.subplots()
    for name, label, style in _LOOPS:
        distances = np.sort(table[f"closed_loop_{name}"])
        axes.step(
            distances, 100.0 * np.arange(1, len(distances) + 1) / len(distances), where="post", label=label, **style
        )
    axes.axhline(95.0, color=QUIET, lw=0.8)
    axes.set_xscale("log")
    axes.set_xticks([0.1, 0.3, 1.0, 3.0, 10.0, 30.0], ["0.1", "0.3", "1", "3", "10", "30"])
    axes.minorticks_off()
    axes.set_xlim(0.05, 100.0)
    axes.set_xlabel("distance from the goal after 100 s (m)")
    axes.set_ylabel("runs (%)")
    _finish(axes)
    return figure


def _finish(axes, legend=True):
    axes.grid(alpha=0.25)
    if legend:
        axes.legend(frameon=False, loc="best")
