"""P0 section 5: the Otter on course commands of 20° and 0°, steered as published and by Steerway's blocks."""

import math
from dataclasses import dataclass, replace

import numpy as np

from steerway.control import OTTER_PROPELLERS, AnglePID, AnglePIDGains, Autopilot, place_poles
from steerway.core import wrap
from steerway.estimation import FilterEstimator, FiveStateFilter, Profile
from steerway.guidance import LineOfSight, Order, Ordered, ReferenceModel
from steerway.identification import YawModel, identify_yaw_from_fixes
from steerway.pilot import Pilot, SteadyForce
from steerway.sensors import Suite, white
from steerway.simulation import Run, sail
from steerway.vessels import CALM, Otter
from steerway_studies.papers.course_autopilot import (
    OTTER_NOMOTO,
    OTTER_PRINTED_GAINS,
    closed_loop_poles,
    propeller_speeds,
    reference_model,
)
from steerway_studies.papers.ekf_5states import Ekf5States

STEP = 0.02
FIX_EVERY = 10  # steps: 5 Hz
DURATION = 40.0
COMMAND = math.radians(20.0)
BACK_AT = 20.0  # s
SPEED = 1.0  # at the start, m/s
FORCE = 100.0  # τ_X, N
LAG = 1.0  # of the propellers, s
REFERENCE_BANDWIDTH = 0.5  # rad/s, with ζ = 1
PRINTED_INERTIA = 41.4  # T/K, kg·m²; K_p = 93.15 was computed from it
PRINTED_DERIVATIVE = 0.889  # s; (68) rounds it

PRODUCT_MOTION = {"speed_noise": 1e-2, "course_rate_noise": 1e-2, "course_rate_decay": 0.1}
"""Steerway's motion model: α2 as in P0, densities that allow a bandwidth of 1 rad/s at 0.1 m of noise."""
RUN_IN = 60.0
"""Time, s, on course 0 before the command, in which the estimate converges."""


def boat() -> Otter:
    """The Otter of the paper: the model's 2021 edition, loaded with 25 kg, propellers that lag by 1 s."""
    return Otter(25.0, (0.0, 0.0, -0.35), "2021", propeller_lag=LAG, method="euler")


def commanded(time: float) -> float:
    """The commanded course, rad: 20° from 0 s, 0 again from 20 s on."""
    return COMMAND if 0.0 <= time < BACK_AT else 0.0


@dataclass(frozen=True, eq=False)
class PublishedRun:
    """A run of the published set-up: (n,), SI, radians. Propeller speeds left and right, (n, 2), ordered and actual."""

    time: np.ndarray
    north: np.ndarray
    east: np.ndarray
    sog: np.ndarray
    cog: np.ndarray
    course_rate: np.ndarray
    estimated_north: np.ndarray
    estimated_east: np.ndarray
    estimated_sog: np.ndarray
    estimated_cog: np.ndarray
    estimated_rate: np.ndarray
    desired: np.ndarray
    commanded: np.ndarray
    turning: np.ndarray


def as_published(noise: float = 0.0, seed: int = 0, duration: float = DURATION) -> PublishedRun:
    """The paper's loop, Euler at 50 Hz: printed filter, (54)–(55) with (68), allocation (60)–(63).

    `noise` is the 1σ of a fix, m. The tuning, Q_d = 5e5·I and R_d = 1e-8·I, is the paper's, for fixes without noise.
    """
    ship, draws = boat(), np.random.default_rng(seed)
    state = ship.start(speed=SPEED)
    ekf = Ekf5States(STEP, FIX_EVERY, "NED", [5e5, 5e5], [1e-8, 1e-8])
    proportional, integral_time, _ = OTTER_PRINTED_GAINS
    desired, integral, rows = (0.0, 0.0, 0.0), 0.0, []
    for k in range(round(duration / STEP) + 1):
        motion = ship.motion(state, CALM)
        fix = np.array([motion.north, motion.east]) + noise * draws.standard_normal(2)
        estimate = ekf.step(*fix)
        error, rate_error = wrap(estimate[3] - desired[0]), estimate[4] - desired[1]
        forward = PRINTED_INERTIA * (desired[2] + desired[1])
        moment = forward - proportional * (error + integral / integral_time + PRINTED_DERIVATIVE * rate_error)
        speeds = propeller_speeds(FORCE, moment)
        true = motion.north, motion.east, motion.sog, motion.cog, motion.course_rate
        rows.append((k * STEP, *true, *estimate, desired[0], *speeds, *state[12:]))
        state = ship.step(state, speeds, CALM, STEP)
        desired = reference_model(*desired, commanded(k * STEP), REFERENCE_BANDWIDTH, 1.0, math.inf, STEP)
        integral += STEP * error
    columns = np.array(rows)
    return PublishedRun(*columns[:, :12].T, columns[:, 12:14], columns[:, 14:])


def product_profile(noise: float) -> Profile:
    """Profile of Steerway's filter for fixes with white noise of this 1σ, m."""
    return Profile(name="otter-course", position_std=noise, **PRODUCT_MOTION)


def steered_by_product(noise: float, bandwidth: float, yaw: YawModel | None, seed: int, run_in=RUN_IN) -> Run:
    """A run with the same command and Steerway's blocks; row 0 is `run_in` s before the command.

    Feedback gains by pole placement at `bandwidth` (rad/s) on the paper's Nomoto model; feedforward from the identified
    course model `yaw`, or from the paper's Nomoto model if `yaw` is None.
    """
    gains = place_poles(1.0 / PRINTED_INERTIA, OTTER_NOMOTO[1], bandwidth)
    if yaw is not None:
        gains = _fed_forward(gains, yaw)
    orders = [Order(run_in, COMMAND), Order(run_in + BACK_AT, 0.0)]
    if run_in > 0.0:
        orders.insert(0, Order(0.0, 0.0))
    pilot = Pilot(
        FilterEstimator(FiveStateFilter(product_profile(noise))),
        Ordered(orders, SPEED),
        LineOfSight(1.0),  # not used, because orders take precedence
        Autopilot(AnglePID(gains), ReferenceModel(REFERENCE_BANDWIDTH)),
        OTTER_PROPELLERS,
        SteadyForce(FORCE),
        cruise=SPEED,
    )
    seconds = run_in + DURATION + STEP
    return sail(boat(), pilot, Suite(white(noise)), seconds, STEP, start=(0.0, 0.0, 0.0, SPEED), seed=seed)


def _fed_forward(gains: AnglePIDGains, yaw: YawModel) -> AnglePIDGains:
    return replace(
        gains,
        rate_feedforward=1.0 / yaw.gain.value,
        acceleration_feedforward=yaw.time_constant.value / yaw.gain.value,
    )


def zigzag(noise: float, seed: int, moment: float = 5.0, turn: float = math.radians(10.0), duration: float = 120.0):
    """A zigzag with ± `moment` N·m, reversed when the estimated course passes ± `turn` (rad).

    Returns (time (n,), moment (n,), fixes), the inputs of `identify_yaw_from_fixes`.
    """
    ship, filter = boat(), FiveStateFilter(product_profile(noise))
    state, receiver = ship.start(speed=SPEED), white(noise)
    stream, rows, side = receiver.start(seed), [], 1.0
    for k in range(round(duration / STEP)):
        motion = ship.motion(state, CALM)
        filter.predict(STEP)
        if fix := stream.step(k * STEP, motion.north, motion.east):
            filter.update_north_east(fix.north, fix.east)
        if side * filter.cog > turn:  # an unknown course compares false
            side = -side
        command = side * moment if filter.underway else 0.0
        rows.append((k * STEP, command, motion.north, motion.east))
        state = ship.step(state, OTTER_PROPELLERS.step(FORCE, command)[:2], CALM, STEP)
    time, moments, north, east = np.array(rows).T
    return time, moments, receiver.fixes(time, north, east, seed)


def identified(noise: float, seed: int) -> YawModel:
    """The Otter's course model, identified from a zigzag with fixes of this 1σ, m."""
    time, moment, fixes = zigzag(noise, seed)
    kept = slice(None, None, 5)
    return identify_yaw_from_fixes(fixes, time[kept], moment[kept])


def turned(gains, start: float, command: float, wrapped: bool, seconds: float = 60.0) -> float:
    """The angle (rad, + to starboard) by which an Otter without yaw rate turns from course `start` to `command`.

    P0 (54) wraps the course error; without that the boat may turn the long way round (unwinding). Simulated with the
    Nomoto model that the gains come from.

    gains: (K_p, T_i, T_d) of P0 (54); with `wrapped` False the error is the plain difference, and there is no integral.
    """
    gain, time_constant = OTTER_NOMOTO
    proportional, integral_time, derivative_time = gains
    course, rate, integral = start, 0.0, 0.0
    for _ in range(round(seconds / STEP)):
        error = course - command
        if wrapped:
            moment = -proportional * (wrap(error) + integral / integral_time + derivative_time * rate)
            integral += STEP * wrap(error)
        else:
            moment = -proportional * (error + derivative_time * rate)
        course += STEP * rate
        rate += STEP * (gain * moment - rate) / time_constant
    return course - start


def gain_numbers() -> dict[str, float]:
    """Gains (57)–(59) for both readings of T and K; poles of (56); angles turned with and without unwinding."""
    placed = place_poles(*OTTER_NOMOTO, bandwidth=1.5)
    by_ratio = place_poles(1.0 / PRINTED_INERTIA, 1.0, bandwidth=1.5)
    gains = (placed.proportional, placed.integral_time, placed.derivative_time)
    poles = np.sort(closed_loop_poles(gains, OTTER_NOMOTO, printed=False).real)[::-1]
    start, command = math.radians(350.0), math.radians(10.0)
    return {
        "gain_k_p": placed.proportional,
        "gain_k_p_from_ratio": by_ratio.proportional,
        "gain_t_d_s": placed.derivative_time,
        "gain_t_i_s": placed.integral_time,
        **{f"pole_{k}_radps": pole for k, pole in enumerate(poles, 1)},
        "unwinding_wrapped_deg": math.degrees(turned(gains, start, command, wrapped=True)),
        "unwinding_unwrapped_deg": math.degrees(turned(gains, start, command, wrapped=False)),
    }
