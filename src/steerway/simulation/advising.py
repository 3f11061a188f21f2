"""Check before a run whether the autopilot's loop is well damped, with the scenario's estimator and current.

With the five-state filter this is the course loop of `control.bandwidth`. With the steering filter this is the linear
loop on a leg: line of sight, reference model, heading controller, and the steady Kalman filter of the states across the
leg. The loop is assessed for the boat's declared gain and damping, and with either or both off by the filter's
uncertainty.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from steerway.control.bandwidth import COMFORTABLE, advice, carried_bandwidth
from steerway.control.boats import Boat
from steerway.control.course import AnglePIDGains, YawResponse
from steerway.control.handover import Autopilot
from steerway.control.heading_steering import KINDS
from steerway.control.headway import LEAST_HEADWAY
from steerway.control.in_current import InCurrent
from steerway.core.arrays import Floats
from steerway.core.estimate import NOTHING_KNOWN, Estimate
from steerway.core.kinematics import course_per_heading, heading_for
from steerway.core.leg import LegState
from steerway.estimation.steering import Response
from steerway.estimation.steering.filter import MODEL_SHARE, MODEL_TIME
from steerway.estimation.steering.motion import ERROR_TIME
from steerway.estimation.steering.prediction import bias_density, rate_density
from steerway.estimation.vessel.profile import Profile
from steerway.pilot import response_of
from steerway.sensors.gnss import GnssTable
from steerway.simulation import assembly
from steerway.simulation.corners import wide_turn
from steerway.simulation.scenario import Scenario

_ITERATIONS = 20
"""Fixed-point iterations for a bandwidth; each one at least halves the relative error, so the last is below 1e-6."""
_VELOCITY_STD = 0.1
"""σ of a receiver's velocity in the steering filter, m/s."""
_SHORTLY = 20.0
"""Largest time constant (s) of a receiver's error that is fast enough to enter the loop."""
_FORGOTTEN = 600.0
"""Time constant of the current, s. With a constant current the filter has no steady state, because a straight leg does
not distinguish current and heading."""
_IDENTIFIED = 1.0 / 3.0
"""Assumed ratio of the damping's σ after turns to its initial σ. On the demo's mission the ratio is up to a half."""


class _Estimated(NamedTuple):
    """A row for each state of the steering filter across a straight leg: its unit vector, or its derivative."""

    off_leg: Floats  # cross-track error
    current: Floats  # across the leg
    heading: Floats  # heading minus the steady heading
    rate: Floats
    bias: Floats
    error: Floats  # slow error of the fixes


class _Loop(NamedTuple):
    """Unit vectors of the states of boat, estimate and reference model."""

    off_leg: Floats
    heading: Floats
    rate: Floats
    estimated: _Estimated
    reference: Floats
    reference_rate: Floats
    reference_acceleration: Floats


def _units() -> _Loop:
    off_leg, heading, rate, *estimated, reference, reference_rate, reference_acceleration = np.eye(12)
    model = reference, reference_rate, reference_acceleration
    return _Loop(off_leg, heading, rate, _Estimated(*estimated), *model)


class SteeringLoop(NamedTuple):
    """The loop on one leg: bandwidth of the heading controller (rad/s), smallest damping ratio, and speed (m/s) along
    the leg, 0 if the current is too strong."""

    bandwidth: float
    damping: float
    speed: float


def advise(scenario: Scenario) -> tuple[bool, str]:
    """(whether the estimate supports the scenario's autopilot in its current, and why, in a sentence).

    A second sentence names the turn that exceeds its waypoint's radius of acceptance by most. The speed is the lowest
    of the route. With true states, and with a commanded heading, there is no limit.
    """
    if scenario.estimator.kind == "truth" or scenario.manoeuvre is not None:
        return True, "The pilot uses the true motion: the estimate does not limit the autopilot."
    if scenario.guidance.angle == "heading" or assembly.holds_places(scenario):
        return True, "The pilot controls heading by compass: the course estimate does not limit the autopilot."
    known = assembly.boat(scenario)
    commanded = *(each.speed for each in scenario.route.points), *(each.speed for each in scenario.orders)
    speed = min([*filter(None, commanded), known.cruise])
    if scenario.estimator.kind == "steering":
        fits, sentence = _advise_steering(scenario, known, speed)
        if scenario.orders:
            return fits, sentence
        flow, stays = scenario.environment.current.velocity, assembly.stays(scenario)
        return fits, f"{sentence} {wide_turn(known, assembly.route(scenario, known), flow, stays)}".rstrip()
    profile, interval = assembly.profile(scenario), 1.0 / scenario.gnss.rate
    current, directions = scenario.environment.current.speed, _directions(scenario)
    gains = [_course_gain(each, current, speed) for each in directions]
    std = _as_white_noise(profile, speed, interval)
    numbers = speed, profile.agility, std, interval, known.nomoto_time, known.damping
    return advice(known.bandwidth, *numbers, course_gain=max(gains, default=1.0), current=current)


def _as_white_noise(profile: Profile, speed: float, interval: float) -> float:
    """1σ (m) of white noise with the spectral density of all errors of fixes, slow ones too, at the bandwidth ω_e."""
    std = profile.position_std
    slow = [[getattr(profile, f"{name}_{which}", 0.0) for which in ("std", "time")] for name in ("error", "drift")]
    for _ in range(_ITERATIONS):
        carried = carried_bandwidth(speed, profile.agility, std, interval)
        density = sum(2.0 * size**2 * time / (1.0 + (carried * time) ** 2) for size, time in slow)
        std = math.sqrt(profile.position_std**2 + density / interval)
    return float(f"{std:.2g}")


def _advise_steering(scenario: Scenario, known: Boat, speed: float) -> tuple[bool, str]:
    current = scenario.environment.current.speed
    loops = [steering_loop(known, scenario.gnss, speed, current, each) for each in _directions(scenario)]
    worst = min(loops, key=lambda loop: loop.damping)
    way = "" if current == 0.0 else f" in a current of {current:g} m/s"
    most = f"the boat makes way against a current of up to {tolerated_current(known):.2g} m/s"
    if worst.speed <= 0.0:
        return False, f"The boat cannot follow the route{way}: {most}, so sail faster or wait for a weaker current."
    kind = scenario.autopilot.kind
    assessed = "" if kind == KINDS[0] else f"{KINDS[0]} in place of {kind} and "
    fixes = f"{assessed}fixes of {scenario.gnss.white:g} m every {1.0 / scenario.gnss.rate:g} s"
    loop = (
        f"with {fixes}{way} its bandwidth is {worst.bandwidth:.2g} rad/s and its damping ratio at least "
        f"{worst.damping:.2g}, if the boat responds within 1σ of what the filter expects"
    )
    if worst.damping >= COMFORTABLE:
        return True, f"The steering loop is well damped: {loop}; {most}."
    return False, (
        f"The steering loop is weakly damped: {loop}, expected {COMFORTABLE:g}; {most}. A longer guidance.lookahead or "
        "a receiver with velocity damps it better."
    )


def tolerated_current(boat: Boat) -> float:
    """The strongest current (m/s) against which a boat makes way."""
    return (1.0 - LEAST_HEADWAY) * boat.in_current().top_speed


def steering_loop(boat: Boat, gnss: GnssTable, speed: float, current: float, towards: float) -> SteeringLoop:
    """The loop of a boat with the steering filter, on a northward leg; the current (m/s) flows to `towards` (rad).

    speed: desired speed over ground, m/s.
    """
    steering = boat.in_current()
    north, east = current * math.cos(towards), current * math.sin(towards)
    seen = _steady(steering, speed, north, east)
    if steering.progress(0.0, seen) <= LEAST_HEADWAY * steering.top_speed:
        return SteeringLoop(math.nan, -1.0, 0.0)
    response = response_of(boat)
    turning = seen.water_speed * math.cos(seen.heading)  # m/s across the leg per rad of heading
    dynamics, noise, measured, variances = _estimated(response, seen.water_speed, turning, gnss)
    prior, gain = _steady_kalman(dynamics, noise, measured, variances, 1.0 / gnss.rate)
    posterior = prior - gain @ measured @ prior
    drift = _Estimated(*dynamics).off_leg
    across = math.sqrt(float(drift @ posterior @ drift))
    autopilot = boat.autopilot_in_current()
    steering.tune(autopilot, known := seen._replace(cog_std=across / seen.sog))
    gains = steering.gains(known)
    nearer = steering.with_shorter_lookahead(LegState(1, 0.0, 0.0, 1.0, *[math.nan] * 4), speed, seen).cross_track
    pull = seen.sog * nearer / boat.lookahead
    units, worst = _units(), 1.0
    own = units.estimated
    nothing = np.zeros_like(units.rate)
    true = _Estimated(units.off_leg, nothing, units.heading, units.rate, nothing, nothing)
    unseen = np.array(true) - np.array(own)
    correction = np.eye(unseen.shape[1]) + np.transpose(own) @ gain @ measured @ unseen
    for share in (1.0 - response.gain_std, 1.0, 1.0 + response.gain_std):
        for more in (-_IDENTIFIED * response.damping_std, 0.0, _IDENTIFIED * response.damping_std):
            loop = _closed(steering.response, autopilot, gains, seen, pull, dynamics, turning, share, more)
            step = _exponential(loop / gnss.rate)
            worst = min(worst, _damping(correction @ step))
    return SteeringLoop(_bandwidth(steering.response, gains, seen), worst, seen.sog)


def _steady(steering: InCurrent, speed: float, north: float, east: float) -> Estimate:
    """The estimate of a boat that moves north at a speed over ground (m/s), or as fast as it can."""
    known = {"heading_std": 0.0, "yaw_bias": 0.0, "speed_gain": 1.0}
    water = NOTHING_KNOWN._replace(water_speed=speed, current_north=north, current_east=east, **known)
    water_speed = steering.water_speed(0.0, speed, water)
    heading, along = heading_for(0.0, water_speed, north, east)
    return water._replace(water_speed=water_speed, heading=float(heading), sog=max(float(along), 1e-3))


def _estimated(
    response: Response, speed: float, turning: float, gnss: GnssTable
) -> tuple[Floats, Floats, Floats, Floats]:
    """(dynamics (6, 6), noise densities (6, 6), measurement matrix (k, 6), variances (k,)) across a straight leg, from
    `estimation.steering.motion`: cross-track error, current, heading, yaw rate, bias and slow error."""
    aside = response.wander * response.rate
    # The best linear part of r |r| for a Gaussian rate is √(8/π) σ r (Gelb, Applied Optimal Estimation, 1974).
    damping = response.linear - response.munk * speed**2 + response.quadratic * math.sqrt(8.0 / math.pi) * aside
    state = _Estimated(*np.eye(6))
    dynamics = _Estimated(
        off_leg=state.current + turning * state.heading,
        current=-1.0 / _FORGOTTEN * state.current,
        heading=state.rate,
        rate=-damping / response.time * state.rate + 1.0 / response.time * state.bias,
        bias=0.0 * state.bias,
        error=-1.0 / ERROR_TIME * state.error,
    )
    slow = sum(std**2 for std, time in gnss.markov if time <= _SHORTLY)
    moving = rate_density(True, response.packed), bias_density(response.packed)
    wandering = 2.0 * max(slow, 1e-4) / ERROR_TIME
    noise = np.diag([wandering, response.current_noise, 0.0, *moving, wandering])
    rows, variances = [state.off_leg + state.error], [max(gnss.white, MODEL_TIME * response.speed) ** 2]
    if gnss.velocity_std is not None:
        rows.append(dynamics.off_leg)
        variances.append(max(_VELOCITY_STD, MODEL_SHARE * response.speed) ** 2)
    return np.array(dynamics), noise, np.array(rows), np.array(variances)


def _steady_kalman(
    dynamics: Floats, noise: Floats, measured: Floats, variances: Floats, interval: float
) -> tuple[Floats, Floats]:
    """(prior covariance, gain) of the steady Kalman filter at an interval of fixes, by doubling (Anderson 1978)."""
    a, h = _exponential(interval * dynamics).T, _discrete(dynamics, noise, interval)
    g = measured.T @ (measured / variances[:, None])
    for _ in range(40):
        left = np.linalg.solve(np.eye(len(a)) + g @ h, np.eye(len(a)))
        a, g, before, h = a @ left @ a, g + a @ left @ g @ a.T, h, h + a.T @ h @ left @ a
        if np.max(np.abs(h - before)) < 1e-12 * np.max(np.abs(h)):
            break
    spread = measured @ h @ measured.T + np.diag(variances)
    return h, h @ measured.T @ np.linalg.inv(spread)


def _discrete(dynamics: Floats, noise: Floats, interval: float) -> Floats:
    """∫ exp(A t) Q exp(Aᵀ t) dt over an interval, by Van Loan's block matrix (1978)."""
    n = len(dynamics)
    block = _exponential(interval * np.block([[-dynamics, noise], [np.zeros((n, n)), dynamics.T]]))
    return block[n:, n:].T @ block[:n, n:]


def _bandwidth(response: YawResponse, gains: AnglePIDGains, seen: Estimate) -> float:
    """Magnitude of the slower pole of T s² + (d + K K_p T_d) s + K K_p, rad/s."""
    damping = response.linear - response.munk * seen.water_speed**2
    stiffness = response.gain * gains.proportional
    return float(np.min(np.abs(np.roots([response.time, damping + stiffness * gains.derivative_time, stiffness]))))


def _closed(
    response: YawResponse,
    autopilot: Autopilot,
    gains: AnglePIDGains,
    seen: Estimate,
    pull: float,
    own: Floats,
    turning: float,
    share: float,
    more: float,
) -> Floats:
    """Closed loop (12, 12) of boat, estimate and reference model between fixes. share: factor on the boat's gain; more:
    addition to its damping; pull: speed towards the leg per metre of cross-track error, 1/s."""
    state = _units()
    known, changes = state.estimated, _Estimated(*own @ np.array(state.estimated))
    decay = float(changes.rate @ known.rate)
    damping, stiffness = -decay * response.time, response.gain * gains.proportional
    stiff = stiffness * gains.derivative_time
    order = stiffness * (state.reference - known.heading)  # as the steady yaw rate, rad/s
    order += (damping + stiff) * state.reference_rate - stiff * known.rate
    order += response.time * state.reference_acceleration - known.bias
    quick = autopilot.model.bandwidth
    wanted = -pull / turning * known.off_leg - 1.0 / turning * known.current
    jerk = quick**3 * (wanted - state.reference)
    jerk -= 3.0 * quick**2 * state.reference_rate + 3.0 * quick * state.reference_acceleration
    estimated = changes._replace(rate=changes.rate + order / response.time)
    rate = (decay - more / response.time) * state.rate + share * order / response.time
    model = state.reference_rate, state.reference_acceleration, jerk
    return np.array([turning * state.heading, state.rate, rate, *estimated, *model])


def _damping(step: Floats) -> float:
    """Smallest damping ratio −Re s/|s|, s = log λ, of the eigenvalues λ of a step."""
    roots = np.linalg.eigvals(step)
    poles = np.log(roots[np.abs(roots) > 1e-9].astype(complex))
    return float(np.min(-poles.real / np.maximum(np.abs(poles), 1e-12)))


def _exponential(matrix: Floats) -> Floats:
    """Matrix exponential by scaling, Taylor series and squaring."""
    halvings = max(0, math.ceil(math.log2(max(float(np.linalg.norm(matrix, 1)), 1e-9))) + 4)
    small = matrix / 2.0**halvings
    total = term = np.eye(len(matrix))
    for k in range(1, 9):
        term = term @ small / k
        total = total + term
    return np.linalg.matrix_power(total, 2**halvings)


def _directions(scenario: Scenario) -> list[float]:
    """Direction of the current relative to each leg or ordered course, rad, without repetitions."""
    places = assembly.places(scenario)
    towards = math.radians(scenario.environment.current.direction_deg)
    courses = [math.atan2(e - before_e, n - before_n) for (before_n, before_e), (n, e) in pairwise(places)]
    courses += [each.course for each in assembly.orders(scenario)]
    return sorted({round(towards - each, 6) for each in courses})


def _course_gain(towards: float, current: float, speed: float) -> float:
    """dχ/dψ on a northward leg, of a boat whose course loop is designed without a current."""
    north, east = current * math.cos(towards), current * math.sin(towards)
    heading, water_speed = math.atan2(-east, speed - north), math.hypot(speed - north, east)
    return course_per_heading(water_speed, speed, -heading)
