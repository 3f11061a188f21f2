"""Heading MPC against another QP solver, its limits, control without offset; LQG in comparison."""

import math

import numpy as np
import pytest

from steerway.control import HeadingMpc, HeadingResponse, InputLimits
from steerway.control.testing import steering
from steerway.core import InputError, wrap
from steerway.identification import identify_heading
from steerway.vessels import RPM, Mariner, Nomoto, Springer, conditions
from steerway.vessels.testing import PAPER_YAW, PHYSICAL_YAW
from steerway_studies.testing import autopilot_parts, paper_mpc
from tests.scenes import binary_sequence

pytest.importorskip("daqp")
CALM = conditions()


def by_enumeration(hessian, gradient, upper, lower):
    """min ½ΔᵀHΔ + gᵀΔ with lower ≤ [Δ; ΣΔ] ≤ upper in two unknowns: the best point with 0, 1 or 2 active limits."""
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
    for _ in range(300):
        mpc.observer.state = rng.standard_normal(3) * [0.05, 0.05, 15.0 * RPM]
        mpc.input = rng.uniform(-300.0, 300.0) * RPM
        wanted = mpc.observer.output + rng.standard_normal() * rng.choice((0.01, 0.2, 2.0))
        change = mpc.change(wanted)
        gradient, upper, lower = mpc.problem(wanted)
        best = by_enumeration(mpc.hessian, gradient, upper, lower)
        worst = max(worst, abs(change - best[0]) / RPM)
        assert abs(change) <= (20.0 + 1e-9) * RPM and abs(mpc.input + change) <= (300.0 + 1e-9) * RPM
    assert worst < 1e-9


def test_unknown_heading_is_predicted_over_and_turns_are_short():
    mpc = paper_mpc(PHYSICAL_YAW)
    vessel, state = Springer("physical"), Springer("physical").start()
    for k in range(200):
        u = mpc.step(0.5, math.nan if k % 3 else vessel.heading(state))
        state = vessel.step(state, (u,), CALM, 1.0)
    assert vessel.heading(state) == pytest.approx(0.5, abs=0.01)
    assert paper_mpc().step(math.radians(350.0), 0.0) < 0.0 < paper_mpc().step(math.radians(-350.0), 0.0)


@pytest.mark.parametrize("kind", ["mpc", "lqg"])
@pytest.mark.parametrize(
    ("boat", "gain", "time", "dt"),
    [(Nomoto(0.2, 20.0, 2.0, bias=0.05), 0.2, 20.0, 0.1), (Mariner(), 0.185, 107.3, 0.2)],
)
def test_any_boat_known_by_nomoto_s_numbers_is_steered_without_offset(kind, boat, gain, time, dt):
    limit, noise = 0.6, math.radians(0.5)
    control = steering(kind, HeadingResponse.of_nomoto(gain, time), limit, angle_std=noise)
    rng, state, headings = np.random.default_rng(0), boat.start(), []
    for _ in range(round((15.0 * time if time < 50.0 else 600.0) / dt)):
        headings.append(boat.motion(state, CALM).heading)
        command = control.step((1.0, 0.0, 0.0), wrap(headings[-1] + noise * rng.standard_normal()), 0.0, dt)
        state = boat.step(state, (command,), CALM, dt)
    headings = np.array(headings)
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
    plant, limits, observer = autopilot_parts(PAPER_YAW)
    for make, message in (
        (lambda: steering("pid", response, 0.6), r"autopilot\.kind is 'pid'"),
        (lambda: steering("lqg", response, 0.0), r"heading\.limit is 0"),
        (lambda: HeadingMpc(plant, limits, observer, 5, 6, 1.0, 1.0), "mpc"),
        (lambda: HeadingMpc(plant, InputLimits(), observer), r"mpc\.change_weight is missing"),
        (lambda: InputLimits(math.nan), "limits"),
    ):
        with pytest.raises(InputError, match=message):
            make()
