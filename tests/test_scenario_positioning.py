"""Dynamic positioning in a scenario: vessels, estimators, the controller, the environment, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from steerway import InputError
from steerway.control import Thrusters
from steerway.simulation import parse_scenario, sail_scenario
from steerway.vessels import CALM, CYBERSHIP2_DAMPING, CYBERSHIP2_INERTIA, CyberShip2, LowSpeedVessel, conditions

P2 = (Path(__file__).parent.parent / "examples" / "p2.toml").read_text(encoding="utf-8")
HOLD = "duration = 120.0\nstep = 0.1\n[compass]\n[gnss]\nrate = 1.0\nwhite = 0.1\nmarkov = []\n"
ORDERS = "[[orders]]\nnorth = 0.0\neast = 0.0\n[[orders]]\ntime = 5.0\nnorth = 6.0\neast = -4.0\ncourse_deg = 170.0\n"


def test_a_vessel_by_its_matrices_is_the_vessel_whose_they_are():
    limits = [2.0, 1.5, 1.5]
    same = LowSpeedVessel(CYBERSHIP2_INERTIA, CYBERSHIP2_DAMPING, Thrusters(np.eye(3), np.negative(limits), limits))
    ship, weather = CyberShip2(), conditions((0.1, -0.05), (0.3, 0.1), 0.02)
    states = [ship.start(1.0, 2.0, 0.4, 0.2), same.start(1.0, 2.0, 0.4, 0.2)]
    for k in range(200):
        command = (3.0 * np.sin(0.1 * k), np.cos(0.07 * k), -0.2)
        states = [each.step(state, command, weather, 0.1) for each, state in zip((ship, same), states, strict=True)]
    np.testing.assert_allclose(*states, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(ship.motion(states[0], CALM), same.motion(states[1], CALM), atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "method"),
    [("vessel-filter", "rk4"), ("tekf", "euler"), ("passive-observer", "rk4"), ("truth", "euler")],
)
def test_every_estimator_holds_a_place_with_thrusters(kind, method):
    text = f'{HOLD}[vessel]\nkind = "low-speed"\nmethod = "{method}"\n[estimator]\nkind = "{kind}"\n{ORDERS}'
    run = sail_scenario(parse_scenario(text)).run
    late = run.time > 90.0
    assert np.hypot(run["true_north"] - 6.0, run["true_east"] + 4.0)[late].max() < 0.5
    assert np.abs(np.degrees(run["true_heading"])[late] - 170.0).max() < 5.0
    assert run.command.shape[1] == 4


def test_a_steady_force_is_held_against_and_estimated():
    sea = "[environment]\nforce = [20.0, -10.0]\n"
    kind = '[vessel]\nkind = "low-speed"\n[estimator]\nkind = "vessel-filter"\n'
    noise = "[estimator.positioning]\nforce_std = [30.0, 30.0, 5.0]\n"
    text = HOLD.replace("120.0", "300.0") + kind + noise + sea + ORDERS
    sailed = sail_scenario(parse_scenario(text))
    known = sailed.assembly.pilot.estimator.observer
    std = np.sqrt(np.diag(known.covariance)[6:8])
    assert (
        np.abs(np.subtract(known.motion.force[:2], (20.0, -10.0))) < 3.0 * std
    ).all() and std.max() < 15.0  # half of its initial value
    assert np.hypot(sailed.numbers["final_north_m"] - 6.0, sailed.numbers["final_east_m"] + 4.0) < 0.5


def test_a_filter_that_knows_the_waves_does_not_follow_them():
    waves = "[environment.waves]\ndisplacement_std = 0.3\nfrequency = 0.8\n"
    kind = '[vessel]\nkind = "low-speed"\n[estimator]\nkind = "vessel-filter"\n'
    text = HOLD.replace("rate = 1.0", "rate = 5.0") + kind + waves + "[[orders]]\nnorth = 0.0\neast = 0.0\n"
    known = "[estimator.positioning]\nwave_std = 0.3\n"
    knowing, ignorant = (sail_scenario(parse_scenario(text + each)) for each in (known, ""))
    spread = [np.std(each.run["estimated_north"]) for each in (knowing, ignorant)]
    assert spread[0] < 0.7 * spread[1]


@pytest.mark.parametrize(
    "change, words",
    [
        (('"cybership2"', '"otter"'), "orders hold a position, which a vessel of kind otter cannot, expected one of"),
        (('kind = "tekf"', 'kind = "five-state"'), 'estimator.kind is "five-state", expected one of vessel-filter'),
        (("[compass]\nrate = 10.0\nstd_deg = 0.5", ""), 'estimator.kind "tekf" needs a compass'),
        (("course_deg = 45.0", "speed = 1.0"), r"orders\[1\]\.speed has no effect where orders hold a position"),
        (("[[orders]]", "[speed]\ncruise = 1.0\n[[orders]]"), r"speed\.cruise has no effect where orders hold"),
        (("north = ", "# north = "), 'estimator.kind "tekf" needs positions to hold'),
    ],
)
def test_what_cannot_be_held_is_refused(change, words):
    text = P2.replace(*change).replace("\neast = ", "\n# east = ") if "north" in change[0] else P2.replace(*change, 1)
    with pytest.raises(InputError, match=words):
        parse_scenario(text)


def test_a_vessel_that_no_body_has_is_refused():
    text = '[vessel]\nkind = "low-speed"\ninertia = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]\n'
    with pytest.raises(InputError, match="expected a positive definite matrix"):
        parse_scenario(text + "[[orders]]\nnorth = 0.0\n[estimator]\nkind = 'truth'\n")


@pytest.mark.parametrize("kind", ["low-speed", "cybership2"])
def test_these_vessels_follow_a_route_too(kind):
    corner = "[route]\nwaypoints = [{ north = 0, east = 0 }, { north = 60, east = 0 }, { north = 60, east = 40 }]\n"
    numbers = sail_scenario(parse_scenario(f'step = 0.1\n[vessel]\nkind = "{kind}"\n{corner}')).numbers
    assert (numbers["waypoints_reached"], numbers["waypoints_missed"]) == (2.0, 0.0)
