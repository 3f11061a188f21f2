"""The Mariner-class ship against golden numbers, her turning circles, and the symmetries of space."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.vessels import CALM, Mariner, conditions
from steerway.vessels.testing import RUDDER
from steerway.vessels.testing import mariner_derivatives as derivatives
from tests.golden import assert_golden, columns, golden

STATE = ("u", "v", "r", "x", "y", "psi", "delta")


def test_derivatives_match_the_golden_rows(shared_data):
    table = golden(shared_data, "mariner_derivs")
    states = columns(table, *STATE)
    measured = [derivatives(x, ui, u0) for x, ui, u0 in zip(states, table["ui"], table["U0"], strict=True)]
    assert_golden(measured, columns(table, *("d" + name for name in STATE)))
    assert_golden(np.hypot(table["U0"] + table["u"], table["v"]), table["U"])


TWENTY = math.radians(20.0)


def zigzag(ship, execute=TWENTY, start=9.5, seconds=601.0, step=0.1):
    """States and rudder commands of a zigzag: the rudder goes over whenever the heading has swung as far.

    The golden run executes "at 10 s" in whole seconds, rounded: at 9.5 s.
    """
    state, rudder = ship.start(), 0.0
    for k in range(round(seconds / step)):
        if k * step >= start - 1e-9 and rudder == 0.0:
            rudder = execute
        if rudder and state[5] * math.copysign(1.0, rudder) >= execute:
            rudder = -rudder
        yield state, rudder
        state = ship.step(state, (rudder,), CALM, step)


def test_a_zigzag_matches_the_golden_rows(shared_data):
    table = golden(shared_data, "mariner_zigzag")
    rows = list(zigzag(Mariner(method="euler")))[::10]
    n = min(len(rows), len(table))
    assert n > 600
    assert_golden([state for state, _ in rows[:n]], columns(table, *STATE)[:n])
    assert_golden([rudder for _, rudder in rows[:n]], table["ui"][:n])


def test_the_first_overshoot_of_the_zigzag():
    headings = [state[5] for state, _ in zigzag(Mariner(method="euler"), seconds=200.0)]
    assert math.degrees(max(headings)) - 20.0 == pytest.approx(7.853, abs=0.001)


def settled(rudder, seconds=1500.0, **ship):
    ship = Mariner(**ship)
    state = ship.start()
    for _ in range(round(seconds / 0.1)):
        state = ship.step(state, (rudder,), CALM, 0.1)
    return ship.motion(state, CALM)


def test_steady_turning_circles():
    """The known radius is that of 35° to port; a single screw turns her tighter to starboard."""
    port, starboard = (settled(math.radians(angle)) for angle in (-35.0, 35.0))
    assert port.yaw_rate < 0.0 < starboard.yaw_rate
    assert port.sog / -port.yaw_rate == pytest.approx(575.7, abs=0.05)
    assert starboard.sog / starboard.yaw_rate == pytest.approx(555.7, abs=0.05)
    assert port.course_rate == pytest.approx(port.yaw_rate, rel=1e-6)


@pytest.mark.parametrize(("degrees", "gain"), [(0.5, 0.439), (5.0, 0.085), (10.0, 0.051), (20.0, 0.030)])
def test_turning_rate_for_a_rudder(degrees, gain):
    """r/δ falls with the rudder: one Nomoto gain does not describe her."""
    rudder = math.radians(degrees)
    assert settled(rudder, seconds=3000.0).yaw_rate / rudder == pytest.approx(gain, abs=0.0006)


def test_the_rudder_obeys_its_engine():
    assert derivatives(np.zeros(7), 1.0)[6] == -RUDDER.rate
    assert derivatives(np.zeros(7), 0.02)[6] == pytest.approx(-0.02 / RUDDER.lag)
    assert settled(2.0, seconds=60.0).yaw_rate == settled(RUDDER.high, seconds=60.0).yaw_rate


def test_a_rotated_scene_gives_rotated_motion():
    ship, force, current, angle = Mariner(), np.array([3e4, -2e4]), np.array([0.4, 0.3]), 2.2
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    here, there = ship.start(), ship.start(heading=angle)
    for _ in range(3000):
        here = ship.step(here, (0.2,), conditions(current, force, 1e5), 0.1)
        there = ship.step(there, (0.2,), conditions(turn @ current, turn @ force, 1e5), 0.1)
    np.testing.assert_allclose(there[3:5], turn @ here[3:5], rtol=1e-9)
    np.testing.assert_allclose(there[[0, 1, 2, 6]], here[[0, 1, 2, 6]], rtol=1e-9)
    assert there[5] - here[5] == pytest.approx(angle)


def test_forces_accelerate_masses_of_their_size():
    """Newton at the first instant: force over mass and added mass, in kg."""
    ship = Mariner()
    unit = 0.5 * 1025.0 * 160.93**3 * 1e-5
    calm = ship.step(ship.start(), (0.0,), CALM, 1e-6)
    pushed = ship.step(ship.start(), (0.0,), conditions(force=(1e6, 0.0)), 1e-6)
    assert (pushed[0] - calm[0]) / 1e-6 == pytest.approx(1e6 / ((798 + 42) * unit), rel=1e-6)
    turned = ship.step(ship.start(), (0.0,), conditions(moment=1e8), 1e-6)
    yaw = (turned[2] - calm[2]) / 1e-6
    sway = (turned[1] - calm[1]) / 1e-6
    length = 160.93
    gx = 798 * -0.023
    assert (39.2 + 43.8) * unit * length**2 * yaw + (gx - 4.646) * unit * length * sway == pytest.approx(1e8, rel=1e-6)
    assert (798 + 748) * unit * sway + (gx + 9.354) * unit * length * yaw == pytest.approx(0.0, abs=1.0)


def test_a_current_carries_her():
    ship, current = Mariner(), (0.5, -1.0)
    still, carried = ship.start(), ship.start()
    for _ in range(1000):
        still = ship.step(still, (0.1,), CALM, 0.1)
        carried = ship.step(carried, (0.1,), conditions(current), 0.1)
    np.testing.assert_allclose(carried[3:5] - still[3:5], 100.0 * np.array(current), rtol=1e-9)
    motion = ship.motion(carried, conditions(current))
    assert motion.water_speed == pytest.approx(ship.motion(still, CALM).sog)


def test_motion_says_what_the_track_does():
    ship, weather = Mariner(), conditions(current=(0.5, -1.0), force=(1e5, 2e5))
    state = ship.start(heading=1.0)
    for _ in range(400):
        state = ship.step(state, (0.3,), weather, 0.1)
    now, h = ship.motion(state, weather), 1e-3
    ahead = ship.motion(ship.step(state, (-state[6],), weather, h), weather)
    assert (ahead.north - now.north) / h == pytest.approx(now.north_velocity, rel=1e-3)
    assert (ahead.east - now.east) / h == pytest.approx(now.east_velocity, rel=1e-3)
    assert (ahead.cog - now.cog) / h == pytest.approx(now.course_rate, rel=1e-3)


def test_bad_input_is_named():
    with pytest.raises(InputError, match="cruise_speed is 0"):
        Mariner(cruise_speed=0.0)
