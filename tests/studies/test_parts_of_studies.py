"""What the targets of the studies (`test_every_study`) leave open: yardsticks, errata, invariance, made-up logs."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import polars as pl
import pytest

import steerway_studies as studies
from steerway.core import InputError, rms, wrap_array
from steerway.estimation.heading import SCALE_ONLY, AidedHeadingFilter, outside
from steerway.estimation.steering.testing import ReceiverNoise
from steerway.estimation.testing import gain_range
from steerway.sensors import TCM2, Gnss, random_compass
from steerway.vessels import SPRINGER_PAPER_YAW
from steerway_studies.testing import (
    BOUNDS,
    CELLS,
    LOGS,
    SHIP_LENGTH,
    Case,
    RangeRatePassing,
    Receiver,
    ShipCase,
    VelocityReference,
    World,
    all_cases,
    as_printed,
    at_sea,
    bounded,
    catalogue,
    drawn,
    filtering_bound,
    ideal,
    lesson,
    named,
    nominal,
    otter_course,
    over_runs,
    plain_ekf,
    rate_lag,
    rounded,
    scenarios_sail,
    ship,
    unseen_logs,
    velocity_lag,
)
from steerway_studies.testing import logs as otter_logs
from steerway_studies.testing import sailing_judged as judged
from steerway_studies.testing import world_sail as sail
from tests.scenes import sailed

measured = cache(ship.measured)
"""Each voyage of P1's ship once."""


@pytest.mark.parametrize("name", CELLS)
def test_the_bound_is_that_of_an_independent_prototype(name):
    cell = CELLS[name]
    voyages = [scenarios_sail(cell.scenario, seed) for seed in range(2 * cell.scenario.runs)]
    rows = np.array([bounded(filtering_bound(each, cell.profile), each, cell.scenario) for each in voyages])
    for k in range(2):
        for i, scale in enumerate((1.0, math.degrees(1.0), math.degrees(1.0))):
            value = over_runs(rows[:, k, i], rows[:, k, 3]).value * scale
            assert value == pytest.approx(BOUNDS[name][k][i], rel=0.02), (k, i)


def test_p1_a_slow_low_pass_tracks_badly_and_a_quick_one_saturates():
    quick, slow = (measured(ShipCase("truth", low_pass=low_pass)) for low_pass in (20.0, 100.0))
    assert quick["rudder_max_deg"] == pytest.approx(40.0, abs=0.1) and quick["saturated_pct"] > 1.0
    assert slow["rudder_max_deg"] < 14.0 and slow["cross_track_max_m"] == pytest.approx(614.0, abs=10.0)


@pytest.mark.parametrize("angle", [0.0, 135.0, 180.0, 285.0])
def test_p1_turned_the_product_finishes_as_by_the_truth_and_the_printed_filter_does_not_go_south(angle):
    truth = measured(ShipCase("truth"))
    by_truth, product = (measured(ShipCase(kind, turned=math.radians(angle))) for kind in ("truth", "product"))
    for key in ("switch_s_4", "rudder_max_deg", "cross_track_max_m", "duration_s"):
        assert by_truth[key] == pytest.approx(truth[key], rel=1e-3)
    assert product["finished"] == 1.0 and product["duration_s"] == pytest.approx(truth["duration_s"], rel=0.05)
    assert product["cog_rms_deg"] < 4.0 and product["sog_rms_mps"] < 0.25
    if angle in (0.0, 180.0):
        assert measured(ShipCase("printed", turned=math.radians(angle)))["finished"] == (angle == 0.0)


def test_p0_a_real_log_beside_its_receiver(shared_data):
    """Once settled both filters say what the receiver says 2.5 s later; the printed one may have found U < 0."""
    log = LOGS[0]
    fixes = otter_logs._opened(shared_data / "data" / log.path, log)
    printed = as_printed(fixes, log.process_noise)
    settled, known = printed.time > printed.time[0] + 30.0, np.isfinite(fixes.cog)
    output = np.interp(printed.time + 2.5, fixes.time[known], np.unwrap(fixes.cog[known]))
    error = np.mod(printed.cog - output + np.pi, 2.0 * np.pi) - np.pi
    assert math.degrees(np.sqrt(np.mean(error[settled][:-20] ** 2))) < 2.0
    study = otter_course.Results("x")
    otter_logs._add(study, log, fixes)
    assert study.numbers["log_motor_boat_product_cog_rms_deg"] < 1.0
    assert study.numbers["log_motor_boat_product_sog_rms_mps"] < 0.1


@pytest.mark.parametrize("passing, seconds", [(None, 892), (RangeRatePassing(), 971)])
def test_nominal_filter_misses_later_waypoints(passing, seconds):
    voyage = sail(World(), nominal(), 3, passing=passing)
    assert 3 <= voyage.reached <= 5 and voyage.log.reached == list(range(voyage.reached))
    assert voyage.heading_rms_deg > 15.0
    assert len(voyage.heading) == pytest.approx(seconds, abs=12)


@pytest.mark.filterwarnings("ignore:Stochastic Optimizer")
def test_training_learns_a_weight_from_little():
    pytest.importorskip("sklearn")
    from steerway_studies.testing import train

    notes = np.concatenate([lesson(2_000_000 + k) for k in range(6)])[::10]
    network = train(notes, "weight", iterations=200)
    low, high, nominal_deg, truth = notes[:, 12:].T
    estimate = np.array([low[k] + network(notes[k]) * (high[k] - low[k]) for k in range(len(notes))])
    assert np.sqrt(np.mean((estimate - truth) ** 2)) < 0.5 * np.sqrt(np.mean((nominal_deg - truth) ** 2))


def alarmed(compass) -> bool:
    """Whether the filter says for a minute that the compass is outside the box of ± 1 %."""
    voyage = sail(World(compass=compass), ideal(compass), 0)
    estimator, raised = AidedHeadingFilter(SCALE_ONLY, TCM2, SPRINGER_PAPER_YAW), []
    for difference, readings in zip(voyage.difference, voyage.readings, strict=True):
        estimator.step(difference, readings)
        raised.append(outside(estimator, 0.01))
    return bool(np.convolve(raised, np.ones(60), "valid").max() >= 60)


def test_alarm_tells_compasses_outside_the_box():
    compasses = random_compass(np.random.default_rng(8)), TCM2.scaled(0.98), TCM2.scaled(1.012)
    assert [alarmed(each) for each in compasses] == [False, True, True]
    low, high = gain_range(0.01)
    rng = np.random.default_rng(0)
    gains = [random_compass(rng).gain / TCM2.gain for _ in range(500)]
    assert low <= min(gains) and max(gains) <= high
    assert TCM2.scaled(0.98).gain / TCM2.gain < low and TCM2.scaled(1.012).gain / TCM2.gain > high


def test_full_runs_the_whole_grid(monkeypatch):
    ran = []

    def over_cases(run, pairs, progress=None):
        ran.append([case for case, _ in pairs])
        raise InterruptedError

    monkeypatch.setattr(at_sea, "over_cases", over_cases)
    for full in (False, True):
        with pytest.raises(InterruptedError):
            at_sea.STUDY.run_keeping(None, 1, 3, None, full=full)
    assert ran == [list(drawn(3)), list(all_cases())]
    with pytest.raises(InputError, match="study mariner-los runs all its cases with every seed, expected no --full"):
        named("mariner-los").run_keeping(None, 1, 0, None, full=True)


@pytest.mark.parametrize(
    ("craft", "share", "velocity", "most"),
    [
        ("motorboat", 0.5, True, 0.3),
        ("motorboat", 0.8, True, 1.0),
        ("otter", 0.5, True, 0.5),
        ("otter", 0.25, False, 0.9),
    ],
)
def test_a_square_in_a_current_from_rest_without_a_compass(craft, share, velocity, most):
    found = judged(Case(craft, "square", share, 0.25 * math.pi, Receiver("white", 5.0, velocity)), 1)
    assert found.finished and not found.own_stop
    assert found.legs <= most and found.corners <= 1.5


@pytest.mark.parametrize(("errors", "seed"), [("rtk", 7), ("wandering", 4)])
def test_a_ship_does_not_take_a_current_ahead_for_a_speed_of_its_own(errors, seed):
    found = judged(Case("mariner", "square", 0.8, math.radians(202.5), Receiver(errors, 5.0, errors != "rtk")), seed)
    assert found.finished and found.legs <= 0.5 * SHIP_LENGTH and found.corners <= 1.0


@pytest.mark.parametrize(("white", "markov"), [(0.3, ()), (0.02, ()), (0.05, ((0.25, 5.0),))])
def test_white_and_slow_errors_are_told_apart(white, markov):
    stream, noise = Gnss(rate=5.0, white=white, markov=markov).start(1), ReceiverNoise()
    for k in range(600):
        fix = stream.step(0.2 * k, 0.4 * k, 0.0)
        noise.add(fix.time, fix.north, fix.east)
    assert noise.white == pytest.approx(white, rel=0.35)
    assert noise.slow > 0.1 if markov else noise.slow < white


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
