"""What a scenario can name: instruments, autopilots, estimators and speed controllers, on every vessel."""

import numpy as np
import pytest

from steerway.core import InputError
from steerway.guidance.testing import LAWS, SHAPERS
from steerway.sensors.testing import INSTRUMENTS
from steerway.simulation import parse_scenario, sail_scenario
from steerway.vessels.testing import TABLES

ROUTE = "duration = 20\n[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 400, east = 0 }]\n[compass]\n"


KINDS = [
    *(f'[vessel]\nkind = "{table.model_fields["kind"].default}"' for table in TABLES),
    *(f'[guidance]\nlaw = "{name}"' for name in LAWS),
    *(f'[reference]\nkind = "{name}"' for name in SHAPERS),
]


@pytest.mark.parametrize("text", KINDS)
def test_every_kind_can_be_simulated(text):
    unstable = '[gyro]\n[guidance]\nlaw = "integral-line-of-sight"\n' if "caldas" in text else ""
    run = sail_scenario(parse_scenario(ROUTE + unstable + text)).run
    assert len(run) == 1000 and np.isfinite(run.command).all() and run["true_north"][-1] > 5.0


def test_every_instrument_gives_what_it_measures_and_nothing_else():
    for name, table in INSTRUMENTS.items():
        vessel = '[vessel]\nkind = "surge"\n' if name == "tachometer" else ""
        scenario = parse_scenario(ROUTE.replace("[compass]\n", f"[{name}]\n{vessel}"))
        run = sail_scenario(scenario).run
        measured = np.isfinite(run[f"read_{table.measures}"])
        assert measured.sum() == pytest.approx(20.0 * getattr(scenario, name).rate, abs=1)
        others = {each.measures for each in INSTRUMENTS.values()} - {table.measures}
        assert not any(np.isfinite(run[f"read_{each}"]).any() for each in others)


def test_an_instrument_draws_the_same_numbers_whatever_else_is_aboard():
    alone = sail_scenario(parse_scenario(ROUTE.replace("[compass]\n", "[log]\n"))).run
    together = sail_scenario(parse_scenario(ROUTE + "[gyro]\n[log]\n")).run
    for read, true in (("read_north", "true_north"), ("read_water_speed", "true_surge")):
        assert np.allclose(alone[read] - alone[true], together[read] - together[true], atol=1e-9, equal_nan=True)
    assert abs(np.degrees(np.nanmean(together["read_heading"] - together["true_heading"]))) < 0.2


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


def finished(vessel, tables):
    sailed = sail_scenario(scenario(vessel, tables))
    assert sailed.numbers["waypoints_missed"] == 0.0 and sailed.numbers["finished"] == 1.0
    return sailed


@pytest.mark.parametrize(
    ("vessel", "kind"), [("otter", "mpc"), ("mariner", "lqg"), ("nomoto", "pole-placement"), ("springer", "mpc")]
)
def test_every_autopilot_sails_every_vessel_that_is_steered(vessel, kind):
    finished(vessel, f'[autopilot]\nkind = "{kind}"\n')


FUSED = (
    '[gnss]\nvelocity_std = 0.05\n[accelerometer]\n[bottom_log]\nscale = 1.003\n[estimator.speed]\nkind = "fusion"\n'
)


@pytest.mark.parametrize(
    ("vessel", "shaft", "controller"),
    [
        ("otter", "", "disturbance-observer"),
        ("caldas", "[tachometer]\n", "adaptive"),
        ("surge", "[tachometer]\n", "pi"),
    ],
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


@pytest.mark.parametrize(("vessel", "kind"), [("otter", "aided"), ("nomoto", "composite"), ("springer", "interval")])
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


@pytest.mark.parametrize(
    ("vessel", "tables", "message"),
    [
        ("otter", "[estimator.heading]\nweight = 0.4\n", 'heading: weight has no effect with kind "tracker"'),
        ("otter", '[compass]\n[estimator.heading]\nkind = "interval"\nweight = 1.4\n', "expected at most 1"),
        ("caldas", '[autopilot]\nkind = "lqg"\n', "autopilot.kind lqg predicts a stable response"),
        ("surge", '[estimator.heading]\nkind = "aided"\n', "needs a steered vessel, which kind surge is not"),
        ("otter", '[estimator.speed]\nkind = "fusion"\n', "needs a measured speed"),
        ("otter", "[tachometer]\n", "tachometer has no effect on a vessel of kind otter"),
        ("surge", "[start]\nheading_deg = 30.0\n", "to the side of the boat's heading"),
        ("nomoto", "payload_mass = 5.0\n", "unknown key vessel.payload_mass for kind nomoto, expected one of"),
    ],
)
def test_what_makes_no_sense_is_refused_with_a_sentence(vessel, tables, message):
    with pytest.raises(InputError) as refused:
        scenario(vessel, tables)
    assert message in str(refused.value) and "\n" not in str(refused.value)
