"""The propeller's curve, the shaft, the surge-only boat and P3's USV in three degrees of freedom."""

import math

import numpy as np
import pytest

from steerway import InputError
from steerway.vessels import CALDAS_MASS, CALM, Actuator, Caldas, Propeller, Surge, conditions, published_surrogate
from steerway.vessels.testing import follow, thrust_coefficient
from steerway.vessels.testing import propeller_thrust as thrust
from steerway_studies.testing import theory

CURVE = Propeller().curve()


@pytest.mark.parametrize(
    ("advance", "expected"),
    [(-2.0, 0.2), (-1.0, 0.2), (-0.75, 0.27), (-0.5, 0.34), (0.0, 0.32), (0.35, 0.22), (0.7, 0.12), (0.85, 0.06)],
)
def test_the_curve_is_table_2(advance, expected):
    assert thrust_coefficient(advance, CURVE) == pytest.approx(expected, abs=1e-12)


def test_erratum_beyond_the_table_the_last_segment_goes_on_to_three():
    assert thrust_coefficient(1.5, CURVE) == pytest.approx(-0.2)
    assert thrust_coefficient(3.0, CURVE) == thrust_coefficient(50.0, CURVE) == pytest.approx(-0.8)


def test_erratum_a_shaft_at_rest_gives_no_thrust_and_astern_is_negative():
    assert thrust(3.0, 0.0, CURVE) == 0.0
    assert thrust(0.0, -10.0, CURVE) == -thrust(0.0, 10.0, CURVE) < 0.0


def test_thrust_at_bollard_is_the_formula():
    """(12): 2 η K_t ρ D⁴ n²; over the mass this is the 0.01086 n² of (13) at bollard."""
    assert thrust(0.0, 10.0, CURVE) == pytest.approx(2 * 0.8 * 0.32 * 1025.0 * 0.8**4 * 100.0)
    assert thrust(0.0, 1.0, CURVE) / CALDAS_MASS == pytest.approx(0.01086, abs=5e-6)


def test_erratum_g_is_no_constant():
    for speed, shaft, expected in ((3.0, 5.975, 0.00477), (6.0, 10.529, 0.00390), (9.0, 15.093, 0.00346)):
        assert thrust(speed, shaft, CURVE) / shaft**2 / CALDAS_MASS == pytest.approx(expected, abs=1e-5)


def test_the_wake_slows_the_water_to_the_propeller():
    wake = Propeller(wake_fraction=0.25).curve()
    assert thrust(4.0, 9.0, wake) == pytest.approx(thrust(3.0, 9.0, CURVE))


def sail(boat, state, command, seconds, weather=CALM, step=0.01):
    for _ in range(round(seconds / step)):
        state = boat.step(state, command, weather, step)
    return state


@pytest.mark.parametrize(("speed", "shaft"), [(3.0, 5.975), (6.0, 10.529), (9.0, 15.093)])
def test_the_steady_states_of_plant_t(speed, shaft):
    assert sail(Surge(), Surge().start(speed=speed), (shaft,), 300.0, step=0.05)[3] == pytest.approx(speed, abs=0.003)


def test_the_top_speed_of_plant_t():
    assert sail(Surge(), Surge().start(), (100.0,), 300.0, step=0.05)[3] == pytest.approx(10.59, abs=0.02)


def test_the_surrogate_is_the_published_equation():
    """u̇ = −0.0040839 u|u| + 0.0373039 K_t(u/0.8n) n|n|."""
    kt = thrust_coefficient(2.5 / (0.8 * 7.0), CURVE)
    expected = -0.0040839 * 2.5**2 + 0.0373039 * kt * 49.0
    assert published_surrogate().acceleration(2.5, 7.0) == pytest.approx(expected, rel=1e-12)


def test_a_shaft_follows_its_lag_exactly_and_its_rate_at_most():
    assert follow(1.0, 9.0, 0.0, 17.5, math.inf, 2.0, 0.5) == pytest.approx(9.0 - 8.0 * math.exp(-0.25))
    assert follow(1.0, 9.0, 0.0, 17.5, 2.0, 0.0, 0.5) == pytest.approx(2.0)
    assert follow(1.0, -9.0, 0.0, 17.5, 2.0, 2.0, 0.5) == pytest.approx(1.0 - 1.0 * (1.0 - math.exp(-0.25)))
    assert follow(1.0, 99.0, 0.0, 17.5, math.inf, 0.0, 0.5) == 17.5


def test_a_boat_adrift_takes_the_current_s_speed_and_wind_pushes_her():
    boat, stream = Surge(), conditions(current=(0.5, 0.3))
    state = sail(boat, boat.start(), (0.0,), 400.0, stream, step=0.1)
    motion = boat.motion(state, stream)
    assert motion.north_velocity == pytest.approx(0.5, abs=1e-3) and motion.east_velocity == pytest.approx(0.3)
    assert motion.surge == pytest.approx(0.0, abs=1e-3)
    pushed = boat.step(boat.start(heading=math.pi / 2), (0.0,), conditions(force=(7.0, 1000.0)), 0.01)
    assert pushed[3] == pytest.approx(0.01 * 1000.0 / CALDAS_MASS, rel=1e-3)


def test_a_current_that_begins_does_not_jerk_her_over_ground():
    boat = Surge()
    state = boat.start(speed=3.0)
    assert boat.step(state, (6.0,), conditions(current=(0.5, 0.0)), 0.01)[3] == pytest.approx(3.0, abs=0.01)


def test_three_degrees_of_freedom_straight_ahead_are_the_surge_boat():
    machine = Actuator("shaft speed", 0.0, 17.5, rate=3.0, lag=0.7)
    weather = conditions(current=(0.4, 0.0), force=(500.0, 0.0))
    line = sail(Surge(shaft=machine), Surge().start(speed=1.0), (9.0,), 20.0, weather)
    plane = sail(Caldas(shaft=machine), Caldas().start(speed=1.0), (9.0, 0.0), 20.0, weather)
    assert plane[3] == pytest.approx(line[3], rel=1e-9) and plane[6] == line[4]
    assert plane[0] == pytest.approx(line[0], rel=1e-4)
    assert plane[1] == plane[2] == plane[4] == plane[5] == 0.0


def test_she_is_the_same_to_port_and_to_starboard_and_on_every_heading():
    boat, c, s = Caldas(), math.cos(0.7), math.sin(0.7)
    start = np.array([0.0, 0.0, 0.0, 4.0, 0.2, 0.05, 9.0])
    weather = conditions(current=(0.3, -0.2), force=(300.0, 800.0), moment=4000.0)
    here = sail(boat, start, (9.0, 3e4), 5.0, weather)
    flip = np.array([1, -1, -1, 1, -1, -1, 1])
    mirrored = conditions(current=(0.3, 0.2), force=(300.0, -800.0), moment=-4000.0)
    np.testing.assert_allclose(sail(boat, start * flip, (9.0, -3e4), 5.0, mirrored), here * flip, atol=1e-12)
    turned = conditions(
        current=(0.3 * c + 0.2 * s, 0.3 * s - 0.2 * c), force=(300 * c - 800 * s, 300 * s + 800 * c), moment=4000.0
    )
    there = sail(boat, start + np.array([0, 0, 0.7, 0, 0, 0, 0]), (9.0, 3e4), 5.0, turned)
    expected = [here[0] * c - here[1] * s, here[0] * s + here[1] * c, here[2] + 0.7, *here[3:]]
    np.testing.assert_allclose(there, expected, atol=1e-9)


def test_a_current_carries_her_as_she_sails_without_it():
    """Galilei: in a frame that drifts with a steady current nothing differs."""
    boat = Caldas()
    start = np.array([0.0, 0.0, 0.3, 4.0, 0.2, 0.05, 9.0])
    calm = sail(boat, start, (9.0, 5e4), 8.0)
    stream = conditions(current=(0.6, -0.4))
    carried = start.copy()
    carried[3] += 0.6 * math.cos(0.3) - 0.4 * math.sin(0.3)
    carried[4] += -0.6 * math.sin(0.3) - 0.4 * math.cos(0.3)
    there = sail(boat, carried, (9.0, 5e4), 8.0, stream)
    assert there[2] == pytest.approx(calm[2], rel=1e-6) and there[5] == pytest.approx(calm[5], rel=1e-6)
    np.testing.assert_allclose(there[:2] - calm[:2], [0.6 * 8.0, -0.4 * 8.0], rtol=1e-5)
    still, moving = boat.motion(calm, CALM), boat.motion(there, stream)
    assert moving.surge == pytest.approx(still.surge, rel=1e-6) and moving.sway == pytest.approx(still.sway, rel=1e-5)


def test_motion_says_what_the_track_does():
    boat, weather, h = Caldas(), conditions(current=(0.5, -0.3)), 1e-4
    state = sail(boat, boat.start(speed=5.0), (9.0, 1e5), 4.0, weather)
    now, ahead = (
        boat.motion(state, weather),
        boat.motion(sail(boat, state, (9.0, 0.0), h, weather, step=h), weather),
    )
    assert (ahead.north - now.north) / h == pytest.approx(now.north_velocity, rel=1e-3)
    assert (ahead.east - now.east) / h == pytest.approx(now.east_velocity, rel=1e-3)
    assert (ahead.cog - now.cog) / h == pytest.approx(now.course_rate, rel=1e-2)


@pytest.mark.parametrize("speed", [3.0, 6.0])
def test_erratum_straight_ahead_is_unstable_without_a_heading_loop(speed):
    assert theory.growth(speed) / speed == pytest.approx(0.139, rel=0.02)
    assert theory.least_stiffness(speed) / speed**2 == pytest.approx(6.41e3, rel=0.05)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Surge(mass=0.0), "surge.mass is 0"),
        (lambda: Surge(linear_drag=-1.0), "surge.linear_drag is -1"),
        (lambda: Propeller(wake_fraction=1.0), "wake_fraction is 1"),
        (lambda: Propeller(advance=(0.0, 0.0), coefficient=(0.3, 0.1)), "expected rising ratios"),
        (lambda: Propeller(diameter=math.nan), "propeller.diameter is nan"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(InputError, match=message):
        make()
