"""One small case a paper, with the paper's own numbers: a broken equation fails here at once.

Whole studies, over seeds and with their comparisons, and whole scenarios are in tests/studies (`make studies`).
"""

from pathlib import Path

import numpy as np
import pytest

from steerway.guidance.testing import OrderTable
from steerway.sensors import TRUE_TCM2
from steerway.simulation import load_scenario, sail_scenario
from steerway_studies.testing import (
    Job,
    PrintedMrac,
    ShipCase,
    World,
    as_published,
    ideal,
    nominal,
    observers,
    otter_course,
    printed,
    reached,
    run,
    sailing,
    scenario,
    ship,
)
from steerway_studies.testing import world_sail as sail


def test_p0_the_otter_turns_to_its_course_as_published():
    found = otter_course.published_numbers(as_published())
    missed = [each.key for each in otter_course.PUBLISHED if not reached(each.target, found[each.key])]
    assert missed == [] and len(found) == len(otter_course.PUBLISHED)
    assert found["verbatim_settling_s"] == pytest.approx(9.7, abs=0.5)


def test_p1_the_mariner_passes_its_waypoints_on_true_states():
    found = ship.measured(ShipCase("truth"))
    switches = [found[f"switch_s_{waypoint}"] for waypoint in (1, 2, 3, 4)]
    np.testing.assert_allclose(switches, [252.7, 1063.3, 1596.6, 2329.3], atol=2.0)
    assert found["rudder_max_deg"] == pytest.approx(31.3, abs=1.0)
    assert found["rudder_rate_max_dps"] == pytest.approx(3.76, abs=0.2)
    assert found["cross_track_max_m"] == pytest.approx(427.0, abs=10.0) and found["saturated_pct"] == 0.0


def test_p2_the_observers_of_cybership_ii_stand_in_the_papers_order():
    record = scenario.sail(scenario.drawn(4))
    filtered = scenario.watch(observers.product(), record)
    stock, printed = (scenario.watch(each, record) for each in (observers.stock_observer(), observers.time_varying()))
    assert filtered.mae < 0.055 < printed.mae < stock.mae
    assert filtered.mae > 0.85 * observers.bound(record)[0]


def test_p3_adaptive_control_on_fused_speed_settles_in_time_and_the_printed_one_does_not():
    track = printed.sail_true(sailing.plant("T"), PrintedMrac(), 3.0, 50.0)
    assert sailing.settling(track.time, track.speed, 3.0) == pytest.approx(40.783, abs=2e-3)
    assert sailing.overshoot_pct(track.speed, 3.0) == pytest.approx(0.0, abs=0.5)
    voyages = [run(Job("ours", seed, 6)) for seed in range(3)]
    for found in voyages:
        assert found["settling_s"] < 40.0 and found["overshoot_pct"] <= 2.0 and found["exclusions"] == 0
        assert found["rms_pct"] <= 0.023 and found["max_pct"] <= 0.13  # 0.7 of the log's error
    assert 0.95 < np.mean([found["nis"] for found in voyages]) < 1.05
    assert 0.93 < np.mean([found["coverage"] for found in voyages]) < 0.97


def test_p4_the_ideal_filter_reaches_all_waypoints_and_the_nominal_one_misses_some():
    pytest.importorskip("daqp")
    best, misled = sail(World(), ideal(TRUE_TCM2), 3), sail(World(), nominal(), 3)
    assert best.reached == 7 and best.finished and best.heading_rms_deg < 0.05
    assert len(best.heading) == pytest.approx(869, abs=3)
    assert 3 <= misled.reached <= 5 and misled.heading_rms_deg > 15.0


EXAMPLES = Path(__file__).parent.parent / "examples"


def numbers(name, **changes):
    """A run of a paper's scenario with other keys."""
    return sail_scenario(load_scenario(EXAMPLES / f"{name}.toml").model_copy(update=changes)).numbers


def test_p0_settles_on_its_first_order():
    orders = OrderTable(course_deg=0.0), OrderTable(time=20.0, course_deg=20.0)
    found = numbers("p0", orders=orders, duration=35.0)
    assert 9.2 < found["settling_s"] < 10.2 and found["overshoot_pct"] < 5.0


def test_p1_passes_its_first_waypoints_without_saturation():
    found = numbers("p1", duration=700.0)
    assert found["waypoints_reached"] == 1.0 and found["waypoints_missed"] == 0.0
    assert found["rudder_rate_max_dps"] < 5.0 and found["rudder_max_deg"] < 39.9


@pytest.mark.parametrize("controller", ["adaptive", "disturbance-observer", "pi"])
def test_p3_settles_from_rest(controller):
    scenario = load_scenario(EXAMPLES / "p3.toml")
    speed = scenario.speed.model_copy(update={"controller": controller})
    found = numbers("p3", speed=speed, orders=(OrderTable(speed=6.0),), duration=45.0)
    assert found["settling_s_6"] < 40.0 and found["overshoot_pct"] < 2.0


def test_p4_reaches_its_first_waypoints():
    found = numbers("p4", duration=260.0)
    assert found["waypoints_reached"] == 2.0 and found["waypoints_missed"] == 0.0
