"""Speed controllers, autopilots and estimators of heading and speed by their keys in scenarios, on every vessel."""

import numpy as np
import pytest

from steerway import InputError
from steerway.simulation import parse_scenario, sail_scenario
from steerway.simulation.testing import leg_rms

pytest.importorskip("daqp")

LEGS = {
    "otter": (0.05, 150.0, "north = 60.0, east = 0.0 }, { north = 60.0, east = 50.0"),
    "mariner": (0.2, 1400.0, "north = 4000.0, east = 0.0 }, { north = 6000.0, east = 2000.0"),
    "nomoto": (0.1, 420.0, "north = 400.0, east = 0.0 }, { north = 500.0, east = 200.0"),
    "springer": (0.2, 360.0, "north = 150.0, east = 0.0 }, { north = 250.0, east = 150.0"),
    "caldas": (0.05, 300.0, "north = 300.0, east = 0.0 }, { north = 500.0, east = 200.0"),
    "surge": (0.05, 150.0, "north = 300.0, east = 0.0"),
}
CALDAS = '[compass]\nstd_deg = 0.3\n[gyro]\n[guidance]\nlaw = "adaptive-line-of-sight"\n'


def scenario(vessel, tables="", keys=""):
    step, duration, points = LEGS[vessel]
    own = CALDAS if vessel == "caldas" else ""
    return parse_scenario(
        f"duration = {duration}\nstep = {step}\n[route]\nwaypoints = [{{ north = 0.0, east = 0.0 }}, {{ {points} }}]\n"
        f'[vessel]\nkind = "{vessel}"\n{keys}\n{own}{tables}'
    )


def finished(vessel, tables="", keys=""):
    sailed = sail_scenario(scenario(vessel, tables, keys))
    assert sailed.numbers["waypoints_missed"] == 0.0 and sailed.numbers["finished"] == 1.0
    return sailed


@pytest.mark.parametrize("kind", ["pole-placement", "mpc", "lqg"])
@pytest.mark.parametrize("vessel", ["otter", "mariner", "nomoto", "springer"])
def test_every_autopilot_sails_every_vessel_that_is_steered(vessel, kind):
    finished(vessel, f'[autopilot]\nkind = "{kind}"\n')


IN_CURRENT = '[estimator]\nkind = "steering"\n[environment.current]\nspeed = 0.5\ndirection_deg = 130.0\n'


@pytest.mark.parametrize("kind", ["pole-placement", "mpc", "lqg"])
@pytest.mark.parametrize("controller", ["pi", "adaptive", "disturbance-observer"])
def test_every_autopilot_and_speed_controller_sails_by_the_current(kind, controller):
    tables = f'[autopilot]\nkind = "{kind}"\n[speed]\ncontroller = "{controller}"\n'
    _, beside_receiver = leg_rms(finished("otter", IN_CURRENT + tables).run)
    assert beside_receiver < 1.0


def test_the_unstable_boat_is_sailed_by_heading():
    finished("caldas")


FUSED = (
    '[gnss]\nvelocity_std = 0.05\n[accelerometer]\n[bottom_log]\nscale = 1.003\n[estimator.speed]\nkind = "fusion"\n'
)


@pytest.mark.parametrize("controller", ["pi", "adaptive", "disturbance-observer"])
@pytest.mark.parametrize(
    ("vessel", "shaft"), [("otter", ""), ("caldas", "[tachometer]\n"), ("surge", "[tachometer]\n")]
)
def test_every_speed_controller_holds_the_speed_of_a_boat_it_misjudges(vessel, shaft, controller):
    keys = "" if vessel == "otter" else "guessed_drag = 0.6\nguessed_thrust = 1.2"
    asked = "cruise = 1.2\n" if vessel == "otter" else "cruise = 3.0\nbandwidth = 0.3\n"
    tables = f'[speed]\ncontroller = "{controller}"\n{asked}{shaft}{FUSED}'
    run = sail_scenario(scenario(vessel, tables, keys)).run
    wanted = run["asked_speed"].max()
    speed = np.hypot(run["true_north_velocity"], run["true_east_velocity"])
    late = (run.time > 60.0) & (run["mode"] == 1)
    assert speed[late].mean() == pytest.approx(wanted, rel=0.02)
    assert speed.max() < 1.12 * wanted


POOR = "[compass]\ndeviation_deg = [0.0, 4.0, -4.0, 1.0, 0.0]\n[gnss]\nvelocity_std = 0.1\n"


@pytest.mark.parametrize("vessel", ["otter", "nomoto", "springer"])
@pytest.mark.parametrize("kind", ["aided", "composite", "interval"])
def test_a_poor_compass_is_enough_to_steer_by_heading(vessel, kind):
    tables = f'{POOR}[estimator.heading]\nkind = "{kind}"\n[guidance]\nlaw = "adaptive-line-of-sight"\n'
    run = finished(vessel, tables).run
    error = np.remainder(run["estimated_heading"] - run["true_heading"] + np.pi, 2.0 * np.pi) - np.pi
    known = np.isfinite(error) & (run.time > 30.0)
    known_current = np.isfinite(run["estimated_current_north"])
    assert known_current[run.time > 30.0].all() if kind == "aided" else not known_current.any()
    assert np.degrees(np.median(np.abs(error[known]))) < 8.0
    if kind != "aided":  # which takes turns to tell deviation from current
        assert np.mean(np.abs(error[known]) < 2.0 * run["estimated_heading_std"][known]) > 0.8


SQUARES = {
    "otter": (60.0, 0.5),
    "springer": (400.0, 0.77),
}
"""Sides (m), and currents of half the boat's speed."""


@pytest.mark.parametrize("vessel", SQUARES)
def test_a_course_is_made_good_by_the_current_that_the_heading_filter_found(vessel):
    side, current = SQUARES[vessel]
    corners = "".join(f"{{ north = {n * side}, east = {e * side} }}, " for n, e in ((0, 0), (1, 0), (1, 1), (0, 1)))
    scenario = parse_scenario(
        f'duration = 2000.0\nstep = {LEGS[vessel][0]}\n{POOR}[vessel]\nkind = "{vessel}"\n'
        f"[environment.current]\nspeed = {current}\ndirection_deg = 130.0\n[start]\nheading_deg = 160.0\n"
        f'[estimator.heading]\nkind = "aided"\n[autopilot]\nkind = "lqg"\n[route]\nwaypoints = [{corners}]\n'
    )
    sailed = sail_scenario(scenario)
    run, late = sailed.run, sailed.run.time > 60.0
    assert sailed.numbers["waypoints_reached"] == 3.0 and sailed.numbers["waypoints_missed"] == 0.0
    off = [run["estimated_current_north"] - run["current_north"], run["estimated_current_east"] - run["current_east"]]
    assert np.median(np.hypot(*off)[late]) < 0.2 * current
    error = np.remainder(run["estimated_heading"] - run["true_heading"] + np.pi, 2.0 * np.pi) - np.pi
    assert np.degrees(np.median(np.abs(error[late]))) < 3.0
    assert np.mean(np.abs(error[late]) < 2.0 * run["estimated_heading_std"][late]) > 0.8
    assert not run["by_course"][late].any()


@pytest.mark.parametrize(
    ("vessel", "tables", "message"),
    [
        ("otter", "[estimator.heading]\nweight = 0.4\n", 'heading.weight has no effect with kind "tracker"'),
        ("otter", '[estimator.heading]\nkind = "aided"\nweight = 0.4\n', "expected interval"),
        ("otter", '[compass]\n[estimator.heading]\nkind = "interval"\nweight = 1.4\n', "expected at most 1"),
        ("otter", '[estimator.heading]\nkind = "interval"\n', "needs a compass"),
        ("otter", "[estimator.speed]\nsog_std = 0.1\n", 'speed.sog_std has no effect with kind "course"'),
        ("mariner", '[speed]\ncontroller = "adaptive"\n', "speed.controller has no effect on a vessel of kind mariner"),
        ("surge", '[autopilot]\nkind = "mpc"\n', "autopilot has no effect on a vessel of kind surge"),
        ("caldas", '[autopilot]\nkind = "lqg"\n', "autopilot.kind lqg predicts a stable response"),
        ("otter", '[estimator.heading]\nkind = "aided"\n', "expected gnss.velocity_std"),
        ("otter", '[estimator.heading]\nkind = "composite"\n', "needs a compass"),
        ("surge", '[estimator.heading]\nkind = "aided"\n', "needs a boat that is steered"),
        ("otter", '[estimator.speed]\nkind = "fusion"\n', "needs a measured speed"),
        ("otter", "[tachometer]\n", "tachometer measures one shaft"),
        ("otter", '[estimator]\nkind = "truth"\nspeed = { kind = "fusion" }\n', "estimator.speed has no effect"),
        ("otter", '[autopilot]\nkind = "pid"\n', "autopilot.kind"),
        ("otter", '[speed]\ncontroller = "mrac"\n', "speed.controller"),
        ("surge", "[start]\nheading_deg = 30.0\n", "to the side of the boat's heading"),
    ],
)
def test_what_makes_no_sense_is_refused_with_a_sentence(vessel, tables, message):
    with pytest.raises(InputError) as refused:
        scenario(vessel, tables)
    assert message in str(refused.value) and "\n" not in str(refused.value)


def test_the_unstable_boat_needs_compass_gyro_and_a_law_of_heading():
    route = "[route]\nwaypoints = [{ north = 0.0, east = 0.0 }, { north = 90.0, east = 0.0 }]\n"
    text = f'duration = 10.0\n{route}[vessel]\nkind = "caldas"\n'
    with pytest.raises(InputError, match=r"expected tables \[compass\] and \[gyro\]"):
        parse_scenario(text)
    with pytest.raises(InputError, match="expected one that commands a heading"):
        parse_scenario(text + "[compass]\n[gyro]\n")
