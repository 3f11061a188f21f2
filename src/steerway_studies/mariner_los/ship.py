"""P1's ship on its route: the set-up of section 4, steered by true states, the printed filter or Steerway's."""

import math
from dataclasses import dataclass

import numpy as np

from steerway.control import AnglePID, Autopilot, Rudder, place_poles
from steerway.core import LegState, markov_std, rms, wrap_array
from steerway.estimation import AtFaceValue, FilterEstimator, FiveStateFilter, Profile
from steerway.guidance import LineOfSight, LowPass, Mission, Route
from steerway.pilot import Pilot
from steerway.sensors import Gnss, Suite, Truth
from steerway.simulation import Run, parse_scenario, sail, sail_scenario
from steerway.vessels import MARINER_CRUISE_SPEED as CRUISE_SPEED
from steerway.vessels import MARINER_RUDDER as RUDDER
from steerway.vessels import Mariner
from steerway_studies.papers.course_autopilot import MARINER_NOMOTO, AlwaysByCourse
from steerway_studies.papers.ekf_5states import Ekf5States, PrintedEstimator

STEP = 0.1
DURATION = 5000.0
NORTH = np.array([0.0, 2000.0, 5000.0, 3000.0, 6000.0, 10000.0])
EAST = np.array([0.0, 0.0, 5000.0, 8000.0, 12000.0, 12000.0])
SWITCH_RADIUS = 50.0
LOOKAHEAD = 800.0
BANDWIDTH = 0.05
LOW_PASS = 40.0
"""Time constant T_lp of the low-pass of the course command, s. P1's rule (44) asks for 100 to 200 s."""

CORRELATION_TIME = 1100.0
PRINTED_NOISE, STATED_NOISE = 0.21, 0.0634
"""Driving noise of the position error per step, m: as printed (stationary σ 15.6 m); and for P1's stated σ of 4.7 m."""

NOISES = {"0p21": PRINTED_NOISE, "0p0634": STATED_NOISE}

SETTLED = 100.0
"""Time, s, after the start from which the errors of an estimate count."""
STEADY = 250.0
"""Time, s, after a switch from which a leg counts as straight: low-pass and line of sight have settled."""


@dataclass(frozen=True)
class ShipCase:
    """One run: its feedback, "truth", "printed" or "product", and its conditions."""

    feedback: str
    noise: float = PRINTED_NOISE  # driving noise, m per step
    low_pass: float = LOW_PASS  # s
    turned: float = 0.0  # rotation of the scene, rad
    seed: int = 0


def route(turned: float = 0.0) -> Route:
    """P1's six waypoints, the scene turned about the first."""
    c, s = math.cos(turned), math.sin(turned)
    return Route(NORTH * c - EAST * s, NORTH * s + EAST * c, SWITCH_RADIUS)


def receiver(noise: float) -> Gnss:
    """P1 (40)–(43) at 10 Hz with this driving noise."""
    std = markov_std(noise, CORRELATION_TIME, STEP)
    return Gnss(rate=1.0 / STEP, markov=((std, CORRELATION_TIME),), settled=False)


def product_profile(noise: float) -> Profile:
    """Profile of Steerway's filter with the true model of the receiver's error, and the ship's motion as in P1.

    S_ω is P1's h Q_d of 1e-6 rad²/s³; speed noise and α2 = 0.05 1/s suit a ship that turns for minutes.
    """
    return Profile(
        name="mariner-los",
        speed_noise=1e-3,
        course_rate_noise=1e-6,
        course_rate_decay=0.05,
        position_std=0.02,
        error_std=markov_std(noise, CORRELATION_TIME, STEP),
        error_time=CORRELATION_TIME,
    )


def printed_filter() -> Ekf5States:
    """The filter with P1 §4's tuning, started at zero speed and course; the paper states no initial values."""
    return Ekf5States(STEP, 1, "NED", [1e-5, 1e-5], [0.1, 0.1], alpha_1=1e-5, alpha_2=0.2)


def voyage(case: ShipCase) -> tuple[Run, Mission]:
    """Simulate a case until the last waypoint, at most for `DURATION`."""
    mission = Mission(route(case.turned))
    autopilot = AnglePID(place_poles(*MARINER_NOMOTO, bandwidth=BANDWIDTH, limit=RUDDER.high))
    if case.feedback == "printed":
        helm = Autopilot(autopilot, LowPass(case.low_pass), AlwaysByCourse())
        estimator = PrintedEstimator(printed_filter())
    else:
        helm = Autopilot(autopilot, LowPass(case.low_pass))
        filtered = case.feedback == "product"
        estimator = FilterEstimator(FiveStateFilter(product_profile(case.noise))) if filtered else AtFaceValue()
    instruments = Truth() if case.feedback == "truth" else Suite(receiver(case.noise))
    pilot = Pilot(estimator, mission, LineOfSight(LOOKAHEAD), helm, Rudder(RUDDER.high), cruise=CRUISE_SPEED)
    run = sail(Mariner(), pilot, instruments, DURATION, STEP, start=(0.0, 0.0, case.turned), seed=case.seed)
    return run, mission


def rudder(run: Run) -> np.ndarray:
    """(n,) rudder angle, rad, + to starboard; the ship's state has the opposite sign."""
    return -run.state[:, 6]


def asked_rudder_rate(run: Run) -> np.ndarray:
    """(n,) rudder rate that the autopilot asks of the steering engine, (command − rudder)/lag, rad/s."""
    return (run.command[:, 0] - rudder(run)) / RUDDER.lag


def straight(run: Run) -> np.ndarray:
    """(n,) bool: more than `STEADY` s after the last switch."""
    target = run["leg_target"]
    switched = np.flatnonzero(np.diff(target, prepend=target[0]) != 0.0)
    began = np.zeros(len(run))
    for row in switched:
        began[row:] = run.time[row]
    return run.time - began > STEADY


def measured(case: ShipCase) -> dict[str, float]:
    """The numbers of one run, by key; errors are of the estimate against the truth, angles in degrees."""
    run, mission = voyage(case)
    counted = (run.time > SETTLED) & np.isfinite(run["estimated_cog"])
    leg = straight(run)
    asked = asked_rudder_rate(run)
    achieved = np.gradient(rudder(run), STEP)
    across = run.true_cross_track
    limited = (np.abs(run.command[:, 0]) > RUDDER.high - 1e-6) | (np.abs(asked) > RUDDER.rate)
    numbers = {
        "finished": float(len(mission.log.reached) == 5),
        "duration_s": run.time[-1],
        "cog_rms_deg": math.degrees(rms(wrap_array(run["estimated_cog"] - run.true_cog)[counted])),
        "sog_rms_mps": rms((run["estimated_sog"] - run.true_sog)[counted]),
        "rate_rms_dps": math.degrees(rms((run["estimated_course_rate"] - run["true_course_rate"])[counted])),
        "cross_track_rms_m": rms(across),
        "cross_track_max_m": float(np.nanmax(np.abs(across))),
        "rudder_max_deg": math.degrees(np.abs(rudder(run)).max()),
        "rudder_rate_max_dps": math.degrees(np.abs(asked).max()),
        "straight_rudder_rate_rms_dps": math.degrees(rms(asked[leg])),
        "straight_achieved_rudder_rate_rms_dps": math.degrees(rms(achieved[leg])),
        "saturated_pct": 100.0 * float(np.mean(limited)),
    }
    return numbers | {f"switch_s_{each.waypoint}": each.time for each in mission.log.passages}


CROSSED = 4000.0
"""First part of a leg across a current, m, that is not judged, because the ship settles."""
_CROSSING = """
duration = 1300.0
step = 0.1
[vessel]
kind = "mariner"
[start]
speed = 7.7
[environment.current]
speed = 1.0
direction_deg = 90.0
[gnss]
markov = []
white = 0.5
[estimator]
kind = "{estimator}"
[guidance]
steer_by = "{angle}"
[route]
waypoints = [{{ north = 0.0, east = 0.0 }}, {{ north = 8000.0, east = 0.0 }}]
"""


def crossing(angle: str, seed: int) -> tuple[float, float]:
    """(mean offset, Δ tan β of the crab angle β) on a leg north in a current of 1 m/s to the east, m; P1 §3.

    With "course" the ship steers by an estimate from fixes of 0.5 m, with "heading" by its true states.
    """
    estimator = "five-state" if angle == "course" else "truth"
    run = sail_scenario(parse_scenario(_CROSSING.format(angle=angle, estimator=estimator)), seed).run
    rows = run["true_north"] > CROSSED
    crab = float(np.mean(run.true_cog[rows] - run["true_heading"][rows]))
    return float(np.mean(run["true_east"][rows])), LOOKAHEAD * math.tan(crab)


OFFSET = 600.0
"""Cross-track error at the start of an approach, m."""
ARRIVED = 1.0
"""Distance from the path, m, at which an approach ends."""


@dataclass(frozen=True, eq=False)
class Approach:
    """An approach to a leg, along which V = y_e²/2 decreases by P1 (37)–(38).

    Time (n,) s, cross-track error (n,) m, and V̇ by (38) in every row, m²/s.
    """

    time: np.ndarray
    cross_track: np.ndarray
    promised: np.ndarray

    @property
    def lyapunov(self) -> np.ndarray:
        """V (n,), m²."""
        return 0.5 * self.cross_track**2

    @property
    def falling_pct(self) -> float:
        """Share (%) of the steps on which V falls, until the path is first reached."""
        near = np.flatnonzero(np.abs(self.cross_track) < ARRIVED)
        until = near[0] if len(near) else len(self.time)
        return 100.0 * float(np.mean(np.diff(self.lyapunov[:until]) < 0.0))

    @property
    def largest_error(self) -> float:
        """Largest difference of V̇ along the run (central differences) from V̇ by (38), m²/s."""
        return float(np.abs(np.gradient(self.lyapunov, self.time) - self.promised)[1:-1].max())

    @property
    def relative_error(self) -> float:
        """`largest_error` over the largest V̇ by (38)."""
        return self.largest_error / float(np.abs(self.promised).max())


def approaches() -> tuple[Approach, Approach]:
    """(ideal, ship): an approach on the desired course χ = χ_d, as (37) supposes, and that of the steered ship."""
    return _ideal(), _ship()


def promised(cross_track, speed):
    """V̇ of P1 (38)."""
    return -speed * cross_track**2 / np.hypot(LOOKAHEAD, cross_track)


def _ideal(duration=1500.0):
    error, rows = OFFSET, []
    for k in range(round(duration / STEP)):
        rows.append((k * STEP, error))
        # The midpoint rule, because V̇ is compared to a thousandth.
        half = error + 0.5 * STEP * CRUISE_SPEED * math.sin(_desired(error))
        error += STEP * CRUISE_SPEED * math.sin(_desired(half))
    time, cross_track = np.array(rows).T
    return Approach(time, cross_track, promised(cross_track, CRUISE_SPEED))


_NORTHWARD = LegState(
    1, direction=0.0, along_track=0.0, cross_track=0.0, remaining=0.0, distance=0.0, bearing=0.0, speed=0.0
)


def _desired(error):
    return LineOfSight(LOOKAHEAD).step(_NORTHWARD._replace(cross_track=error), math.nan, math.nan, STEP).angle


def _ship(duration=1500.0):
    helm = Autopilot(AnglePID(place_poles(*MARINER_NOMOTO, bandwidth=BANDWIDTH, limit=RUDDER.high)), LowPass(LOW_PASS))
    mission = Mission(Route([0.0, 50e3], [0.0, 0.0]))
    pilot = Pilot(AtFaceValue(), mission, LineOfSight(LOOKAHEAD), helm, Rudder(RUDDER.high), cruise=CRUISE_SPEED)
    run = sail(Mariner(), pilot, Truth(), duration, STEP, start=(0.0, OFFSET, 0.0))
    cross_track = run["true_east"]
    return Approach(run.time, cross_track, promised(cross_track, run.true_sog))
