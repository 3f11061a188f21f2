"""The study of unseen logs on generated ones: what it measures is what was put in."""

import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

import steerway_studies as studies
from steerway.core import rms, wrap_array
from steerway_studies.testing import (
    VelocityReference,
    catalogue,
    plain_ekf,
    rate_lag,
    rounded,
    unseen_logs,
    velocity_lag,
)
from tests.scenes import sailed

STEP = 0.2
NOISE, VELOCITY_NOISE = 0.3, 0.05
LATE = 0.6
SINCE = np.arange(0.0, 240.0, STEP)
WEAVING = sailed(3.0 + np.sin(0.11 * SINCE), 1.2 * np.sin(0.09 * SINCE), 1.0 / STEP)
"""A boat that weaves at 3 m/s, faster and slower, for four minutes."""
RATE = 1.2 * 0.09 * np.cos(0.09 * SINCE)
TRUE = np.column_stack([WEAVING.north, WEAVING.east])


def noisy(std, seed):
    """Places (n, 2) with white noise."""
    return TRUE + np.random.default_rng(seed).normal(0.0, std, TRUE.shape)


def write_log(folder, name, rows, seed, columns):
    """A table as the page asks for it, with white noise on the positions."""
    late = np.arange(len(SINCE)) - round(LATE / STEP)
    sog = WEAVING.sog + np.random.default_rng(seed).normal(0.0, VELOCITY_NOISE, len(SINCE))
    known = {
        "ref_sog_mps": np.where(late >= 0, sog[late], np.nan),
        "ref_cog_deg": np.where(late >= 0, np.degrees(WEAVING.cog)[late] % 360.0, np.nan),
        "ref_rate_dps": np.degrees(RATE),
    }
    (folder / name).mkdir()
    frame = WEAVING.fixes(NOISE, seed).to_frame().select("time_s", "lat_deg", "lon_deg")
    frame = frame.with_columns(pl.Series(column, known[column], nan_to_null=True) for column in columns)
    frame.head(rows).write_csv(folder / name / f"{name}.csv")


def test_two_generated_logs_are_judged_by_what_was_put_in(tmp_path, monkeypatch):
    """One log of the catalogue a half; and rounded positions by their own truth."""
    report = next(log.name for log in catalogue.public_logs() if log.half == catalogue.REPORT)
    develop = next(log.name for log in catalogue.public_logs() if log.half == catalogue.DEVELOP)
    write_log(tmp_path, report, len(SINCE), 1, ("ref_sog_mps", "ref_cog_deg", "ref_rate_dps"))
    write_log(tmp_path, develop, 500, 2, ("ref_sog_mps",))
    monkeypatch.setenv("STEERWAY_LOGS", str(tmp_path))
    monkeypatch.delenv("STEERWAY_DATA", raising=False)
    monkeypatch.setattr(unseen_logs, "over_cases", lambda judge, logs, progress: [judge(log) for log in logs])
    monkeypatch.setattr(rounded, "cases", lambda seed: [rounded.Case("5 decimals", 1.0, "straight 4", False, seed)])
    results = studies.named("unseen-logs").run(None, 0, None)
    numbers, stem = results.numbers, report.replace("-", "_")
    assert all(math.isfinite(numbers[key]) for key in ("sog_ratio_worst", "cog_ratio_worst", "coverage_min_pct"))
    assert numbers["sog_ratio"] == pytest.approx(numbers[f"{stem}_default_sog"] / numbers[f"{stem}_plain_ekf_sog"])
    assert numbers["develop_sog_ratio"] != numbers["sog_ratio"] and "develop_cog_ratio" not in numbers
    assert math.isnan(numbers[f"{develop.replace('-', '_')}_default_cog"])
    assert numbers[f"{stem}_lag_s"] == pytest.approx(LATE, abs=0.11)
    # What is left of the smoothed estimate is below what the lag alone would make: 0.6 s of up to 0.11 m/s² and 6 °/s.
    assert numbers[f"{stem}_smoothed_sog"] < 0.12
    assert math.degrees(numbers[f"{stem}_smoothed_cog"]) < 2.5
    assert numbers["rounded_sog_coverage_min_pct"] > 90.0 and numbers["rounded_smoothed_below_floor"] == 0
    assert "5 decimals, 1 Hz" in results.write(tmp_path / "out").read_text(encoding="utf-8")


@pytest.mark.parametrize("late", [-0.4, 0.0, 2.5])
def test_lags_are_found_from_positions_alone(late):
    places, reference = noisy(NOISE, 3), VelocityReference(WEAVING.time + late, WEAVING.sog, WEAVING.cog, RATE)
    assert velocity_lag(reference, WEAVING.time, places) == pytest.approx(late, abs=0.11)
    without = replace(reference, cog=np.full(len(SINCE), np.nan))
    assert velocity_lag(without, WEAVING.time, places) == pytest.approx(late, abs=0.2)
    assert rate_lag(reference, WEAVING.time, TRUE) == pytest.approx(late, abs=0.16)


def test_plain_ekf_is_consistent_and_beats_differences():
    places, sog = noisy(NOISE, 6), WEAVING.sog
    said, late = plain_ekf.fitted(SINCE, places), SINCE > 20.0
    error = (said[:, 0] - sog)[late]
    assert rms(error) < 0.5 * np.std(np.hypot(*(places[5:] - places[:-5]).T) / (5 * STEP) - sog[5:])
    assert 0.85 < np.mean(np.abs(error) < 1.96 * said[late, 3]) <= 1.0
    assert rms(wrap_array(said[:, 1] - WEAVING.cog)[late]) < math.radians(4.0)
    assert rms((said[:, 2] - RATE)[late]) < math.radians(3.0)
