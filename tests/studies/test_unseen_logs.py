"""The study of unseen logs on generated ones: what it measures is what was put in."""

import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

import steerway_studies as studies
from steerway.core import rms, wrap_array
from steerway_studies.testing import (
    JudgedLog,
    VelocityReference,
    catalogue,
    plain_ekf,
    rate_lag,
    right_refused,
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


def reference_of(late=0.0, std=0.0):
    noise = np.random.default_rng(4).normal(0.0, std, (2, len(SINCE)))
    return VelocityReference(WEAVING.time + late, WEAVING.sog + noise[0], WEAVING.cog + noise[1] / WEAVING.sog, RATE)


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


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """(results, written page) of two logs of the catalogue, one a half, generated."""
    folder = tmp_path_factory.mktemp("logs")
    report = next(log.name for log in catalogue.public_logs() if log.half == catalogue.REPORT)
    develop = next(log.name for log in catalogue.public_logs() if log.half == catalogue.DEVELOP)
    write_log(folder, report, len(SINCE), 1, ("ref_sog_mps", "ref_cog_deg", "ref_rate_dps"))
    write_log(folder, develop, 500, 2, ("ref_sog_mps",))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("STEERWAY_LOGS", str(folder))
        patch.delenv("STEERWAY_DATA", raising=False)
        patch.setattr(unseen_logs, "over_cases", lambda judge, logs, progress: [judge(log) for log in logs])
        patch.setattr(rounded, "cases", lambda seed: [rounded.Case("5 decimals", 1.0, "straight 4", False, seed)])
        results = studies.named("unseen-logs").run(None, 0, None)
    page = results.write(folder / "out").read_text(encoding="utf-8")
    return results, page, report, develop


def test_numbers_of_the_report_half_stand_under_their_plain_names(study):
    results, _, report, develop = study
    numbers, stem = results.numbers, report.replace("-", "_")
    for key in ("sog_ratio", "cog_ratio", "sog_ratio_worst", "cog_ratio_worst", "coverage_min_pct"):
        assert math.isfinite(numbers[key])
    assert numbers["sog_ratio"] == pytest.approx(numbers[f"{stem}_default_sog"] / numbers[f"{stem}_plain_ekf_sog"])
    assert numbers["develop_sog_ratio"] != numbers["sog_ratio"] and "develop_cog_ratio" not in numbers
    assert math.isnan(numbers[f"{develop.replace('-', '_')}_default_cog"])


def test_rounded_positions_are_judged_by_their_own_truth(study):
    results, page, *_ = study
    assert results.numbers["rounded_sog_coverage_min_pct"] > 90.0 and results.numbers["rounded_bias_max_pct"] < 2.0
    assert results.numbers["rounded_smoothed_below_floor"] == 0 and "5 decimals, 1 Hz" in page


def test_lag_that_was_put_in_is_taken_out(study):
    numbers, stem = study[0].numbers, study[2].replace("-", "_")
    assert numbers[f"{stem}_lag_s"] == pytest.approx(LATE, abs=0.11)
    # What is left of the smoothed estimate is below what the lag alone would make: 0.6 s of up to 0.11 m/s² and 6 °/s.
    assert numbers[f"{stem}_smoothed_sog"] < 0.12
    assert math.degrees(numbers[f"{stem}_smoothed_cog"]) < 2.5


@pytest.mark.parametrize("late", [-0.4, 0.0, 2.5])
def test_lags_are_found_from_positions_alone(late):
    places, reference = noisy(NOISE, 3), reference_of(late)
    assert velocity_lag(reference, WEAVING.time, places) == pytest.approx(late, abs=0.11)
    without = replace(reference, cog=np.full(len(SINCE), np.nan))
    assert velocity_lag(without, WEAVING.time, places) == pytest.approx(late, abs=0.2)
    assert rate_lag(reference, WEAVING.time, TRUE) == pytest.approx(late, abs=0.16)


def test_noise_of_the_reference_is_found_and_its_rounding_counts():
    sog, across, _ = reference_of(std=VELOCITY_NOISE).noise
    assert sog == pytest.approx(VELOCITY_NOISE, rel=0.25) and across == pytest.approx(VELOCITY_NOISE, rel=0.25)
    exact = reference_of()
    assert exact.noise[0] < 0.005
    rounded = replace(exact, sog=np.round(exact.sog, 1))
    assert rounded.noise[0] == pytest.approx(0.1 / math.sqrt(12.0), rel=0.2)


def test_spikes_gaps_and_poor_rows_of_the_reference_are_unknown():
    reference = reference_of()
    sog = reference.sog.copy()
    sog[300] = 60.0
    accuracy = np.where(np.arange(len(sog)) == 600, 4.0, 0.3)
    believed = replace(reference, sog=sog).believed(accuracy)
    unknown = np.flatnonzero(np.isnan(believed.sog))
    assert {300, 600} <= set(unknown) and len(unknown) < 20
    held = replace(reference, sog=np.where(np.abs(np.arange(len(sog)) - 800) < 20, np.nan, sog))
    assert np.isnan(held.at(reference.time[800:801])[0]) and np.isnan(held.way(*reference.time[[770, 830], None])).all()


def test_refused_fixes_are_right_or_wrong_by_the_reference():
    places, refused = noisy(0.02, 5), np.zeros(len(SINCE), dtype=bool)
    refused[[200, 400, 401, 402, 700]] = True
    places[400:403] += 12.0
    log = JudgedLog(catalogue.public_logs()[0], WEAVING.fixes(0.0, 0), places, reference_of())
    assert right_refused(log, refused) == (2, 5)


def test_plain_ekf_is_consistent_and_beats_differences():
    places, sog = noisy(NOISE, 6), WEAVING.sog
    said, late = plain_ekf.fitted(SINCE, places), SINCE > 20.0
    error = (said[:, 0] - sog)[late]
    assert rms(error) < 0.5 * np.std(np.hypot(*(places[5:] - places[:-5]).T) / (5 * STEP) - sog[5:])
    assert 0.85 < np.mean(np.abs(error) < 1.96 * said[late, 3]) <= 1.0
    assert rms(wrap_array(said[:, 1] - WEAVING.cog)[late]) < math.radians(4.0)
    assert rms((said[:, 2] - RATE)[late]) < math.radians(3.0)
