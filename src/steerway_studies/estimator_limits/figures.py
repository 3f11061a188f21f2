"""Figures of the study."""

import numpy as np
from matplotlib.figure import Figure

from steerway.report import BAD, OURS, QUIET, THEIRS
from steerway_studies.estimator_limits import accuracy, aided, correlated, held
from steerway_studies.estimator_limits.cells import CELLS, PLACES, WHAT, WHERE, WORDS

_GREEN = "#38761d"
_QUANTITY = {"sog": "SOG", "cog": "COG", "rate": "rate"}


def all_figures(numbers, bias_errors) -> dict:
    """(figure, caption) by stem. `bias_errors`: (runs, n) error of the estimated bias of the gyro, rad/s."""
    return {
        "ratios": (
            _ratios(
                numbers,
                {
                    "": ("true parameters", "o"),
                    "tuned_": ("tuned from one earlier voyage", "s"),
                    "default_": ("default", "^"),
                    "particles_": ("filter of many histories of modes", "x"),
                },
                lambda name, what, where: accuracy.target(name, "", what, where),
            ),
            "Error of the filter over its bound, with 95 % intervals. Black: targets with the true parameters.",
        ),
        "smoothed": (
            _ratios(
                numbers,
                {
                    "smoothed_": ("smoothed, true parameters", "o"),
                    "histories_": ("smoother by all histories of modes", "s"),
                    "known_": ("smoother with known modes", "^"),
                },
                lambda name, what, where: accuracy.SMOOTHED_TARGET,
            ),
            "Error of the smoother over the smoothing bound, which supposes known modes. With unknown modes the best "
            "estimate weighs all their histories, here by sampling. Black: the target.",
        ),
        "consistency": (
            _consistency(numbers),
            "NIS of a fix, and NEES of speed, course and course rate. Grey: the target band, and the expectation; "
            "dashed: 1.5 times that. Blue: straight; red: in turns; black: all along.",
        ),
        "wandering_receivers": (
            _correlated(numbers, correlated.WORDS),
            "Error of COG with correlated receiver errors.",
        ),
        "gyro_bias": (
            _bias(bias_errors, aided.CELL.scenario.rate, aided.FOUND * aided.GYRO_BIAS),
            "Error of a gyro's bias as estimated from fixes of 0.5 m. Grey band: a fifth of the bias.",
        ),
        "held": (
            _held(numbers, held.WORDS_OF_CHANGES),
            "Cost of dwell times three times longer or shorter, or of noise densities three times larger or smaller, "
            "than the filter supposes. Dashed: the target. Black: the cost for a filter of 300 histories of modes.",
        ),
    }


def _point(axes, x, numbers, key, color, label=None, marker="o"):
    value, low, high = (numbers[each] for each in (key, f"{key}_low", f"{key}_high"))
    error = [[max(value - low, 0.0)], [max(high - value, 0.0)]]
    axes.errorbar(x, value, error, fmt=marker, color=color, markersize=5, capsize=2, linewidth=1.2, label=label)


def _axes(title_left, title_right):
    figure = Figure(figsize=(13.0, 4.8), layout="constrained")
    pair = figure.subplots(1, 2)
    for axes, title in zip(pair, (title_left, title_right), strict=True):
        axes.set_title(title, fontsize=10)
        axes.axhline(1.0, color=QUIET, linewidth=1.0)
        axes.grid(alpha=0.25, axis="y")
        axes.set_yscale("log")
        ticks = [1.0, 1.15, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 6.0, 10.0]
        axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
    pair[0].set_ylabel("RMS error over its bound")
    return figure, pair


def _groups(axes):
    names = [f"{_QUANTITY[what]}\n{WORDS[name] if what == 'cog' else ''}" for name in CELLS for what in WHAT]
    axes.set_xticks(range(len(names)), names, fontsize=8)
    for x in range(len(WHAT), len(names), len(WHAT)):
        axes.axvline(x - 0.5, color=QUIET, linewidth=0.6)


def _ratios(numbers, kinds, targets) -> Figure:
    """Error over bound, straight and in turns, by cell and quantity; `kinds` is key → (words, marker)."""
    figure, pair = _axes("straight", "in turns")
    colors = dict(zip(kinds, (OURS, THEIRS, _GREEN, BAD), strict=False))
    for axes, where in zip(pair, WHERE, strict=True):
        x = 0
        for name in CELLS:
            for what in WHAT:
                target = targets(name, what, where)
                if target:
                    axes.plot([x - 0.4, x + 0.4], [target, target], color="black", linewidth=1.2)
                for i, (kind, (words, marker)) in enumerate(kinds.items()):
                    key = f"{kind}{name}_{what}_{where}_ratio"
                    if key in numbers:
                        shift = 0.18 * (i - 0.5 * (len(kinds) - 1))
                        _point(axes, x + shift, numbers, key, colors[kind], words if x == 0 else None, marker)
                x += 1
        _groups(axes)
    pair[1].set_ylim(pair[0].get_ylim())
    pair[0].legend(frameon=False, fontsize=8)
    return figure


_DOUBTERS = (
    ("", "o", ""),
    ("particles_", "x", "… of the filter of many histories, "),
    ("known_filter_", "^", "… of the filter with known modes, "),
)


def _consistency(numbers) -> Figure:
    """NIS and NEES of every cell with their intervals and bands."""
    figure = Figure(figsize=(13.0, 4.0), layout="constrained")
    nis, nees = figure.subplots(1, 2)
    nis.axhspan(1.9, 2.1, color=QUIET, alpha=0.3, linewidth=0)
    nees.axhline(3.0, color=QUIET, linewidth=1.0)
    nees.axhline(4.5, color="black", linewidth=1.0, linestyle="--")
    variants = (("", OURS, "true parameters"), ("tuned_", THEIRS, "tuned"), ("default_", _GREEN, "as it comes"))
    for x, name in enumerate(CELLS):
        for i, (kind, color, words) in enumerate(variants):
            _point(nis, x + 0.15 * (i - 1), numbers, f"{kind}{name}_nis", color, words if x == 0 else None)
        for i, (where, color) in enumerate((("straight", OURS), ("turn", BAD), ("all", "black"))):
            for shift, (who, marker, words) in zip((-0.06, 0.0, 0.06), _DOUBTERS, strict=True):
                label = f"{words}{PLACES[where]}" if x == 0 and (not who or where == "straight") else None
                key = f"{who}{name}_nees_{where}"
                _point(nees, x + 0.25 * (i - 1) + shift, numbers, key, color, label, marker)
    for axes, title in ((nis, "mean NIS"), (nees, "mean NEES of (U, χ, ω)")):
        axes.set_xticks(range(len(CELLS)), [WORDS[name] for name in CELLS])
        axes.set_ylabel(title)
        axes.grid(alpha=0.25, axis="y")
        axes.legend(frameon=False, fontsize=8, ncols=2, loc="upper center")
    nees.set_yscale("log")
    nees.set_ylim(0.9, 30.0)
    nees.set_yticks([1, 2, 3, 4.5, 10, 15], ["1", "2", "3", "4.5", "10", "15"])
    nees.minorticks_off()
    return figure


def _held(numbers, changes) -> Figure:
    """Cost in % of every cell and quantity by change."""
    figure = Figure(figsize=(13.0, 4.8), layout="constrained")
    pair = figure.subplots(1, 2, sharey=True)
    for axes, where, title in zip(pair, WHERE, ("straight", "in turns"), strict=True):
        axes.set_title(title, fontsize=10)
        axes.axhline(25.0, color="black", linewidth=1.0, linestyle="--")
        axes.axhline(0.0, color=QUIET, linewidth=1.0)
        for i, (change, words) in enumerate(changes.items()):
            keys = [f"held_{name}_{change}_{what}_{where}_pct" for name in CELLS for what in WHAT]
            x = np.arange(len(keys)) + 0.18 * (i - 1.5)
            color = (OURS, THEIRS, _GREEN, BAD)[i]
            axes.bar(x, [numbers[key] for key in keys], 0.17, color=color, label=words)
            weighed = [numbers.get(key.replace("held_", "held_particles_", 1), np.nan) for key in keys]
            axes.plot(x, weighed, "_", color="black", markersize=6, label="filter of 300 histories" if i == 3 else None)
        _groups(axes)
        axes.grid(alpha=0.25, axis="y")
    pair[0].set_ylabel("cost of parameters held (%)")
    pair[0].legend(frameon=False, fontsize=8)
    return figure


def _correlated(numbers, scenes) -> Figure:
    """RMS of COG with wandering receivers; `scenes` is key → words."""
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    pair = figure.subplots(1, 2, sharey=True)
    who = (
        ("", OURS, "receiver known"),
        ("default_", _GREEN, "as it comes"),
        ("printed_filter_", BAD, "printed filter"),
    )
    for axes, where, title in zip(pair, WHERE, ("straight", "in turns"), strict=True):
        for x, scene in enumerate(scenes):
            for i, (variant, color, words) in enumerate(who):
                key = f"{variant}{scene}_cog_{where}_deg"
                if key in numbers:
                    _point(axes, x + 0.15 * (i - 1), numbers, key, color, words if x == 0 else None)
        axes.set_title(title, fontsize=10)
        axes.set_xticks(range(len(scenes)), [words.replace(", ", "\n") for words in scenes.values()], fontsize=8)
        axes.set_xlim(-0.5, len(scenes) - 0.5)
        axes.grid(alpha=0.25, axis="y")
    pair[0].set_ylabel("RMS of COG (°)")
    pair[0].set_yscale("log")
    pair[0].set_yticks([0.3, 0.5, 1, 2, 3, 5, 10], ["0.3", "0.5", "1", "2", "3", "5", "10"])
    pair[0].minorticks_off()
    pair[0].legend(frameon=False, fontsize=8)
    return figure


def _bias(errors, rate, limit) -> Figure:
    """How a gyro's bias is found: error of every run (runs, n) and their RMS, °/s over s."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    axes = figure.subplots()
    time = np.arange(errors.shape[1]) / rate
    axes.plot(time, np.degrees(errors.T), color=QUIET, linewidth=0.5, alpha=0.6)
    axes.plot(time, np.degrees(np.sqrt(np.mean(errors**2, axis=0))), color=OURS, linewidth=1.8, label="RMS of the runs")
    axes.axhspan(-np.degrees(limit), np.degrees(limit), color=QUIET, alpha=0.25, linewidth=0)
    axes.axvline(60.0, color="black", linewidth=1.0, linestyle="--", label="target")
    axes.set_xlim(0.0, 90.0)
    axes.set_ylim(-0.5, 0.5)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("error of the bias found (°/s)")
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize=8)
    return figure
