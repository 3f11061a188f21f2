"""The Otter against golden numbers, against the matrix form, and against the symmetries of water and space."""

import math
from itertools import pairwise

import numpy as np
import pytest

from steerway import InputError
from steerway.vessels import CALM, Otter, conditions
from steerway.vessels.testing import PROPELLER_MAX, PROPELLER_MIN, mass_matrix
from steerway.vessels.testing import otter_derivatives as derivatives
from steerway.vessels.testing import otter_thrust as thrust
from tests import otter_by_matrices
from tests.golden import assert_golden, columns, golden

STATE = ("u", "v", "w", "p", "q", "r", "x", "y", "z", "phi", "theta", "psi")
LOAD = (25.0, (0.05, 0.0, -0.35))
MIRROR = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1.0])


def some_states(n=40, seed=0):
    """States and inputs all over the place, with payload off the centre line."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        state = rng.normal(0.0, [1.5, 0.5, 0.2, 0.2, 0.2, 0.4, 50, 50, 0.05, 0.1, 0.1, 2.0])
        propellers = rng.uniform(-130.0, 130.0, 2)
        payload = rng.uniform(0.0, 45.0), tuple(rng.normal(0.0, [0.2, 0.1, 0.2]))
        yield state, propellers, payload, (rng.uniform(0.0, 0.8), rng.uniform(-math.pi, math.pi))


def test_derivatives_match_the_golden_rows(shared_data):
    table = golden(shared_data, "otter_derivs")
    expected = columns(table, *("d" + name for name in STATE))
    states = columns(table, *STATE)
    inputs = columns(table, "n1", "n2", "mp", "rpx", "rpy", "rpz", "V_c", "beta_c")
    measured = [derivatives(x, i[:2], i[2], i[3:6], i[6], i[7]) for x, i in zip(states, inputs, strict=True)]
    assert_golden(measured, expected)
    assert_golden(np.linalg.norm(states[:, :3], axis=1), table["U"])


def test_the_mass_matrix_matches_the_golden_rows(shared_data):
    for row in golden(shared_data, "otter_M").tolist():
        assert_golden(mass_matrix(row[0], LOAD[1]), np.reshape(row[1:], (6, 6)).T)


def test_an_open_loop_run_matches_the_golden_rows(shared_data):
    table = golden(shared_data, "otter_step")
    otter = Otter(*LOAD, propeller_lag=0.0)
    weather = conditions(current=(0.3 * math.cos(math.radians(30)), 0.3 * math.sin(math.radians(30))))
    state, measured = otter.start(), []
    for k in range(10 * len(table)):
        row = table[k // 10]
        if k % 10 == 0:
            measured.append(state[:12])
        # The golden input at a row holds from that row on; the last step before a change may fall between two rows.
        state = otter.step(state, (row["n1"], row["n2"]), weather, 0.02)
    assert_golden(measured, columns(table, *STATE))


@pytest.mark.parametrize("edition", ["today", "2021"])
def test_the_vector_equations_equal_the_matrix_form(edition):
    for state, propellers, payload, current in some_states():
        expected = otter_by_matrices.derivatives(state, propellers, *payload, *current, edition)
        assert_golden(derivatives(state, propellers, *payload, *current, edition), expected)


def test_the_edition_of_2021_has_its_masses():
    mass = mass_matrix(25.0, (0.0, 0.0, -0.35), "2021")
    assert mass[0, 0] == pytest.approx(85.28, abs=0.005)
    assert mass[1, 1] == pytest.approx(162.5)
    assert mass[5, 5] == pytest.approx(41.445, abs=0.0005)


def test_the_edition_of_2021_trims_bow_down_by_its_moment():
    otter = Otter(25.0, (0.0, 0.0, -0.35), edition="2021")
    state = otter.start()
    for _ in range(2000):
        state = otter.step(state, (0.0, 0.0), CALM, 0.02)
    assert math.degrees(state[10]) == pytest.approx(-7.5, abs=1.5)  # "−7.5°" is what the moment was chosen for
    np.testing.assert_allclose(state[[0, 1, 5, 7, 9, 11]], 0.0, atol=1e-12)


@pytest.mark.parametrize("edition", ["today", "2021"])
def test_a_mirrored_boat_does_the_mirrored_thing(edition):
    for state, (left, right), (mass, (x, y, z)), (speed, direction) in some_states():
        rates = derivatives(state, (left, right), mass, (x, y, z), speed, direction, edition)
        mirrored = derivatives(MIRROR * state, (right, left), mass, (x, -y, z), speed, -direction, edition)
        np.testing.assert_allclose(mirrored, MIRROR * rates, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("edition", ["today", "2021"])
def test_a_rotated_scene_gives_rotated_motion(edition):
    for angle, (state, propellers, payload, (speed, direction)) in enumerate(some_states()):
        rates = derivatives(state, propellers, *payload, speed, direction, edition)
        turned = state.copy()
        turned[11] += angle
        measured = derivatives(turned, propellers, *payload, speed, direction + angle, edition)
        c, s = math.cos(angle), math.sin(angle)
        rates[6], rates[7] = rates[6] * c - rates[7] * s, rates[6] * s + rates[7] * c
        np.testing.assert_allclose(measured, rates, rtol=1e-9, atol=1e-9)


def test_where_she_is_does_not_matter():
    for state, propellers, payload, current in some_states(5):
        away = state.copy()
        away[6:8] += 1000.0, -2000.0
        np.testing.assert_array_equal(
            derivatives(state, propellers, *payload, *current), derivatives(away, propellers, *payload, *current)
        )


def test_a_drifting_boat_that_does_not_turn_feels_only_the_water():
    """Galilei: in a uniform current everything is as in still water, carried along."""
    otter = Otter(propeller_lag=0.0)
    still, drifting = otter.start(speed=1.0), otter.start(speed=1.0)
    current = (0.3, -0.4)
    drifting[:2] += current  # heading north
    weather = conditions(current=current)
    for _ in range(1500):
        still = otter.step(still, (60.0, 30.0), CALM, 0.02)
        drifting = otter.step(drifting, (60.0, 30.0), weather, 0.02)
    carried = drifting[6:8] - 30.0 * np.array(current)
    # The current is laid along the hull by heading alone, so a heeling hull departs in the second order of her heel.
    np.testing.assert_allclose(carried, still[6:8], atol=0.02)
    assert drifting[11] == pytest.approx(still[11], abs=0.01)
    assert abs(still[11]) > 1.0


@pytest.mark.parametrize("payload", [(0.0, (0.0, 0.0, 0.0)), LOAD])
def test_gyroscopic_forces_do_no_work(payload):
    """νᵀC(ν)ν = 0: what turns velocities about neither makes nor eats energy."""
    from steerway.vessels.testing import _inertial_forces, loaded

    hull = loaded(*payload, "today")
    for state, *_ in some_states():
        forces = np.array(_inertial_forces(hull, *state[:6]))
        assert abs(forces @ state[:6]) < 1e-12 * np.linalg.norm(forces) * np.linalg.norm(state[:6])
        assert np.linalg.norm(forces) > 1e-3


@pytest.mark.parametrize("edition", ["today", "2021"])
def test_a_boat_left_alone_comes_to_rest(edition):
    otter = Otter(*LOAD, edition=edition)
    state = otter.start(speed=2.0)
    state[1], state[5] = 0.4, 0.5
    energies = []
    for k in range(3000):
        if k % 500 == 0:
            energies.append(state[:6] @ mass_matrix(*LOAD, edition) @ state[:6])
        state = otter.step(state, (0.0, 0.0), CALM, 0.02)
    assert all(after < before for before, after in pairwise(energies))
    np.testing.assert_allclose(state[[0, 5]], 0.0, atol=2e-3)


def test_propellers_saturate_and_pull_less_astern():
    assert thrust(1000.0) == thrust(PROPELLER_MAX) == pytest.approx(0.5 * 24.4 * 9.81)
    assert thrust(-1000.0) == thrust(PROPELLER_MIN) == pytest.approx(-0.5 * 13.6 * 9.81)
    assert thrust(50.0) > -thrust(-50.0) > 0.0
    at_limit = derivatives(np.zeros(12), (PROPELLER_MAX, PROPELLER_MIN))
    np.testing.assert_array_equal(derivatives(np.zeros(12), (150.0, -150.0)), at_limit)


def test_the_left_propeller_turns_her_to_starboard():
    assert derivatives(np.zeros(12), (80.0, 60.0))[5] > 0.0


def test_she_reaches_six_knots_at_full_power():
    otter, state = Otter(), Otter().start()
    for _ in range(1500):
        state = otter.step(state, (PROPELLER_MAX, PROPELLER_MAX), CALM, 0.02)
    assert state[0] == pytest.approx(6.0 * 0.5144, rel=0.01)


def test_propellers_follow_with_their_lag():
    otter = Otter(propeller_lag=0.5)
    state = otter.start()
    for _ in range(25):
        state = otter.step(state, (80.0, 500.0), CALM, 0.02)
    expected = (1.0 - math.exp(-1.0)) * np.array([80.0, PROPELLER_MAX])
    np.testing.assert_allclose(state[12:], expected, rtol=1e-6)


def test_euler_is_euler_and_runge_kutta_is_of_fourth_order():
    def after(method, step, seconds=2.0):
        otter = Otter(propeller_lag=0.5, method=method)
        state = otter.start(speed=1.0)
        for _ in range(round(seconds / step)):
            state = otter.step(state, (80.0, 40.0), CALM, step)
        return state

    otter = Otter(propeller_lag=0.5, method="euler")
    state = otter.start(speed=1.0)
    state[12:] = 30.0, 20.0
    hull = state[:12] + 0.1 * derivatives(state[:12], state[12:])
    expected = [*hull, 30.0 + 0.1 * (80.0 - 30.0) / 0.5, 20.0 + 0.1 * (40.0 - 20.0) / 0.5]
    np.testing.assert_allclose(otter.step(state, (80.0, 40.0), CALM, 0.1), expected, rtol=1e-12)
    true = after("rk4", 0.0025)
    coarse, fine = (np.abs(after("rk4", step) - true).max() for step in (0.04, 0.02))
    assert 8.0 < coarse / fine < 32.0
    assert 1.6 < np.abs(after("euler", 0.004) - true).max() / np.abs(after("euler", 0.002) - true).max() < 2.4


def test_a_force_on_the_hull_pushes_where_it_points():
    otter = Otter(propeller_lag=0.0)
    for heading in (0.0, 1.0, -2.5):
        state = otter.start(heading=heading)
        for _ in range(5):
            state = otter.step(state, (0.0, 0.0), conditions(force=(3.0, 4.0), moment=2.0), 0.02)
        pushed = state[6:8] @ [3.0, 4.0]
        assert pushed > 0.0 and state[5] > 0.0


def test_motion_says_what_the_track_does():
    otter = Otter(*LOAD, propeller_lag=0.1)
    weather = conditions(current=(0.3, 0.2))
    state = otter.start(heading=1.0, speed=1.0)
    for _ in range(100):
        state = otter.step(state, (80.0, 40.0), weather, 0.02)
    now = otter.motion(state, weather)
    held = tuple(state[12:])
    h = 1e-4
    ahead = otter.motion(otter.step(state, held, weather, h), weather)
    assert (ahead.north - now.north) / h == pytest.approx(now.north_velocity, abs=1e-3)
    assert (ahead.east - now.east) / h == pytest.approx(now.east_velocity, abs=1e-3)
    assert (ahead.heading - now.heading) / h == pytest.approx(now.yaw_rate, abs=1e-3)
    assert (ahead.cog - now.cog) / h == pytest.approx(now.course_rate, rel=1e-3)
    assert now.surge == pytest.approx(state[0] - 0.3 * math.cos(now.heading) - 0.2 * math.sin(now.heading))
    assert now.sway == pytest.approx(state[1] + 0.3 * math.sin(now.heading) - 0.2 * math.cos(now.heading))


def test_a_boat_at_rest_has_no_course_rate():
    otter = Otter()
    assert math.isnan(otter.motion(np.zeros(14), CALM).course_rate)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Otter(payload_mass=-1.0), "payload_mass is -1.0"),
        (lambda: Otter(payload_mass=46.0), "payload_mass is 46.0"),
        (lambda: Otter(5.0, (0.0, 0.0)), "payload_position"),
        (lambda: Otter(edition="2030"), "edition is '2030'"),
        (lambda: Otter(propeller_lag=-1.0), "propeller_lag"),
        (lambda: Otter(method="heun"), "method is 'heun'"),
        (lambda: derivatives(np.zeros(12), (0.0, 0.0), edition=""), "edition"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(InputError, match=message):
        make()
