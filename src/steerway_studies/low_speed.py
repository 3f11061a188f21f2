"""Study low-speed: error against speed, 0 to 3 m/s, and the speed below which course had better be called undefined.

A boat sails five minutes at one speed on a gently wandering course; the profile is found from the fixes as `estimate`
does it. Estimated twice: as it comes, and with the speed below which course is withheld set next to zero, so that only
the filter's own criterion (four standard deviations of the velocity) withholds it.
"""

import math
from functools import partial

import numpy as np

from steerway.core import wrap_array
from steerway.estimation import Profile, choose_profile, estimate
from steerway.sensors import Gnss, low_cost, white
from steerway_studies.parts import over_cases
from steerway_studies.study import Results, Study, seeds_from, stage

SPEEDS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0)
RECEIVERS = {"low_cost": low_cost(), "white_half_metre": white(0.5), "centimetres": Gnss(white=0.02)}
WORDS = {
    "low_cost": "low-cost receiver",
    "white_half_metre": "white noise of 0.5 m",
    "centimetres": "white noise of 2 cm",
}
SEEDS = 12  # of an inference for every speed and receiver: some ten minutes on two cores
DURATION = 300.0
RATE = 5.0
SETTLING = 60.0
WANDER, WANDER_DECAY = 3e-5, 0.2
"""S_ω and α2 of the boat's course: about ±0.5 °/s."""
NO_LIMIT = 0.01
ORIGIN = (math.radians(1.0), math.radians(10.0))


def sail(speed: float, seed: int):
    """Time, north, east, course (n,) of the true motion."""
    n = round(DURATION * RATE) + 1
    rng = np.random.default_rng([seed, 11])
    left = math.exp(-WANDER_DECAY / RATE)
    kicks = rng.normal(0.0, math.sqrt(WANDER / (2.0 * WANDER_DECAY) * (1.0 - left**2)), n)
    rate = np.zeros(n)
    for k in range(1, n):
        rate[k] = left * rate[k - 1] + kicks[k]
    course = rng.uniform(-math.pi, math.pi) + np.cumsum(rate) / RATE
    way = np.r_[[[0.0, 0.0]], np.column_stack([np.cos(course), np.sin(course)])[:-1] * speed / RATE]
    return np.arange(n) / RATE, *np.cumsum(way, axis=0).T, course


def one(seed: int, receiver: str) -> np.ndarray:
    """(speeds, 2, 4): mean squared errors of COG and SOG, share with a course, share further off than 90°."""
    found = np.empty((len(SPEEDS), 2, 4))
    for i, speed in enumerate(SPEEDS):
        time, north, east, course = sail(speed, seed)
        fixes = RECEIVERS[receiver].fixes(time, north, east, seed, origin=ORIGIN)
        profile = choose_profile(fixes)
        for k, each in enumerate((profile, profile.model_copy(update={"steerageway": NO_LIMIT}))):
            motion = estimate(fixes, each)
            settled = motion.time >= SETTLING
            error = wrap_array(motion.cog - course)[settled]
            known = np.isfinite(error)
            squares = np.mean(error[known] ** 2) if known.any() else math.nan
            wrong = np.mean(np.abs(error[known]) > math.pi / 2.0) if known.any() else math.nan
            found[i, k] = squares, np.nanmean((motion.sog[settled] - speed) ** 2), known.mean(), wrong
    return found


def run(seeds=None, first_seed=0, progress=None) -> Results:
    """The study; `seeds` sorties a speed and receiver, by default 12."""
    chosen = seeds_from(first_seed, seeds, SEEDS)
    results = Results("Error against speed, and where course ends")
    curves = {}
    for i, receiver in enumerate(RECEIVERS):
        step = stage(progress, i / len(RECEIVERS), 1.0 / len(RECEIVERS), WORDS[receiver])
        table = np.array(over_cases(partial(one, receiver=receiver), chosen, progress=step))
        curves[receiver] = cog, sog, share, wrong = _means(table)
        for k, speed in enumerate(SPEEDS):
            key = f"{receiver}_at_{speed:g}".replace(".", "p")
            results.numbers |= {
                f"{key}_cog_rms_deg": math.degrees(cog[k, 0]),
                f"{key}_cog_rms_unlimited_deg": math.degrees(cog[k, 1]),
                f"{key}_sog_rms_mps": sog[k, 0],
                f"{key}_course_defined_pct": 100.0 * share[k, 0],
                f"{key}_course_defined_unlimited_pct": 100.0 * share[k, 1],
                f"{key}_wrong_way_unlimited_pct": 100.0 * wrong[k, 1],
            }
        half = _half_way(share[:, 1])
        results.compare(
            f"{receiver}_half_course_mps", half, f"{WORDS[receiver]}: speed at which half the rows have a course", "m/s"
        )
        worst = math.degrees(np.nanmax(cog[:, 0]))
        results.compare(
            f"{receiver}_cog_rms_worst_deg", worst, f"{WORDS[receiver]}: worst error of a course given, any speed", "°"
        )
        at_rest = 100.0 * share[0, 0]
        results.compare(
            f"{receiver}_course_at_rest_pct",
            at_rest,
            f"{WORDS[receiver]}: a course at rest",
            "%",
            "",
            "≤ 5",
            at_rest <= 5,
        )
    needed = results.numbers["low_cost_half_course_mps"]
    default = Profile.model_fields["steerageway"].default
    results.compare(
        "steerageway_default_mps",
        default,
        "the default below which course is withheld",
        "m/s",
        target=f"where a low-cost receiver begins to have a course, {needed:.2f}, to the tenth",
        met=abs(default - needed) <= 0.1,
    )
    results.figures["error_against_speed"] = (_figure(curves), _CAPTION)
    results.remarks.append(
        "The default stands where the filter, by its own criterion, begins to have a course from a low-cost receiver. "
        "Below, such a receiver's wandering error is at times taken for motion, and the course has an error of 20°; "
        "a better receiver has a course there too: set `steerageway` in its profile."
    )
    return results


def _means(table):
    """Of a table (seeds, speeds, 2, 4) RMS of COG and of SOG, share of rows with a course and of wrong ones in them."""
    with np.errstate(invalid="ignore"):
        share = np.mean(table[..., 2], axis=0)
        weights = np.where(np.isfinite(table[..., 0]), table[..., 2], 0.0)
        total = np.maximum(weights.sum(axis=0), 1e-12)
        cog = np.sqrt(np.nansum(weights * table[..., 0], axis=0) / total)
        wrong = np.nansum(weights * np.nan_to_num(table[..., 3]), axis=0) / total
    cog[share < 1e-3] = np.nan
    return cog, np.sqrt(np.mean(table[..., 1], axis=0)), share, wrong


def _half_way(share) -> float:
    """The speed (interpolated) from which on at least half the rows have a course."""
    k = int(np.flatnonzero(share < 0.5)[-1])
    if k + 1 == len(SPEEDS):
        return math.nan
    part = (0.5 - share[k]) / (share[k + 1] - share[k])
    return float(SPEEDS[k] + part * (SPEEDS[k + 1] - SPEEDS[k]))


_CAPTION = (
    "RMS error of COG, where there is one, and of SOG, and the share of time with a course, against true speed. "
    "Solid: as it comes. Dotted: with no lower limit but the filter's own criterion. Grey: the default steerageway."
)


def _figure(curves):
    from matplotlib.figure import Figure

    from steerway.report import OURS, QUIET, THEIRS

    figure = Figure(figsize=(12.0, 4.5), layout="constrained")
    cog_axes, sog_axes, share_axes = figure.subplots(1, 3)
    for (receiver, (cog, sog, share, _)), color in zip(curves.items(), (OURS, THEIRS, "#38761d"), strict=False):
        for k, style in enumerate(("-", ":")):
            label = WORDS[receiver] if k == 0 else None
            cog_axes.plot(SPEEDS, np.degrees(cog[:, k]), style, color=color, label=label, marker=".")
            share_axes.plot(SPEEDS, 100.0 * share[:, k], style, color=color, label=label, marker=".")
        sog_axes.plot(SPEEDS, sog[:, 0], color=color, label=WORDS[receiver], marker=".")
    cog_axes.set_yscale("log")
    cog_axes.set_ylabel("RMS error of COG (°)")
    sog_axes.set_ylabel("RMS error of SOG (m/s)")
    sog_axes.set_ylim(bottom=0.0)
    share_axes.set_ylabel("time with a course (%)")
    for axes in (cog_axes, sog_axes, share_axes):
        axes.axvline(Profile.model_fields["steerageway"].default, color=QUIET, linewidth=4.0, alpha=0.4)
        axes.set_xlabel("true speed (m/s)")
        axes.set_xlim(0.0, 3.0)
        axes.grid(alpha=0.25)
    share_axes.set_xlim(0.0, 1.0)
    cog_axes.legend(frameon=False, fontsize=8)
    return figure


STUDY = Study("low-speed", "error against speed from 0 to 3 m/s: from where on there is a course", run)
