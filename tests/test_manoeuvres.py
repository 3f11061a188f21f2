"""Manoeuvres against Nomoto's equation and MARINER's known turn; courses and speeds ordered over time."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from steerway import InputError
from steerway.simulation import parse_scenario, sail_scenario, settling
from steerway.simulation.testing import limits, manoeuvre_of
from tests.command_line import run

GAIN, TIME, SPEED = 0.1, 10.0, 3.0
NOMOTO = f"""
duration = 1500.0
step = 0.02
manoeuvre = "KIND"
[vessel]
kind = "nomoto"
gain = {GAIN}
time_constant = {TIME}
speed = {SPEED}
"""
P1 = Path(__file__).parent.parent / "examples" / "p1.toml"


def numbers(kind, text=NOMOTO):
    return sail_scenario(parse_scenario(text.replace("KIND", kind))).numbers


def test_a_zigzag_overshoots_as_the_equation_says():
    helm, change = math.radians(20.0), math.radians(10.0)
    settled = GAIN * helm
    executed = brentq(lambda t: settled * (t - TIME * -math.expm1(-t / TIME)) - change, 0.1, 100.0)
    rate = settled * -math.expm1(-executed / TIME)
    overshoot = TIME * rate - settled * TIME * math.log(1.0 + rate / settled)
    found = numbers("zigzag:20/10")
    assert found["initial_turning_s"] == pytest.approx(executed, abs=0.02)
    assert found["initial_turning_m"] == pytest.approx(SPEED * executed, abs=0.1)
    # The helm goes over on the first step past the change: the derivative of the overshoot by that time.
    late = 0.02 * math.degrees(rate) * 2.0 * settled / (settled + rate)
    assert found["overshoot_1_deg"] == pytest.approx(math.degrees(overshoot), abs=late)
    assert found["finished"] == 1.0 and "overshoot_4_deg" in found and "overshoot_5_deg" not in found


def test_a_turning_circle_has_the_diameter_of_its_rate():
    found = numbers("turning-circle:-15")
    rate = GAIN * math.radians(15.0)
    assert found["steady_yaw_rate_dps"] == pytest.approx(math.degrees(rate), rel=1e-6)
    assert found["steady_diameter_m"] == pytest.approx(2.0 * SPEED / rate, rel=1e-6)
    # A first-order yaw response runs T further before it turns.
    assert found["advance_m"] == pytest.approx(SPEED / rate + SPEED * TIME, rel=0.05)
    assert found["speed_loss_pct"] == pytest.approx(0.0, abs=1e-9)


def test_after_a_pull_out_a_stable_ship_goes_straight():
    found = numbers("pull-out:20")
    assert abs(found["residual_yaw_rate_first_dps"]) < 1e-6 > found["residual_difference_dps"]


def test_an_unstable_ship_goes_on_turning_to_either_side():
    """P3's hull: at 3 m/s its yaw is unstable without a controller."""
    text = 'duration = 900.0\nstep = 0.05\nmanoeuvre = "pull-out:5"\n[vessel]\nkind = "caldas"\n'
    assert numbers("", text)["residual_difference_dps"] > 1.0


@pytest.mark.parametrize(("helm", "radius"), [(-35, 575.7), (35, 555.7)])
def test_mariner_turns_as_in_the_author_s_toolbox(helm, radius):
    """A single-screw ship turns tighter to starboard."""
    text = f'duration = 1500.0\nstep = 0.1\nmanoeuvre = "turning-circle:{helm}"\n[vessel]\nkind = "mariner"\n'
    found = numbers("", text)
    assert 0.5 * found["steady_diameter_m"] == pytest.approx(radius, abs=0.05)
    assert found["advance_lengths"] == pytest.approx(found["advance_m"] / 160.93)


def test_a_boat_without_a_rudder_gives_a_share_of_its_moment():
    text = 'duration = 300.0\nstep = 0.02\nmanoeuvre = "zigzag:10/20"\n[vessel]\nkind = "otter"\n'
    sailed = sail_scenario(parse_scenario(text))
    largest = sailed.scenario.vessel.boat().yaw_limit
    assert abs(sailed.run["yaw"]).max() == pytest.approx(0.1 * largest)
    before = sailed.run["yaw"] == 0.0
    assert sailed.run.true_sog[before][-1] == pytest.approx(1.2, abs=0.02)  # it has come to its cruise speed


def test_imo_allows_more_to_long_slow_ships():
    ten = manoeuvre_of("zigzag:10/10")
    assert limits(ten, 100.0, 12.0)["overshoot_1_deg"] == 10.0
    assert limits(ten, 200.0, 10.0)["overshoot_1_deg"] == 15.0 and limits(ten, 200.0, 10.0)["overshoot_2_deg"] == 32.5
    assert limits(ten, 400.0, 8.0)["overshoot_2_deg"] == 40.0
    assert limits(manoeuvre_of("zigzag:20/20"), 1.0, 1.0) == {"overshoot_1_deg": 25.0}
    assert limits(manoeuvre_of("turning-circle:35"), 1.0, 1.0)["tactical_diameter_lengths"] == 5.0


def test_the_command_line_takes_a_manoeuvre_in_place_of_the_route(tmp_path):
    code, _, errors = run("simulate", P1, "-o", tmp_path, "--manoeuvre", "zigzag:20/20")
    assert not code, errors
    found = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    assert 0.0 < found["overshoot_1_deg"] < 25.0
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "zigzag:20/20" in page and "25.0" in page and "IMO" in page


ORDERED = """
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
        ORDERED.replace("120", "200")
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
    text = ORDERED + "[[orders]]\n[[orders]]\ntime = 10.0\ncourse_deg = 20.0\n"
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
    time = np.arange(6.0) + 100.0
    for error, settled in (([2.0, 0.5, 2.0, 0.5, -0.5, 0.0], 3.0), ([0.0] * 6, 0.0), ([0.0] * 5 + [np.nan], math.inf)):
        assert settling(time, np.array(error), 1.0) == settled
    unfinished = sail_scenario(parse_scenario(text.replace("40.0", "5.0", 1)))
    assert unfinished.numbers["settling_s_4"] == math.inf


def test_a_steady_thrust_takes_the_place_of_a_speed_loop():
    text = 'duration = 30.0\n[estimator]\nkind = "truth"\n[speed]\nforce = 80.0\n[[orders]]\ncourse_deg = 30.0\n'
    run = sail_scenario(parse_scenario(text)).run
    assert (run["force"] == 80.0).all()


@pytest.mark.parametrize(
    "text, words",
    [
        ("[[orders]]\ntime = 5.0\n[[orders]]\ntime = 5.0", r"orders\[1\]\.time is 5 s, expected more than 5 s"),
        ("[[orders]]\n[route]\nat_end = 'hold'", r"route\.at_end has no effect with \[\[orders\]\]"),
        ("[[orders]]\nspeed = 99.0", r"orders\[0\]\.speed is 99 m/s, expected at most the vessel's 3 m/s"),
        ("[speed]\nforce = 50.0\ncruise = 1.0\n[[orders]]", r"speed\.cruise has no effect with speed\.force"),
        ("[[orders]]\ncourse = 5.0", r"orders\[0\]\.course"),
        ("manoeuvre = 'zigzag:10/10'\nvessel.kind = 'surge'", "needs a steered vessel, which kind surge is not"),
        ("manoeuvre = 'zigzag:10/ten'", "manoeuvre is 'zigzag:10/ten', expected"),
        ("manoeuvre = 'pull-out:0'", "manoeuvre is 'pull-out:0', expected"),
    ],
)
def test_what_cannot_be_ordered_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        parse_scenario(text)
