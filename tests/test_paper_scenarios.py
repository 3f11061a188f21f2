"""The papers' scenarios, shortened; `studies/test_paper_scenarios.py` sails them whole."""

from pathlib import Path

import pytest

from steerway.guidance.testing import OrderTable
from steerway.simulation import load_scenario, sail_scenario

EXAMPLES = Path(__file__).parent.parent / "examples"


def numbers(name, **changes):
    """Of a paper's scenario with other keys."""
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
