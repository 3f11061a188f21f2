"""Vessels: derivatives and steps of every one, environment, actuators; sensors with a seed."""

import math

import numpy as np

from steerway.sensors import (
    Compass,
    DopplerLog,
    Gnss,
    Suite,
    gyro,
    low_cost,
)
from steerway.sensors.testing import Fault
from steerway.vessels import (
    CALM,
    Actuator,
    Caldas,
    Current,
    CyberShip2,
    Environment,
    Mariner,
    Nomoto,
    Otter,
    Springer,
    Surge,
    conditions,
    published_surrogate,
)
from steerway.vessels.testing import (
    WaveMotion,
    Waves,
    Wind,
)
from tests.reference_outputs.generated import columns
from tests.reference_outputs.tables import case

SEA = conditions((0.2, -0.15), (20.0, -10.0), 2.0)
CALMER = conditions((0.2, -0.15), (0.6, -0.3), 0.06)
VESSELS = {
    "otter": (Otter(25.0, (0.05, 0.0, -0.35)), 0.5, (80.0, -40.0), SEA, 0.1),
    "otter_2021_euler": (Otter(10.0, (0.1, 0.0, -0.35), "2021", 1.0, "euler"), 0.5, (80.0, 40.0), SEA, 0.02),
    "mariner": (Mariner(), 7.7175, (0.5,), SEA, 1.0),
    "nomoto": (Nomoto(0.2, 20.0, 2.0, 0.01, Actuator("rudder", -0.5, 0.5, 0.1, 0.8)), 2.0, (0.8,), SEA, 0.1),
    "cybership": (CyberShip2(), 0.5, (2.0, 1.0, 1.0), CALMER, 0.1),
    "cybership_nonlinear": (CyberShip2("nonlinear"), 0.5, (2.0, 1.0, 1.0), CALMER, 0.1),
    "springer_paper": (Springer("paper", 0.9, 0.3), None, (25.0,), SEA, 1.0),
    "springer_physical": (Springer("physical", 0.9, 0.3), None, (25.0,), SEA, 0.5),
    "surge": (Surge(), 1.0, (15.0,), conditions((0.5, 0.0), (900.0, 0.0)), 0.1),
    "surge_surrogate": (published_surrogate(), 1.0, (15.0,), conditions((0.5, 0.0), (900.0, 0.0)), 0.1),
    "caldas": (Caldas(moment_limit=8000.0), 0.5, (12.0, 9000.0), 20.0 * SEA, 0.1),
}
"""Vessel, speed to begin with, greatest command, surroundings and step."""


@case("vessels")
def vessels():
    """State and motion of every vessel under a command that swings."""
    found = {}
    for name, (vessel, speed, command, sea, step) in VESSELS.items():
        state, rows = vessel.start(1.0, -2.0, 0.4, speed), []
        for k in range(300):
            state = vessel.step(
                state, [each * math.sin(0.02 * (j + 2) * k) for j, each in enumerate(command)], sea, step
            )
            motion = vessel.motion(state, sea)
            rows.append(np.concatenate([state, motion, [motion.sog, motion.cog, motion.crab_angle, motion.sideslip]]))
        found[name] = np.array(rows)[5::6]
    return found


ROUGH = Environment(
    Current(0.4, 0.7, 0.1, 60.0),
    Wind(8.0, -2.0, 0.4, 1.5, 10.0, 0.3),
    Waves(1.0, 1.2, 0.1, 0.2, 0.05, 0.03, 10.0, 3.0, 60.0),
    (1.0, -2.0),
    0.5,
)


TIME = np.arange(0.0, 60.0, 0.02)
COURSE = 0.4 + 0.5 * np.sin(TIME / 9.0)
NORTH, EAST = np.cumsum(0.03 * np.cos(COURSE)), np.cumsum(0.03 * np.sin(COURSE))


@case("sensor_gnss_faults")
def gnss_faults():
    """A record and the stream of it: two seeds, because each draws by itself."""
    faults = (
        Fault("dropout", start=10.0, duration=3.0),
        Fault("jump", start=20.0, size=30.0, direction=0.5),
        Fault("burst", per_hour=120.0, duration=2.0, size=5.0),
        Fault("step", start=40.0, duration=4.0, size=8.0),
        Fault("frozen", per_hour=90.0, duration=1.5),
    )
    more = {"latency": 0.3, "lever_arm": (0.5, -0.2, -1.0), "velocity_std": 0.05, "settled": False}
    gnss = Gnss(rate=5.0, white=0.1, markov=((1.0, 20.0),), faults=faults, **more)
    fixes = gnss.fixes(
        TIME, NORTH, EAST, 3, roll=0.1 * np.sin(TIME), heading=COURSE, north_velocity=1.5 * np.cos(COURSE),
        east_velocity=1.5 * np.sin(COURSE), origin=(1.1, 0.2),
    )  # fmt: skip
    stream, rows = gnss.start(4), []
    for k in range(len(TIME)):
        velocity = 1.5 * math.cos(COURSE[k]), 1.5 * math.sin(COURSE[k])
        if fix := stream.step(TIME[k], NORTH[k], EAST[k], 0.1, -0.05, COURSE[k], *velocity):
            rows.append(fix)
    found = {name: getattr(fixes, name) for name in ("time", "latitude", "longitude", "sog", "cog")}
    found |= columns("s_time s_north s_east s_sog s_cog", rows)
    rows = min(len(each) for each in found.values())
    return {name: values[:rows][::4] for name, values in found.items()}


@case("sensor_suite")
def suite():
    sensors = Suite(low_cost(), Compass(), gyro(), DopplerLog())
    boat, sea, stream, rows = Otter(), ROUGH.start(9, 0.02), sensors.start(10), []
    state = boat.start(speed=1.0)
    for k in range(1001):
        motion = boat.motion(state, CALM)
        sea.advance(motion)
        rows.append(stream.step(0.02 * k, motion, WaveMotion(*sea.waves)))
        state = boat.step(state, (70.0, 60.0), CALM, 0.02)
    return columns(" ".join(rows[0]._fields), rows, 10)
