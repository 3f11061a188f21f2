"""Heading MPC against a solver of its own kind, its limits, its freedom from offset; LQG beside it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

from steerway.control import BiasObserver, HeadingLqg, HeadingMpc, HeadingResponse, InputLimits, LinearPlant
from steerway.control.testing import prediction, steering
from steerway.core import InputError, wrap
from steerway.identification import identify_heading
from steerway.identification.testing import binary_sequence
from steerway.vessels import RPM, Mariner, Nomoto, Springer, conditions
from steerway.vessels.testing import PAPER_YAW, PHYSICAL_YAW
from steerway_studies.testing import OutputCorrectedMpc, autopilot_parts, paper_mpc

pytest.importorskip("daqp")
CALM = conditions()


def by_enumeration(hessian, gradient, upper, lower):
    """min ½ΔᵀHΔ + gᵀΔ with lower ≤ [Δ; ΣΔ] ≤ upper for two unknowns: the best of all points where 0, 1 or 2 limits
    hold.
    """
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
    points = [np.linalg.solve(hessian, -gradient)]
    sides = [(rows[i], bound[i]) for i in range(4) for bound in (upper, lower)]
    for normal, level in sides:
        kkt = np.block([[hessian, normal[:, None]], [normal[None], np.zeros((1, 1))]])
        points.append(np.linalg.solve(kkt, [*-gradient, level])[:2])
    for i, (one, level) in enumerate(sides):
        for other, second in sides[:i]:
            if abs(np.linalg.det([one, other])) > 0.5:
                points.append(np.linalg.solve([one, other], [level, second]))
    slack = 1e-9 * (1.0 + np.abs(upper).max())
    fit = [p for p in points if np.all(rows @ p <= upper + slack) and np.all(rows @ p >= lower - slack)]
    return min(fit, key=lambda p: 0.5 * p @ hessian @ p + gradient @ p)


@pytest.mark.parametrize("yaw", [PAPER_YAW, PHYSICAL_YAW])
def test_equals_a_reference_solver_on_random_cases(yaw):
    mpc, rng = paper_mpc(yaw), np.random.default_rng(1)
    worst = 0.0
    for _ in range(1000):
        mpc.observer.state = rng.standard_normal(3) * [0.05, 0.05, 15.0 * RPM]
        mpc.input = rng.uniform(-300.0, 300.0) * RPM
        wanted = float(mpc._plant.c @ mpc.observer.state[:2]) + rng.standard_normal() * rng.choice((0.01, 0.2, 2.0))
        change = mpc.change(wanted)
        gradient, upper, lower = mpc.problem(wanted)
        best = by_enumeration(mpc.hessian, gradient, upper, lower)
        worst = max(worst, abs(change - best[0]) / RPM)
        assert abs(change) <= (20.0 + 1e-9) * RPM and abs(mpc.input + change) <= (300.0 + 1e-9) * RPM
    assert worst < 1e-9


def test_longer_control_horizon_against_least_distance():
    """H_c = 4 with limits of change only, as a non-negative least squares problem of its dual."""
    plant, limits, observer = autopilot_parts(PHYSICAL_YAW)
    mpc = HeadingMpc(plant, InputLimits(math.inf, limits.change), observer, 12, 4, math.degrees(1.0) ** 2, 0.1 / RPM**2)
    rng = np.random.default_rng(2)
    for _ in range(50):
        mpc.observer.state = rng.standard_normal(3) * [0.05, 0.05, 10.0 * RPM]
        wanted = rng.standard_normal()
        gradient, upper, _ = mpc.problem(wanted)
        factor = np.linalg.cholesky(mpc.hessian)
        centre = np.linalg.solve(mpc.hessian, -gradient)
        walls = np.vstack([np.eye(4), -np.eye(4)])
        room = np.concatenate([upper[:4], upper[:4]]) - walls @ centre
        rows = np.linalg.solve(factor, walls.T).T
        # Lawson and Hanson: the point of least norm with rows·y ≤ room.
        system = np.vstack([-rows.T, -room])
        u, norm = nnls(system, np.array([0.0] * 4 + [1.0]))
        residual = system @ u - np.array([0.0] * 4 + [1.0])
        move = np.zeros(4) if norm < 1e-12 else np.linalg.solve(factor.T, -residual[:4] / residual[4])
        assert mpc.change(wanted) == pytest.approx((centre + move)[0], abs=1e-7 * RPM)


def test_prediction_is_the_plant_run():
    plant = LinearPlant(*PAPER_YAW.matrices())
    free, held, forced = prediction(plant, 10, 3)
    x, u, bias, changes = np.array([0.02, -0.01]), 5.0, 2.0, np.array([1.0, -2.0, 0.5])
    given = free @ [*x, bias] + held * u + forced @ changes
    for i in range(10):
        u += changes[i] if i < 3 else 0.0
        x = plant.a @ x + plant.b * (u + bias)
        assert given[i] == pytest.approx(plant.c @ x, rel=1e-12)


def held_on(autopilot, plant, seconds, bias_rpm=10.0, wanted=1.0):
    """Headings (rad) of a vessel with a biased propeller under an autopilot that sees them."""
    vessel = Springer(plant, bias=bias_rpm * RPM)
    state, out = vessel.start(), []
    for _ in range(seconds):
        heading = vessel.heading(state)
        out.append(heading)
        u = autopilot.step(wanted, heading)
        assert abs(u) <= (300.0 + 1e-9) * RPM and abs(u - state[4]) <= (20.0 + 1e-9) * RPM
        state = vessel.step(state, (u,), CALM, 1.0)
    return np.array(out)


@pytest.mark.parametrize("plant", ["paper", "physical"])
@pytest.mark.parametrize("kind", ["mpc", "lqg"])
def test_no_offset_from_a_bias(plant, kind):
    yaw = PAPER_YAW if plant == "paper" else PHYSICAL_YAW
    weights = {"output_weight": math.degrees(1.0) ** 2, "change_weight": 0.1 / RPM**2}
    autopilot = paper_mpc(yaw) if kind == "mpc" else HeadingLqg(*autopilot_parts(yaw), **weights)
    headings = np.degrees(held_on(autopilot, plant, 3600))
    assert abs(headings[600] - np.degrees(1.0)) < 0.01
    assert abs(headings[-1] - np.degrees(1.0)) < 0.01
    assert autopilot.observer.bias == pytest.approx(10.0 * RPM, rel=0.01)


def test_output_correction_fails_on_the_paper_plant():
    """The form of textbooks, an output error added to a free-running model: the model drifts and steering goes."""
    headings = np.degrees(held_on(OutputCorrectedMpc(paper_mpc(PAPER_YAW)), "paper", 3600))
    assert np.abs(headings[-600:] - np.degrees(1.0)).max() > 10.0


def test_unknown_heading_is_predicted_over_and_turns_are_short():
    mpc = paper_mpc(PHYSICAL_YAW)
    vessel, state = Springer("physical"), Springer("physical").start()
    for k in range(200):
        u = mpc.step(0.5, math.nan if k % 3 else vessel.heading(state))
        state = vessel.step(state, (u,), CALM, 1.0)
    assert vessel.heading(state) == pytest.approx(0.5, abs=0.01)
    assert paper_mpc().step(math.radians(350.0), 0.0) < 0.0 < paper_mpc().step(math.radians(-350.0), 0.0)


@pytest.mark.parametrize("horizon, control_horizon, q, r", [(0, 0, 1, 1), (5, 6, 1, 1), (5, 2, 0, 1), (5, 2, 1, -1)])
def test_unusable_settings_are_named(horizon, control_horizon, q, r):
    with pytest.raises(InputError, match="mpc"):
        HeadingMpc(*autopilot_parts(PAPER_YAW), horizon, control_horizon, q, r)


def test_plants_and_limits_are_checked():
    with pytest.raises(InputError, match="plant"):
        LinearPlant(np.eye(2), np.ones(3), np.ones(2))
    with pytest.raises(InputError, match="limits"):
        InputLimits(-1.0)
    with pytest.raises(InputError, match="limits"):
        InputLimits(math.nan)


def test_observer_is_a_kalman_filter():
    """Against the textbook's matrices."""
    plant = LinearPlant(*PAPER_YAW.matrices(), circular=False)
    observer = BiasObserver(plant, 1e-8, 1e-4, 1e-3, 2.0)
    f = np.block([[plant.a, plant.b[:, None]], [np.zeros((1, 2)), np.ones((1, 1))]])
    h, q = np.append(plant.c, 0.0), np.diag([1e-8, 1e-8, 1e-4])
    x, p, rng = np.zeros(3), np.diag([1e-8, 1e-8, 2.0]), np.random.default_rng(0)
    for _ in range(30):
        z, u = rng.standard_normal(2)
        gain = p @ h / (h @ p @ h + 1e-3)
        x, p = x + gain * (z - h @ x), p - np.outer(gain, h @ p)
        observer.correct(z)
        np.testing.assert_allclose(observer.state, x, rtol=1e-9)
        x, p = f @ x + np.append(plant.b, 0.0) * u, f @ p @ f.T + q
        observer.predict(u)
    np.testing.assert_allclose(observer.state, x, rtol=1e-9)


def held_course(controller, boat, command, target, seconds, dt, noise=0.0, state=None):
    """(n,) true headings of a boat whose controller steers to a heading."""
    rng, state, headings = np.random.default_rng(0), boat.start() if state is None else state, []
    for _ in range(round(seconds / dt)):
        heading = boat.motion(state, CALM).heading
        wanted = controller.step((target, 0.0, 0.0), wrap(heading + noise * rng.standard_normal()), 0.0, dt)
        state = boat.step(state, command(wanted), CALM, dt)
        headings.append(heading)
    return np.array(headings)


@pytest.mark.parametrize("kind", ["mpc", "lqg"])
@pytest.mark.parametrize(
    ("boat", "gain", "time", "dt"),
    [
        (Nomoto(0.2, 20.0, 2.0, bias=0.05), 0.2, 20.0, 0.1),
        (Mariner(), 0.185, 107.3, 0.2),
    ],
)
def test_any_boat_known_by_nomoto_s_numbers_is_steered_without_offset(kind, boat, gain, time, dt):
    limit, noise = 0.6, math.radians(0.5)
    control = steering(kind, HeadingResponse.of_nomoto(gain, time), limit, angle_std=noise)
    headings = held_course(control, boat, lambda u: (u,), 1.0, 15.0 * time if time < 50.0 else 600.0, dt, noise)
    late = headings[-len(headings) // 4 :]
    assert abs(np.degrees(late.mean() - 1.0)) < 0.5 and np.degrees(np.abs(late - 1.0)).max() < 2.0
    assert headings.max() < 1.0 + (0.3 if kind == "lqg" else 0.1)


def test_an_identified_heading_makes_a_controller_in_its_own_unit():
    rng = np.random.default_rng(1)
    commands = binary_sequence(600, 10, 200.0, rng)
    boat, state, headings = Springer("physical"), Springer("physical").start(), []
    for each in commands:
        headings.append(boat.heading(state))
        state = boat.step(state, (each * RPM,), CALM, 1.0)
    identified = identify_heading(np.arange(600.0), commands, headings)
    control = HeadingMpc.for_(identified, limit=300.0, rate=20.0)
    state, inputs = boat.start(heading=math.radians(170.0)), []
    for _ in range(300):
        inputs.append(control.step(math.radians(-150.0), wrap(boat.heading(state))))
        state = boat.step(state, (inputs[-1] * RPM,), CALM, 1.0)
    assert abs(math.degrees(wrap(boat.heading(state) - math.radians(-150.0)))) < 0.2
    assert np.abs(inputs).max() <= 300.0 + 1e-9 and np.abs(np.diff(inputs)).max() <= 20.0 + 1e-9
    assert boat.heading(state) == pytest.approx(math.radians(210.0), abs=0.01)  # the short way


def test_default_weights_are_the_paper_s_in_proportion_to_the_limits():
    plant, limits, observer = autopilot_parts(PAPER_YAW)
    default, paper = HeadingMpc(plant, limits, observer), paper_mpc()
    np.testing.assert_allclose(default.hessian, paper.hessian, rtol=1e-12)
    first = default.step(1.0, 0.0) / RPM
    assert first == pytest.approx(paper.step(1.0, 0.0) / RPM, abs=1e-6) and first > 15.0
    with pytest.raises(InputError, match=r"mpc\.change_weight is missing"):
        HeadingMpc(plant, InputLimits(), observer)


def test_a_wanted_output_out_of_all_proportion_is_steered_to_at_the_limit():
    """Rounding of the change without limits exceeds the solver's tolerance of them."""
    plant, limits, observer = autopilot_parts(PAPER_YAW)
    control = HeadingMpc(replace(plant, circular=False), limits, observer)
    assert control.step(1e9, 2.5) == limits.change
    with pytest.raises(InputError, match="applied is -inf"):
        control.reset(applied=-math.inf)


def test_the_first_heading_known_is_where_a_controller_begins():
    control = paper_mpc()
    assert control.step(math.pi, math.nan) == 0.0
    control.reset()
    control.step(math.pi, 3.0)
    assert control.observer.output == pytest.approx(3.0, abs=0.01)


def test_sampled_steering_holds_between_samples_and_takes_over_without_a_jump():
    response = HeadingResponse.of_nomoto(0.2, 20.0)
    control = steering("mpc", response, 0.6, angle_std=0.01)
    commands = [control.step((0.5, 0.0, 0.0), 0.0, 0.0, 0.1) for _ in range(41)]
    assert len(set(commands)) == 3 and control.sample == 2.0
    trim = control.integral
    control.start(0.2, (0.5, 0.0, 0.0), 0.4, 0.0)
    assert control.command == 0.2 and control.integral == trim
    control.limited_to(0.1)
    assert control.design.input == 0.1
    with pytest.raises(InputError, match=r"autopilot\.kind is 'pid'"):
        steering("pid", response, 0.6)
    with pytest.raises(InputError, match=r"heading\.limit is 0"):
        steering("lqg", response, 0.0)
