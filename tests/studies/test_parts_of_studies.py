"""What the targets of the studies of the papers (`test_every_study`) leave open: yardsticks, errata, invariance."""

import math
from functools import cache

import numpy as np
import pytest

from steerway_studies.testing import (
    BOUNDS,
    CELLS,
    LOGS,
    ShipCase,
    as_printed,
    bounded,
    filtering_bound,
    otter_course,
    over_runs,
    scenarios_sail,
    ship,
)
from steerway_studies.testing import logs as otter_logs

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
