"""Generated sorties of the course cases: profiles, fixes with every trouble, and their tables."""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from steerway import Fixes, Profile
from steerway.core import wrap
from tests.scenes import EPOCH, HOME, sailed, straight, turning

EARTH_RADIUS = 6_371_000.0
FAR = 1000.0
"""m south and west of home from which positions are counted: 1e-9 of them is then a micrometre."""

MOTION = {"speed_noise": 5e-3, "course_rate_noise": 1e-3, "course_rate_decay": 0.2, "position_std": 0.3}
STRAIGHT = {"speed_noise": 1e-3, "course_rate_noise": 1e-5, "course_rate_decay": 1.0, "position_std": 0.3}
TURN = {"turn_speed_noise": 4e-3, "turn_course_rate_noise": 8e-3, "turn_course_rate_decay": 0.2}
TWO_MODES = STRAIGHT | TURN | {"turn_time": 10.0, "straight_time": 20.0}
ERROR = {"error_std": 0.5, "error_time": 15.0}
DRIFT = {"drift_std": 1.0, "drift_time": 120.0}
ACCELERATION = {"acceleration_std": 0.1, "acceleration_time": 4.0}
OSCILLATION = {"yawing_period": 8.0, "yawing_time": 12.0}

KINDS = {
    "white": MOTION,
    "no-rate-decay": MOTION | {"course_rate_decay": 0.0},
    "speed-decay": MOTION | {"speed_decay": 0.02, "steerageway": 1.0},
    "error": MOTION | ERROR,
    "drift": MOTION | DRIFT,
    "two-errors": MOTION | ERROR | DRIFT,
    "acceleration": MOTION | ACCELERATION,
    "acceleration-errors": MOTION | ACCELERATION | ERROR | DRIFT,
    "oscillating": MOTION | OSCILLATION,
    "oscillating-error-acceleration": MOTION | OSCILLATION | ERROR | ACCELERATION,
    "time-std": MOTION | {"time_std": 0.4},
    "two-modes": TWO_MODES,
    "two-modes-error": TWO_MODES | ERROR,
    "two-modes-errors": TWO_MODES | ERROR | DRIFT,
    "two-modes-acceleration": TWO_MODES | ACCELERATION,
}
ONE, TWO = Profile(**MOTION), Profile(**TWO_MODES)
MODES = {"one-mode": ONE, "two-modes": TWO}
AIDS = ("sog", "cog", "heading", "water_speed", "yaw_rate")


def motion_columns(motion, rows=None) -> dict[str, np.ndarray]:
    """The columns of a Motion, of all its rows or of so many evenly chosen ones; times and places near zero."""
    if rows is not None and rows < len(motion):
        motion = motion.rows(np.linspace(0, len(motion) - 1, rows).round().astype(int))
    return placed(motion.columns())


def placed(columns) -> dict[str, np.ndarray]:
    """Columns with time from the epoch of the scenes and places as metres north and east of a point near home."""
    columns = dict(columns)
    latitude, longitude = columns.pop("latitude"), columns.pop("longitude")
    return {
        "time": columns.pop("time") - EPOCH,
        "north": FAR + EARTH_RADIUS * (latitude - HOME[0]),
        "east": FAR + EARTH_RADIUS * math.cos(HOME[0]) * wrapped(longitude - HOME[1]),
        **columns,
    }


def wrapped(angles) -> np.ndarray:
    return np.array([wrap(angle) for angle in np.atleast_1d(angles)])


@cache
def weaving():
    """A wandering course at a changing speed, across south, a fix every half second."""
    scene = turning(2.0, 2.6, 75.0, rate=2.0, seed=3, density=8e-3)
    speed = 2.0 + 0.6 * np.sin(0.15 * np.arange(len(scene.time)) / 2.0)
    return sailed(speed, scene.cog, 2.0)


@cache
def alternating():
    """Courses held for 20 s and turns of 9 °/s for 10 s, a fix a second."""
    rate = np.tile(np.r_[np.zeros(20), np.full(10, math.radians(9.0))], 4)
    return sailed(np.full(len(rate), 1.5), -1.0 + np.cumsum(rate), 1.0)


@cache
def weaving_fixes() -> Fixes:
    return weaving().fixes(0.3, 1)


@cache
def alternating_fixes() -> Fixes:
    return alternating().fixes(0.3, 2)


def fixes_of(profile: Profile) -> Fixes:
    return alternating_fixes() if profile.turn_time else weaving_fixes()


def table_of(rows: list[dict]) -> dict[str, np.ndarray]:
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


@cache
def instruments() -> Fixes:
    """Every instrument at every fix but some; a compass and a gyro speak between fixes too, one reading is wild."""
    scene, fixes = alternating(), alternating_fixes()
    n = len(fixes)
    noise = np.random.default_rng(11).standard_normal((5, n))
    rate = np.gradient(np.unwrap(scene.cog), scene.time)
    output = {
        "sog": scene.sog + 0.05 * noise[0],
        "cog": wrapped(scene.cog + 0.04 * noise[1]),
        "heading": wrapped(scene.cog + 0.15 + 0.02 * noise[2]),
        "water_speed": scene.sog - 0.4 + 0.05 * noise[3],
        "yaw_rate": rate + 0.01 + 0.004 * noise[4],
    }
    for j, name in enumerate(output):
        output[name][3 + j :: 17] = np.nan
    output["sog"][40], output["heading"][70] = 9.0, output["heading"][70] + 2.0
    silent = np.full(n, np.nan)
    between = Fixes(
        fixes.time + 0.5,
        silent,
        silent,
        heading=wrapped(np.interp(fixes.time + 0.5, fixes.time, np.unwrap(output["heading"]))),
        yaw_rate=output["yaw_rate"],
    )
    at_fixes = replace(fixes, **output)
    columns = {name: np.r_[at_fixes.columns()[name], between.columns()[name]] for name in at_fixes.columns()}
    return Fixes(**columns).in_order()


def moved(fixes, rows, north, east) -> Fixes:
    """Fixes with some rows displaced by metres."""
    latitude, longitude = fixes.latitude.copy(), fixes.longitude.copy()
    latitude[rows] += np.asarray(north) / EARTH_RADIUS
    longitude[rows] += np.asarray(east) / (EARTH_RADIUS * math.cos(HOME[0]))
    return replace(fixes, latitude=latitude, longitude=longitude)


def outliers() -> Fixes:
    north, east = [30.0, -8.0, -8.0, 400.0], [-20.0, 5.0, 6.0, 300.0]
    return moved(alternating_fixes(), [12, 40, 41, 75], north, east).rows(slice(90))


def burst() -> Fixes:
    wild = np.random.default_rng(5).normal(0.0, 25.0, (2, 8))
    return moved(alternating_fixes(), slice(35, 43), *wild).rows(slice(80))


def gaps() -> Fixes:
    """One of 12 s in a turn, one of half an hour and more, and one that is none, of a clock that stands still."""
    fixes = alternating_fixes()
    time = fixes.time.copy()
    time[60:] += 2000.0
    time[90] = time[89]
    return replace(fixes, time=time).rows(np.r_[0:22, 34:110])


def standstill() -> Fixes:
    """She comes to rest, lies still for half a minute and goes on the other way; rest to begin with, too."""
    first = np.r_[np.zeros(15), np.linspace(0.0, 2.0, 10), np.full(15, 2.0), np.linspace(2.0, 0.0, 8), np.zeros(25)]
    speed = np.r_[first, np.linspace(0.0, 1.5, 8), np.full(15, 1.5)]
    course = np.r_[np.full(60, 0.7), np.full(len(speed) - 60, -2.3)]
    return sailed(speed, course, 1.0).fixes(0.3, 9)


def fast_start() -> Fixes:
    return straight(12.0, -3.0, 15.0, rate=4.0).fixes(0.3, 4)
