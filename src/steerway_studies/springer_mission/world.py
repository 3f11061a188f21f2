"""Springer's mission of P4 §6 as a loop of blocks: world, navigator, autopilot; and the track of a mission.

Axes. The paper's x (east) and y (north), with angles from x to y, are north and east here, with headings from north to
east. This is a mirror image; no number changes. The paper's current along y is an east current here. The position is
known, as in the paper.
"""

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from steerway.control import BiasObserver, HeadingMpc, InputLimits, LinearPlant
from steerway.core import markov_decay, markov_step, rms, wrap, wrap_array
from steerway.estimation.heading import WAVES
from steerway.guidance import Mission, MissionLog, Passing, Phase, Route
from steerway.sensors import TICKS, TRUE_TCM2, CompassModel, DynamicCompass
from steerway.vessels import RPM, HeadingModel, Springer, conditions
from steerway.vessels import SPRINGER_MAX_CHANGE_RPM as MAX_CHANGE_RPM
from steerway.vessels import SPRINGER_MAX_DIFFERENCE_RPM as MAX_DIFFERENCE_RPM
from steerway.vessels import SPRINGER_PAPER_YAW as PAPER_YAW
from steerway.vessels import SPRINGER_PHYSICAL_YAW as PHYSICAL_YAW
from steerway.vessels import SPRINGER_SPEED as SPEED

PAPER_CIRCUIT = np.array([(170, 10), (310, 120), (340, 290), (220, 410), (50, 400), (-50, 230), (0, 0)], dtype=float)
"""Read from figure 7a: 1294 m from (0, 0), heading 0."""
ACCEPTANCE = 4.0
CURRENT = (0.0, 0.1 * SPEED)
LONGEST = 1800
"""Longest duration of a mission, s."""


class HeadingSource(Protocol):
    """The source of the autopilot's heading."""

    @property
    def heading(self) -> float:
        """Heading (rad) for the second that begins."""

    def step(self, difference: float, readings: np.ndarray, velocity: tuple[float, float]) -> float:
        """Advance by a second, with its order (rad/s), compass readings (rad) and GNSS velocity (m/s)."""


class Blind:
    """A navigator whose estimator does not use the GNSS velocity."""

    def __init__(self, estimator):
        self.estimator = estimator

    @property
    def heading(self) -> float:
        return self.estimator.heading

    def step(self, difference, readings, velocity) -> float:
        return self.estimator.step(difference, readings)


@dataclass(frozen=True)
class World:
    """True compass, boat and current. current_std and current_time: a Gauss–Markov part of the current, m/s and s."""

    compass: CompassModel = TRUE_TCM2
    plant: str = "paper"
    effectiveness: float = 1.0
    bias: float = 0.0  # rad/s
    card: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    waves: float = math.sqrt(WAVES)  # 1σ of each yaw state a second
    current: tuple[float, float] = CURRENT
    current_std: float = 0.0
    current_time: float = 600.0
    velocity_std: float = 0.1


@dataclass
class MissionTrack:
    """One mission: its log, and a row per second with unwrapped angles in rad."""

    position: np.ndarray
    heading: np.ndarray
    estimate: np.ndarray
    wanted: np.ndarray
    difference: np.ndarray  # rad/s
    cross_track: np.ndarray  # m from the leg under way
    log: MissionLog
    readings: np.ndarray  # (n, 40)
    velocity: np.ndarray  # (n, 2)
    finished: bool = True
    circuit: np.ndarray = field(default_factory=lambda: PAPER_CIRCUIT)

    @property
    def error_deg(self) -> np.ndarray:
        """Estimate minus truth, degrees, NaN without an estimate; full turns are left in it, as in the paper."""
        return np.degrees(self.estimate - self.heading)

    @property
    def heading_rms_deg(self) -> float:
        error = self.error_deg
        return rms(error[np.isfinite(error)])

    @property
    def heading_median_deg(self) -> float:
        """Median of the absolute error without full turns, degrees: the error that affects the steering."""
        return float(np.nanmedian(np.abs(turnless_deg(self.estimate, self.heading))))

    @property
    def deviation(self) -> float:
        """Mean distance from the legs, m."""
        return float(np.mean(np.abs(self.cross_track)))

    @property
    def deviation_printed(self) -> float:
        """Mean distance from the point of the ideal path at the same step, m; P4 (23)."""
        return float(np.mean(np.hypot(*(self.position - ideal_path(self.circuit, len(self.position))).T)))

    @property
    def reached(self) -> int:
        return len(self.log.reached)


def ideal_path(circuit: np.ndarray, steps: int) -> np.ndarray:
    """(steps, 2) positions every 1 s on the legs, at the boat's speed without a current; then the last position."""
    corners = np.vstack([np.zeros(2), circuit])
    ends = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    sailed = SPEED * np.arange(steps)
    return np.stack([np.interp(sailed, ends, corners[:, axis]) for axis in range(2)], axis=1)


def turnless_deg(estimate, heading) -> np.ndarray:
    """Smallest signed differences, degrees."""
    return np.degrees(wrap_array(estimate - heading))


def paper_mpc(yaw: HeadingModel = PAPER_YAW, step: float = 1.0) -> HeadingMpc:
    """P4's autopilot: H_p 10, H_c 2, Q 1 per degree², R 0.1 per rpm²; (25)–(27). Weights and horizon hold for 1 s."""
    horizon = round(10 / step)
    weights = {"output_weight": step * math.degrees(1.0) ** 2, "change_weight": 0.1 / step / RPM**2}
    return HeadingMpc(*autopilot_parts(yaw, step), horizon=horizon, **weights)


def autopilot_parts(yaw: HeadingModel, step: float = 1.0) -> tuple[LinearPlant, InputLimits, BiasObserver]:
    """Plant, limits and observer, which MPC and LQG share."""
    plant = LinearPlant(*yaw.matrices(step))
    bias, reading = 0.01 * RPM**2 * step, 0.05 * math.radians(1.0) ** 2 / step
    observer = BiasObserver(plant, 1e-12 * step, bias, reading, (20.0 * RPM) ** 2)
    return plant, InputLimits(MAX_DIFFERENCE_RPM * RPM, MAX_CHANGE_RPM * RPM * step), observer


def sail(
    world: World,
    navigator: HeadingSource,
    seed,
    circuit=PAPER_CIRCUIT,
    passing=None,
    autopilot=None,
) -> MissionTrack:
    """Simulate a circuit from (0, 0), heading 0, in steps of 1 s; `seed` is for waves, compass, current and GNSS.

    The boat steers by the bearing of the waypoint; without `passing` a waypoint is missed at its normal plane.
    """
    rng = np.random.default_rng(seed)
    vessel = Springer(world.plant, world.effectiveness, world.bias)
    compass = DynamicCompass(world.compass, world.card).start(0.0, rng.spawn(1)[0])
    mission = Mission(
        Route(circuit[:, 0], circuit[:, 1], ACCEPTANCE, SPEED), passing or Passing("circle"), start="point"
    )
    pilot = autopilot or paper_mpc(PAPER_YAW if world.plant == "paper" else PHYSICAL_YAW)
    state, flow = vessel.start(), _Flow(world, rng.spawn(1)[0])
    draws, rows, read, velocities = rng.spawn(1)[0], [], [], []
    effort = 0.0
    while mission.phase is Phase.UNDER_WAY and len(rows) < LONGEST:
        heading, estimate, around = vessel.heading(state), navigator.heading, flow.step(1.0)
        passed = len(mission.log.passages)
        leg = mission.step(state[0], state[1], 1.0 if rows else 0.0, effort)
        if len(mission.log.passages) > passed:
            leg = mission.step(state[0], state[1], 0.0)  # P4 turns to the next waypoint in the same second
        wanted = estimate + wrap(leg.bearing - estimate)
        difference = pilot.step(wanted, estimate) if math.isfinite(wanted) else pilot.input
        effort = (difference / RPM / 60.0) ** 2
        motion = vessel.motion(state, around)
        noise = draws.standard_normal(4)
        velocity = (
            motion.north_velocity + world.velocity_std * noise[0],
            motion.east_velocity + world.velocity_std * noise[1],
        )
        readings = compass.readings(heading, TICKS)
        rows.append((state[0], state[1], heading, estimate, wanted, difference, leg.cross_track))
        read.append(readings)
        velocities.append(velocity)
        navigator.step(difference, readings, velocity)
        state = vessel.step(state, (difference,), around, 1.0)
        state[2:4] += world.waves * noise[2:]
    table = np.array(rows)
    finished = mission.phase is not Phase.UNDER_WAY
    return MissionTrack(
        table[:, :2], *table[:, 2:].T, mission.log, np.array(read), np.array(velocities), finished, circuit
    )


class _Flow:
    """The current, with a constant and a slowly varying part."""

    def __init__(self, world: World, rng):
        self._world, self._rng = world, rng
        self._part = world.current_std * rng.standard_normal(2)

    def step(self, dt: float) -> np.ndarray:
        north, east = self._world.current
        now = conditions((north + self._part[0], east + self._part[1]))
        std = self._world.current_std
        decay = markov_decay(self._world.current_time, dt)
        self._part = np.array([markov_step(p, decay, std, self._rng.standard_normal()) for p in self._part])
        return now


def replayed(voyage: MissionTrack, navigator: HeadingSource) -> np.ndarray:
    """(n,) headings (rad) that another navigator would have given on the same voyage."""
    headings = np.empty(len(voyage.heading))
    for k in range(len(headings)):
        headings[k] = navigator.heading
        navigator.step(voyage.difference[k], voyage.readings[k], tuple(voyage.velocity[k]))
    return headings


def random_circuit(rng: np.random.Generator, corners: int = 7) -> np.ndarray:
    """A closed circuit of some 1.3 km through (0, 0), to port or starboard, whose first leg is within 15° of north.

    Corners at uneven bearings around a centre, at 0.75 to 1.25 of 210 m; no leg shorter than 90 m, no turn over 110°.
    """
    while True:
        angles = (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) * 2.0 * math.pi / corners
        radii = 210.0 * rng.uniform(0.75, 1.25, corners)
        points = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
        points -= points[-1]
        first = math.atan2(points[0, 1], points[0, 0]) + math.radians(rng.uniform(-15.0, 15.0))
        c, s = math.cos(first), math.sin(first)
        points = points @ np.array([[c, -s], [s, c]])
        legs = np.diff(points, axis=0, prepend=[[0.0, 0.0]])
        courses = np.arctan2(legs[:, 1], legs[:, 0])
        turns = np.abs(wrap_array(np.diff(courses)))
        if np.hypot(*legs.T).min() >= 90.0 and turns.max() <= math.radians(110.0):
            return points * (1.0, rng.choice((-1.0, 1.0)))
