"""The numbers of one seed: every observer on the same truth, with the same noise in every fix."""

import math

import numpy as np

from steerway.core import wrap
from steerway.estimation.positioning import TimeVaryingNoise, smooth
from steerway_studies.cybership_observers import observers, scenario, tuning
from steerway_studies.cybership_observers.scenario import drawn, sail, watch

RECIPE_B = TimeVaryingNoise(scale=observers.RECIPE_B, yaw=observers.RECIPE_B)
SETTLED = 10
"""Rows at the start that NEES leaves out, because the estimate is still close to its given start."""


def trial(tuned: dict, seed: int) -> dict[str, float]:
    """All numbers of one seed, by key; results.json has their means over seeds under the same keys."""
    draws = drawn(seed)
    record = sail(draws)
    return {
        **_printed(record),
        **_table_three(record, sail(draws, disturbed=False)),
        **_product(record),
        **_time_varying(tuned, draws, record),
    }


def _printed(record):
    run = watch(observers.time_varying(), record, compass=False)
    with_compass = watch(observers.time_varying(), record)
    square = watch(observers.time_varying(TimeVaryingNoise(power=2.0)), record, compass=False)
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

    calm_filter = watch(observers.time_varying(RECIPE_B), calm)
    return {
        **both("tekf_recipe_b", "mae", watch(observers.time_varying(RECIPE_B), record)),
        **both("observer_stock", "mae", watch(observers.stock_observer(), record)),
        "tekf_recipe_b_calm_mae": calm_filter.mae,
        "observer_stock_calm_mae": watch(observers.stock_observer(), calm).mae,
    }


def _product(record):
    kept = record.fixes.copy()
    kept[0] = math.nan  # without the first fix, because the start is given
    headings = record.headings.copy()
    headings[0] = math.nan
    passes = smooth(observers.product(), record.forces, kept, headings, scenario.STEP)
    filtered = passes.filtered[:, :6] - record.states
    smoothed = passes.smoothed[:, :6] - record.states
    least, _ = observers.bound(record)
    return {
        "ekf9_mae": np.abs(filtered[:, :2]).mean(),
        "ekf9_mae_fix": np.abs(filtered[scenario.PER_FIX :: scenario.PER_FIX, :2]).mean(),
        "ekf9_bound": least,
        "ekf9_nis": np.nanmean(passes.nis),
        "ekf9_nees": _nees(filtered, passes.filtered_covariance),
        "ekf9_heading_deg": math.degrees(np.mean([abs(wrap(each)) for each in filtered[:, 2]])),
        "rts_mae": np.abs(smoothed[:, :2]).mean(),
        "rts_nees": _nees(smoothed, passes.smoothed_covariance),
        "observer_tuned_mae": watch(observers.observer(), record).mae,
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
