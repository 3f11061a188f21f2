"""What the targets of the studies of the papers (`test_every_study`) leave open: yardsticks, errata, invariance."""

import math
from functools import cache

import numpy as np
import pytest

from steerway.vessels.testing import CRUISE_SPEED
from steerway_studies.testing import (
    BOUNDS,
    CELLS,
    LOGS,
    OTTER_PRINTED_GAINS,
    PRINTED_NOISE,
    STATED_NOISE,
    ShipCase,
    as_printed,
    as_published,
    bounded,
    filtering_bound,
    otter_course,
    over_runs,
    sailing,
    scenario,
    scenarios_sail,
    ship,
    tuning,
    turned,
)
from steerway_studies.testing import logs as otter_logs

TIME = np.arange(0.0, 200.05, 0.1)
measured = cache(ship.measured)
"""Each voyage of P1's ship once."""


def test_settling_is_the_last_exit():
    speed = np.where(TIME < 30.0, 0.0, 3.0)
    assert sailing.settling(TIME, speed, 3.0) == pytest.approx(30.0)
    speed[700:705] = 3.1
    assert sailing.settling(TIME, speed, 3.0) == pytest.approx(70.5)
    for constant, expected in ((3.0, 0.0), (2.9, math.inf), (np.nan, math.inf)):
        assert sailing.settling(TIME, np.full_like(TIME, constant), 3.0) == expected


def test_overshoot_and_tail():
    speed = np.where((TIME > 50.0) & (TIME < 60.0), 3.15, 3.0)
    assert sailing.overshoot_pct(speed, 3.0) == pytest.approx(5.0)
    assert sailing.overshoot_pct(np.full(9, 2.0), 3.0) == 0.0
    speed[-50] = 2.97
    assert sailing.tail_pct(TIME, speed, 3.0) == pytest.approx(1.0)


def test_p2_tuning_finds_a_better_noise_than_it_starts_from():
    found = tuning.tune(1, tuning.CASES.index(("S*", "one factor")))
    record = scenario.sail(scenario.drawn(tuning.FIRST_TUNING_SEED))
    errors = [scenario.watch(tuning.made("one factor", logs), record).mae for logs in (found, [-2.0], [-6.0])]
    assert errors[0] < min(errors[1:])


@pytest.mark.parametrize("name", CELLS)
def test_the_bound_is_that_of_an_independent_prototype(name):
    cell = CELLS[name]
    voyages = [scenarios_sail(cell.scenario, seed) for seed in range(2 * cell.scenario.runs)]
    rows = np.array([bounded(filtering_bound(each, cell.profile), each, cell.scenario) for each in voyages])
    for k in range(2):
        for i, scale in enumerate((1.0, math.degrees(1.0), math.degrees(1.0))):
            value = over_runs(rows[:, k, i], rows[:, k, 3]).value * scale
            assert value == pytest.approx(BOUNDS[name][k][i], rel=0.02), (k, i)


def test_many_runs_as_one_number():
    """The ratio of sums, and an interval that holds the truth about 95 times in a hundred."""
    assert over_runs([4.0, 12.0], [1.0, 3.0]).value == 2.0
    chance = np.random.default_rng(0)
    held = 0
    for _ in range(100):
        squares = chance.normal(0.0, 2.0, (30, 10)) ** 2
        _, low, high = over_runs(squares.sum(axis=1), np.full(30, 10.0))
        held += low < 2.0 < high
    assert 85 <= held <= 99


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


def test_erratum_p1_42_what_the_printed_noise_amounts_to():
    for noise, std in ((PRINTED_NOISE, 15.6), (STATED_NOISE, 4.7)):
        ((stationary, _),) = ship.receiver(noise).markov
        assert stationary == pytest.approx(std, abs=0.05)


def test_p1_the_ideal_approach_is_37_integrated_once():
    ideal, _ = ship.approaches()
    later = 3000
    across = ideal.cross_track[[0, later]]
    way = np.hypot(ship.LOOKAHEAD, across) - ship.LOOKAHEAD * np.arcsinh(ship.LOOKAHEAD / across)
    assert way[0] - way[1] == pytest.approx(CRUISE_SPEED * ideal.time[later], rel=1e-5)
    assert ship.promised(0.0, CRUISE_SPEED) == 0.0


def test_p0_the_published_tuning_is_for_fixes_without_noise():
    """P0 says "not sensitive": true without noise; with 1 cm the least error is elsewhere, and the paper is lost."""
    record, failing = as_published(), as_published(0.01)
    assert abs(record.cog[-1]) < math.radians(0.5)
    assert np.abs(failing.cog - failing.desired)[failing.time > 5.0].max() > math.radians(45.0)
    quiet = [otter_course.retuned(record, 0.0, ratio, 2) for ratio in (1e9, 5e13)]
    noisy = [otter_course.retuned(record, 0.01, ratio, 2) for ratio in (1e2, 1e5, 5e13)]
    assert quiet[0] == pytest.approx(quiet[1], rel=0.2) and max(quiet) < 0.05
    assert noisy[0] < 1.0 and noisy[1] > 2.0 * noisy[0] and noisy[2] > 45.0


def test_p0_unwinding():
    for wrapped, by in ((True, 20.0), (False, -340.0)):
        found = turned(OTTER_PRINTED_GAINS, math.radians(350.0), math.radians(10.0), wrapped=wrapped)
        assert found == pytest.approx(math.radians(by), abs=1e-2)


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
