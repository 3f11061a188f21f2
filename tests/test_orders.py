"""Courses and speeds ordered over time, and what is measured of the answers."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.core import LegState
from steerway.guidance import Order, Ordered
from steerway.simulation import parse_scenario, sail_scenario, settling

NOMOTO = """
duration = 120.0
step = 0.1
[vessel]
kind = "nomoto"
gain = 0.5
time_constant = 4.0
[estimator]
kind = "truth"
"""


def test_an_order_holds_until_the_next_and_what_it_leaves_out_stays():
    scenario = parse_scenario(
        NOMOTO.replace("120", "200")
        + "[[orders]]\ntime = 10.0\ncourse_deg = 20.0\n[[orders]]\ntime = 60.0\ncourse_deg = -10.0\n"
    )
    run = sail_scenario(scenario).run
    wanted = np.degrees(run["desired_angle"])
    assert (wanted[run.time < 9.95] == 0.0).all()
    np.testing.assert_allclose(wanted[(run.time > 9.95) & (run.time < 59.95)], 20.0)
    np.testing.assert_allclose(wanted[run.time > 59.95], -10.0)
    assert math.degrees(run.true_cog[-1]) == pytest.approx(-10.0, abs=0.1)
    assert (run["asked_speed"] == 2.0).all()


def test_settling_and_overshoot_are_those_of_the_worst_step():
    text = NOMOTO + "[[orders]]\n[[orders]]\ntime = 10.0\ncourse_deg = 20.0\n"
    quick, slow = (sail_scenario(parse_scenario(text + f"[reference]\ntime_constant = {t}\n")) for t in (0.5, 8.0))
    late = slow.run.time >= 10.0
    off = np.abs(np.degrees(slow.run.true_cog[late]) - 20.0) > 1.0
    last = slow.run.time[late][off][-1] + 0.1 - 10.0
    assert slow.numbers["settling_s"] == pytest.approx(last, abs=1e-6)
    assert quick.numbers["settling_s"] < slow.numbers["settling_s"]
    beyond = 100.0 * (np.degrees(quick.run.true_cog).max() / 20.0 - 1.0)
    assert quick.numbers["overshoot_pct"] == pytest.approx(beyond, rel=1e-6) and beyond > 1.0


def test_a_speed_settles_within_two_percent_of_what_is_ordered():
    text = (
        'duration = 40.0\nstep = 0.05\n[vessel]\nkind = "surge"\n[estimator]\nkind = "truth"\n[[orders]]\nspeed = 4.0\n'
    )
    sailed = sail_scenario(parse_scenario(text))
    outside = np.abs(sailed.run.true_sog - 4.0) > 0.08
    assert sailed.numbers["settling_s_4"] == pytest.approx(sailed.run.time[outside][-1] + 0.05)
    unfinished = sail_scenario(parse_scenario(text.replace("40.0", "5.0", 1)))
    assert unfinished.numbers["settling_s_4"] == math.inf


def test_a_steady_thrust_takes_the_place_of_a_speed_loop():
    text = 'duration = 30.0\n[estimator]\nkind = "truth"\n[speed]\nforce = 80.0\n[[orders]]\ncourse_deg = 30.0\n'
    run = sail_scenario(parse_scenario(text)).run
    assert (run["force"] == 80.0).all()


def test_settling_counts_from_the_first_row_to_the_last_exit():
    time = np.arange(6.0) + 100.0
    assert settling(time, np.array([2.0, 0.5, 2.0, 0.5, -0.5, 0.0]), 1.0) == 3.0
    assert settling(time, np.zeros(6), 1.0) == 0.0
    assert settling(time, np.array([0.0] * 5 + [np.nan]), 1.0) == math.inf


def test_orders_stand_for_a_leg_that_has_only_a_speed():
    ordered = Ordered([Order(0.0, 0.1), Order(0.3, 0.2, 2.0)], cruise=1.0)
    legs = [ordered.step(math.nan, math.nan, 0.1) for _ in range(4)]
    assert [leg.speed for leg in legs] == [1.0, 1.0, 1.0, 2.0] and ordered.given_course == 0.2
    assert isinstance(legs[0], LegState) and math.isnan(legs[0].direction)


@pytest.mark.parametrize(
    "text, words",
    [
        ("[[orders]]\ntime = 5.0\n[[orders]]\ntime = 5.0", r"orders\[1\]\.time is 5 s, expected more than 5 s"),
        ("[[orders]]\n[route]\nat_end = 'hold'", r"route\.at_end has no effect with \[\[orders\]\]"),
        ("[[orders]]\nspeed = 99.0", r"orders\[0\]\.speed is 99 m/s, expected at most the vessel's 3 m/s"),
        ("[speed]\nforce = 50.0\ncruise = 1.0\n[[orders]]", r"speed\.cruise has no effect with speed\.force"),
        ("[[orders]]\ncourse = 5.0", r"orders\[0\]\.course"),
    ],
)
def test_what_cannot_be_ordered_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        parse_scenario(text)
