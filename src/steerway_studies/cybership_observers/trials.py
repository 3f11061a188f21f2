"""What one seed tells: every observer on the same truth, fix by fix with the same noise."""

import math
from dataclasses import replace
from functools import partial

import numpy as np

from steerway.core import wrap
from steerway.estimation.positioning import TimeVaryingNoise, smooth
from steerway_studies.cybership_observers import contestants, scenario, tuning
from steerway_studies.cybership_observers.scenario import drawn, sail, watch

RECIPE_B = TimeVaryingNoise(scale=contestants.RECIPE_B, yaw=contestants.RECIPE_B)
SETTLED = 10
"""Rows at the start, where the estimate is still near its given start, which NEES leaves out."""


def trial(tuned: dict, seed: int) -> dict[str, float]:
    """All numbers of one seed; keys as in results.json where they are means over seeds."""
    draws = drawn(seed)
    record = sail(draws)
    return {
        **_printed(record),
        **_table_three(record, sail(draws, disturbed=False)),
        **_product(record),
        **_time_varying(tuned, draws, record),
        **_trouble(draws),
        **_closed_loops(tuned, draws),
    }


def _printed(record):
    run = watch(contestants.time_varying(), record, compass=False)
    with_compass = watch(contestants.time_varying(), record)
    square = watch(contestants.time_varying(TimeVaryingNoise(power=2.0)), record, compass=False)
    raw = (record.fixes - record.states[:, :2])[scenario.PER_FIX :: scenario.PER_FIX]
    return {
        "tekf_mae_all": run.mae,
        "tekf_mae_fix": run.mae_at_fixes,
        "tekf_nis": run.nis,
        "tekf_compass_mae": with_compass.mae,
        "tekf_inverse_square_mae": square.mae,
        "raw_mae_fix": np.abs(raw).mean(),
        "hold_mae": np.abs(scenario.held_fixes(record)).mean(),
        "heading_gnss_only_deg": math.degrees(run.heading_mae),
        "heading_compass_deg": math.degrees(with_compass.heading_mae),
    }


def _table_three(record, calm):
    def both(prefix, suffix, run):
        north, east = np.abs(run.errors).mean(axis=0)
        return {f"{prefix}_{suffix}": run.mae, f"{prefix}_north": north, f"{prefix}_east": east}

    calm_filter = watch(contestants.time_varying(RECIPE_B), calm)
    return {
        **both("tekf_recipe_b", "mae", watch(contestants.time_varying(RECIPE_B), record)),
        **both("observer_stock", "mae", watch(contestants.stock_observer(), record)),
        "tekf_recipe_b_calm_mae": calm_filter.mae,
        "observer_stock_calm_mae": watch(contestants.stock_observer(), calm).mae,
    }


def _product(record):
    kept = record.fixes.copy()
    kept[0] = math.nan  # the start is given
    headings = record.headings.copy()
    headings[0] = math.nan
    passes = smooth(contestants.product(), record.forces, kept, headings, scenario.STEP)
    filtered = passes.filtered[:, :6] - record.states
    smoothed = passes.smoothed[:, :6] - record.states
    least, _ = contestants.bound(record)
    return {
        "ekf9_mae": np.abs(filtered[:, :2]).mean(),
        "ekf9_mae_fix": np.abs(filtered[scenario.PER_FIX :: scenario.PER_FIX, :2]).mean(),
        "ekf9_bound": least,
        "ekf9_nis": np.nanmean(passes.nis),
        "ekf9_nees": _nees(filtered, passes.filtered_covariance),
        "ekf9_heading_deg": math.degrees(np.mean([abs(wrap(each)) for each in filtered[:, 2]])),
        "rts_mae": np.abs(smoothed[:, :2]).mean(),
        "rts_nees": _nees(smoothed, passes.smoothed_covariance),
        "observer_tuned_mae": watch(contestants.observer(), record).mae,
    }


def _nees(errors, covariances):
    """Mean normalised estimation error squared of the first six states."""
    errors = errors[SETTLED:].copy()
    errors[:, 2] = [wrap(each) for each in errors[:, 2]]
    solved = np.linalg.solve(covariances[SETTLED:, :6, :6], errors[:, :, None])[:, :, 0]
    return float((errors * solved).sum(axis=1).mean())


def _time_varying(tuned, draws, record):
    records = {"S*": record, "noise grows with speed": sail(draws, fix_noise=scenario.growing)}
    return {
        f"{world}: {form}": watch(tuning.made(form, logs), records[world]).mae for (world, form), logs in tuned.items()
    }


def _trouble(draws):
    outliers = sail(draws, fix_noise=scenario.with_outliers)
    record = sail(draws)
    step = sail(draws, fix_noise=scenario.stepping)
    waves = sail(draws, fix_noise=scenario.with_waves)
    swell = sail(draws, fix_noise=partial(scenario.with_waves, damping=scenario.SWELL_DAMPING))
    other_plant = sail(draws, identification="nonlinear")
    quiet = replace(contestants.PRODUCT, position_std=scenario.QUIET)
    large, small = (replace(contestants.PRODUCT, position_std=scenario.FIX_STD * share) for share in (10.0, 0.1))
    in_waves = watch(contestants.product(contestants.WAVES), waves)
    wave_white = math.hypot(scenario.FIX_STD, scenario.WAVE_STD)
    product = contestants.product
    return {
        "outliers_ekf9_mae": watch(product(), outliers).mae,
        "outliers_adaptive_mae": watch(product(learns=True), outliers).mae,
        "outliers_no_gate_mae": watch(product(gate=math.inf), outliers).mae,
        "outliers_tekf_mae": watch(contestants.time_varying(), outliers).mae,
        "r_100_large_fixed_mae": watch(product(large), record).mae,
        "r_100_large_adaptive_mae": watch(product(large, learns=True), record).mae,
        "r_100_small_fixed_mae": watch(product(small), record).mae,
        "r_100_small_fixed_no_gate_mae": watch(product(small, math.inf), record).mae,
        "r_100_small_adaptive_mae": watch(product(small, learns=True), record).mae,
        "noise_step_fixed_mae": watch(product(quiet, math.inf), step).mae,
        "noise_step_fixed_gate_mae": watch(product(quiet), step).mae,
        "noise_step_adaptive_mae": watch(product(quiet, learns=True), step).mae,
        "noise_step_oracle_mae": watch(contestants.stepping_oracle(), step).mae,
        "waves_ekf13_mae": in_waves.mae,
        "waves_ekf13_nis": in_waves.nis,
        "swell_ekf13_mae": watch(contestants.product(contestants.SWELL), swell).mae,
        "swell_bound": contestants.bound(swell, contestants.SWELL)[0],
        "waves_bound": contestants.bound(waves, contestants.WAVES)[0],
        "waves_ekf9_mae": watch(product(gate=math.inf), waves).mae,
        "waves_as_white_noise_mae": watch(product(replace(contestants.PRODUCT, position_std=wave_white)), waves).mae,
        "nonlinear_plant_ekf9_mae": watch(product(contestants.DOUBTFUL, math.inf), other_plant).mae,
        "nonlinear_plant_ekf9_sure_mae": watch(product(), other_plant).mae,
        "nonlinear_plant_observer_tuned_mae": watch(contestants.observer(), other_plant).mae,
    }


CLOSED_LOOPS = ("truth", "tekf_gnss_only", "tekf", "tekf_tuned", "observer_tuned", "ekf9", "ekf9_gnss_only")


def _closed_loops(tuned, draws):
    tuned_filter = tuning.made("inverse", tuned["S*", "inverse"])
    pilots = {
        "truth": (None, True),
        "tekf_gnss_only": (contestants.time_varying(), False),
        "tekf": (contestants.time_varying(), True),
        "tekf_tuned": (tuned_filter, True),
        "observer_tuned": (contestants.observer(), True),
        "ekf9": (contestants.product(), True),
        "ekf9_gnss_only": (contestants.product(), False),
    }
    ends = {}
    for name, (pilot, compass) in pilots.items():
        end = sail(draws, observer=pilot, compass=compass).states[-1]
        ends[f"closed_loop_{name}"] = math.hypot(end[0] - scenario.GOAL[0], end[1] - scenario.GOAL[1])
    return ends
