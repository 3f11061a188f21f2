"""P2's control law on true states, without disturbance: one run, no chance."""

import math

import numpy as np

from steerway.control import PositionPID
from steerway.vessels import CALM, CyberShip2
from steerway.vessels import CYBERSHIP2_DAMPING as DAMPING
from steerway.vessels import CYBERSHIP2_INERTIA as INERTIA
from steerway_studies.cybership_observers import scenario
from steerway_studies.papers.positioning import PrintedPositionPID

GOAL = scenario.GOAL


def numbers() -> dict[str, float]:
    """Rise time (10 to 90 %), overshoot and end of the corrected law, with and without anti-windup; of the literal."""
    printed = _way(PositionPID(scenario.PRINTED_GAINS, anti_windup=False))
    careful = _way(PositionPID(scenario.PRINTED_GAINS))
    literal = _literal_way()
    out = {}
    for i, name in enumerate(("north", "east")):
        out[f"pid_rise_{name}"] = rise(printed[:, i], GOAL[i])
        out[f"pid_overshoot_{name}_pct"] = overshoot(printed[:, i], GOAL[i])
        out[f"pid_end_{name}"] = printed[-1, i]
        out[f"pid_anti_windup_overshoot_{name}_pct"] = overshoot(careful[:, i], GOAL[i])
    out["pid_literal_end_error"] = math.dist(literal[-1, :2], GOAL[:2])
    out["pid_literal_turned_deg"] = math.degrees(literal[-1, 2])
    out["pid_literal_growth"] = growth(-1.0)
    out["pid_corrected_growth"] = growth(1.0)
    return out


def rise(place, goal) -> float:
    """Time from a tenth to nine tenths of the way, s."""
    return float(scenario.STEP * (np.argmax(place >= 0.9 * goal) - np.argmax(place >= 0.1 * goal)))


def overshoot(place, goal) -> float:
    """How far beyond the goal, in % of the way."""
    return float(100.0 * (place.max() / goal - 1.0))


def growth(sign) -> float:
    """The largest real part (1/s) of the closed loop's poles at rest heading north; `sign` −1 for (30) as printed."""
    gains, inverse = scenario.PRINTED_GAINS, np.linalg.inv(INERTIA)
    nothing, one = np.zeros((3, 3)), np.eye(3)
    loop = np.block(
        [
            [nothing, one, nothing],
            [-sign * inverse @ gains.proportional, -inverse @ (DAMPING + sign * gains.derivative), sign * inverse],
            [-gains.integral, nothing, nothing],
        ]
    )
    return float(np.linalg.eigvals(loop).real.max())


def _way(controller):
    return scenario.sail(scenario.drawn(0), disturbed=False, controller=controller).states


def _literal_way():
    """(30) is fed the velocity of north, east and heading, not the body's."""
    vessel, controller = CyberShip2(), PrintedPositionPID(scenario.PRINTED_GAINS)
    states = [vessel.start()]
    for k in range(scenario.STEPS):
        motion = vessel.motion(states[-1], CALM)
        velocity = (motion.north_velocity, motion.east_velocity, motion.yaw_rate)
        force = controller.step(scenario.desired(k), *states[-1][:3], velocity, scenario.STEP)
        states.append(vessel.step(states[-1], force, CALM, scenario.STEP))
    return np.array(states)
