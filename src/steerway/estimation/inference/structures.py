"""The declared structures: what a vessel and her receiver may be made of, each number with its weak prior.

A structure is a tuple of parts; each part names its parameters. Numbers are fitted as logarithms, with normal priors of
these medians and deviations. One deviation of 1 is a factor of 2.7 either way: about what vessels of one kind differ
by; 1.5 and more span dinghies and ships.
"""

import math

import numpy as np

from steerway.estimation.course.update.aids import TABLE
from steerway.estimation.inference.model import (
    CALM,
    EMERGENCY,
    MODES,
    ON_AID,
    ON_ANTENNA,
    ON_COURSE,
    ON_FIX,
    ON_RATE,
    ON_SPEED,
    ON_TIME,
    SURGE,
    TURN,
    YAW,
    Model,
    states_of,
)

_DEG = math.pi / 180.0

PRIORS = {
    # part: {parameter: (median, deviation of the logarithm)}. Chosen for craft from 2 m to ships and receivers as they
    # are sold: a deviation of 1.2 is a factor of 3.3, 2 one of 7.4. Judged by `steerway study unseen-logs`.
    "base": {
        "fix_std": (0.3, 2.0),  # m, white part of a fix
        "poor_rate": (0.003, 1.5),  # share of fixes with much larger noise
        "late_std": (0.03, 1.2),  # s, of the moment of such a fix
        "outlier_rate": (0.001, 1.2),  # share of fixes that are off by any distance
        "speed_walk": (0.004, 1.5),  # m/s per √s, held speed
        "yaw_size": (6.0 * _DEG, 1.5),  # rad/s, change of course rate in a yaw manoeuvre
        "yaw_time": (2.0, 1.2),  # s, how long it lasts
        "yaw_every": (100.0, 2.0),  # s between them
        "yaw_slip": (0.02, 1.5),  # m/s per √s, held speed in a yaw manoeuvre
        "turn_walk": (0.3 * _DEG, 1.5),  # rad/s per √s, course rate in a steady turn
        "turn_time": (30.0, 2.0),  # s, how long a steady turn lasts
        "rate_time": (0.8, 1.0),  # s, in which the course rate dies away on a held course
        "surge_size": (1.0, 1.5),  # m/s, change of speed in a speed manoeuvre
        "surge_time": (4.0, 1.2),  # s
        "surge_every": (200.0, 1.5),  # s
        "emergency_every": (1e4, 2.0),  # s
        "drift_speed": (0.2, 1.0),  # m/s, below which a vessel is pushed about in any direction
    },
    "calm_rate": {"rate_std": (0.5 * _DEG, 1.5)},  # rad/s, on a held course
    "wander": {
        "speed_std": (0.03, 1.5),  # m/s about the held speed
        "speed_time": (6.0, 1.0),  # s
        "wander_std": (0.5 * _DEG, 1.5),  # rad/s about the held course rate
        "wander_time": (3.0, 1.0),  # s
    },
    "waves": {
        "wave_surge": (0.15, 1.2),  # m/s
        "surge_period": (9.0, 0.8),  # s
        "wave_yaw": (3.0 * _DEG, 1.2),  # rad
        "yaw_period": (12.0, 0.8),  # s
        "surge_damping": (0.06, 1.2),  # as a share of critical damping
        "yaw_damping": (0.06, 1.2),
    },
    "strokes": {  # of oars and paddles, and what a mast pitches
        "stroke_surge": (0.2, 1.2),  # m/s
        "stroke_period": (2.0, 0.4),  # s; 20 to 100 strokes a minute
        "stroke_damping": (0.06, 1.2),
    },
    "antenna": {
        "antenna_std": (0.1, 1.2),  # m athwart
        "antenna_period": (2.5, 0.25),  # s; craft under 15 m roll in 2 to 4 s
        "antenna_damping": (0.03, 1.2),
    },
    "second_roll": {
        "roll_std": (0.05, 1.2),  # m athwart
        "roll_period": (2.5, 0.25),  # s
        "roll_damping": (0.03, 1.2),
    },
    "clock": {"time_std": (0.03, 1.2)},  # s, of the moment of a fix
    "beat": {  # of a receiver's interval and a logger's
        "beat_std": (0.1, 1.2),  # s, of the moment of a fix too
        "beat_period": (10.0, 1.2),  # s
        "beat_damping": (0.2, 1.2),
    },
    "steps": {"step_every": (15.0, 1.0), "step_std": (0.15, 1.3)},  # s and m, as of the study's developing half
    "slips": {"slip_std": (0.3, 1.2)},  # s, steps along the way made good besides: of the moment of a fix
    "error": {"error_std": (0.7, 1.2), "error_time": (100.0, 1.5)},  # m, s
    "quick_error": {"quick_std": (0.25, 1.2), "quick_time": (5.0, 0.8)},  # m, s
    "obstructions": {  # of the sky, by trees, bridges, quays: poor fixes in a row
        "obstructed_noise": (10.0, 0.7),  # of a poor fix, in the usual one, above 1
        "obstructed_time": (20.0, 1.2),  # s
    },
    **{aid.name: aid.priors for aid in TABLE},
}

SHARE = {"strokes": 0.02, "obstructions": 0.02}
"""Share of records that have a part, before they are seen; of the others as many have it as do not. Chosen: few vessels
are rowed or paddled, and where noise hides strokes, they make the speed of all others uncertain; few records are made
under trees, and those that are say so by hundreds of log evidence."""

EMERGENCY_ACCELERATION, EMERGENCY_YAW, EMERGENCY_TIME = 3.0, 1.5, 1.5
"""m/s², rad/s² and s: a planing craft that stops, a small craft that spins. Chosen."""
WAVE_PERIODS, SHORTEST_WAVE = ("surge_period", "yaw_period"), 2.0
"""s; waves of a shorter period are shorter than 6 m (g T²/2π) and move no vessel to and fro. What oscillates faster is
of oars or of the receiver."""
ROLL_PERIODS, LONGEST_ROLL = ("antenna_period", "roll_period"), 4.0
"""s; what takes longer of craft under 15 m is their way through waves: one more oscillation athwart, with the period of
the waves, would be taken for the antenna's. And a yaw that takes less, beside an antenna that rolls, for a course."""
SHORTEST_STAY = 2.5
"""Shortest periods that fixes resolve (five intervals) from one step of a receiver's error to the next on average: what
changes oftener is noise. Chosen: in recorded logs of receivers that step it is 9 to 100 intervals."""
TURN_SHARE = 0.5
"""Probability that a yaw manoeuvre ends in a steady turn rather than on a held course. Chosen: no preference."""
STRAIGHT_SHARE = 2.0 / 3.0
"""Probability that a steady turn ends on a held course rather than in a yaw manoeuvre. Chosen: twice as probable. With
0.5 ends of turns are noticed later in scenes with steady turns, with 0.8 a figure of eight is followed later."""
_AFTER_EMERGENCY = 0.4, 0.2, 0.2, 0.2, 0.0
"""Probabilities of the modes after an emergency. Chosen: a held course twice as probable as any other."""
_POOR = 5.0
"""Noise of a single poor fix, in the usual one, above 1. Chosen; how many fixes are poor is fitted."""
_MOST_BAD = 0.3
"""Largest share of outliers, and of poor fixes, that a filter works with. Chosen: at more they are the rule."""


def parameters_of(parts):
    """Names, prior medians (log) and deviations of a structure's numbers."""
    table = {name: prior for part in parts for name, prior in PRIORS[part].items()}
    names = tuple(table)
    return names, np.log([table[name][0] for name in names]), np.array([table[name][1] for name in names])


def log_share(parts) -> float:
    """Log of the share of vessels that have these parts, against those that have none."""
    return sum(math.log(SHARE[part] / (1.0 - SHARE[part])) for part in parts if part in SHARE)


def _modes_of(parts, v) -> tuple[np.ndarray, np.ndarray]:
    """(MODES, 4) as `Model.modes`, and the rates of change between them (MODES, MODES)."""
    calm_noise = 2.0 * v["rate_std"] ** 2 / v["rate_time"] if "calm_rate" in parts else 0.0
    turn_noise = v["turn_walk"] ** 2
    decay = 1.0 / v["rate_time"]
    speed = v["speed_walk"] ** 2
    yaw, surge = v["yaw_size"] ** 2 / v["yaw_time"], v["surge_size"] ** 2 / v["surge_time"]
    modes = np.zeros((MODES, 4))
    modes[CALM] = speed, calm_noise, decay, 0.0
    modes[TURN] = speed, turn_noise, 0.0, 0.0
    modes[YAW] = v["yaw_slip"] ** 2, yaw, 0.0, 0.0
    modes[SURGE] = surge, calm_noise, decay, 0.0
    modes[EMERGENCY] = EMERGENCY_ACCELERATION**2 * EMERGENCY_TIME, EMERGENCY_YAW**2 * EMERGENCY_TIME, 0.0, 1.0
    g = np.zeros((MODES, MODES))
    yaw_begins, surge_begins = 1.0 / v["yaw_every"], 1.0 / v["surge_every"]
    g[CALM, YAW], g[CALM, SURGE] = yaw_begins, surge_begins
    turn_ends = 1.0 / v["turn_time"]
    g[TURN, CALM], g[TURN, YAW] = STRAIGHT_SHARE * turn_ends, (1.0 - STRAIGHT_SHARE) * turn_ends
    g[TURN, SURGE] = surge_begins
    g[YAW, TURN], g[YAW, CALM] = TURN_SHARE / v["yaw_time"], (1.0 - TURN_SHARE) / v["yaw_time"]
    g[SURGE, CALM], g[SURGE, YAW] = 1.0 / v["surge_time"], yaw_begins
    g[:, EMERGENCY] = 1.0 / v["emergency_every"]
    g[EMERGENCY] = np.array(_AFTER_EMERGENCY) / EMERGENCY_TIME
    np.fill_diagonal(g, 0.0)
    np.fill_diagonal(g, -g.sum(axis=1))
    return modes, g


def model_of(parts, values) -> tuple[Model, int, int]:
    """Model of a structure with these numbers (dict), its number of states and of states that drive the motion."""
    v = values
    modes, generator = _modes_of(parts, v)
    filters, at = [], 5

    def add(acts_on, decay, frequency, std):
        nonlocal at
        filters.append((acts_on, at, decay, frequency, std * std))
        at += 2 if acts_on == ON_FIX or frequency > 0.0 else 1

    if "wander" in parts:
        add(ON_SPEED, 1.0 / v["speed_time"], 0.0, v["speed_std"])
        add(ON_RATE, 1.0 / v["wander_time"], 0.0, v["wander_std"])
    if "waves" in parts:
        for acts_on, std, name in ((ON_SPEED, "wave_surge", "surge"), (ON_COURSE, "wave_yaw", "yaw")):
            natural = 2.0 * math.pi / v[f"{name}_period"]
            add(acts_on, v[f"{name}_damping"] * natural, natural, v[std])
    if "strokes" in parts:
        natural = 2.0 * math.pi / v["stroke_period"]
        add(ON_SPEED, v["stroke_damping"] * natural, natural, v["stroke_surge"])
    driving = at
    if "antenna" in parts:
        natural = 2.0 * math.pi / v["antenna_period"]
        add(ON_ANTENNA, v["antenna_damping"] * natural, natural, v["antenna_std"])
    if "second_roll" in parts:
        natural = 2.0 * math.pi / v["roll_period"]
        add(ON_ANTENNA, v["roll_damping"] * natural, natural, v["roll_std"])
    if "beat" in parts:
        for harmonic in (1, 2):  # of a sawtooth, which the phase between two clocks is
            natural = harmonic * 2.0 * math.pi / v["beat_period"]
            add(ON_TIME, v["beat_damping"] * natural, natural, v["beat_std"] / harmonic)
    if "error" in parts:
        add(ON_FIX, 1.0 / v["error_time"], 0.0, v["error_std"])
    if "quick_error" in parts:
        add(ON_FIX, 1.0 / v["quick_time"], 0.0, v["quick_std"])
    aids = np.full((len(TABLE), 2), math.nan)
    for which, aid in enumerate(TABLE):
        if aid.name in parts:
            noise, *companion = aid.priors
            aids[which] = v[noise] ** 2, at if companion else 0
            if companion:
                std, time = companion
                add(ON_AID, 1.0 / v[time], 0.0, v[std])
    table = np.array(filters, dtype=np.float64).reshape(-1, 5)
    receiver = np.array(
        [
            v["fix_std"] ** 2,
            min(v["outlier_rate"], _MOST_BAD),
            v["drift_speed"],
            min(v["poor_rate"], _MOST_BAD),
            v.get("time_std", 0.0) ** 2,
            v["late_std"] ** 2,
            1.0 / v["step_every"] if "steps" in parts else 0.0,
            v.get("step_std", 0.0) ** 2,
            v.get("slip_std", 0.0) ** 2,
            1.0 + v.get("obstructed_noise", _POOR),
            v.get("obstructed_time", 0.0),
        ]
    )
    return Model(modes, generator, table, receiver, aids), states_of(table), driving


SHIP = {
    "yaw_size": 0.005,
    "yaw_time": 30.0,
    "yaw_every": 500.0,
    "turn_time": 120.0,
    "turn_walk": 2e-4,
    "rate_time": 20.0,
    "surge_time": 60.0,
    "surge_every": 900.0,
    "wander_std": 5e-4,
    "speed_walk": 0.003,
    "emergency_every": 2e4,
}
VESSELS = (
    # kinds of vessel to begin from; what is not named is as the prior has it. Chosen: starting points of fits, and the
    # prior of a filter that learns: a usual vessel, a ship, a small craft that spins, one whose speed changes fast.
    {},
    SHIP,
    {"yaw_size": 0.5, "yaw_time": 1.5, "rate_time": 0.4, "surge_size": 2.0, "turn_time": 6.0},
    {"yaw_size": 0.1, "speed_walk": 0.1, "wander_std": 0.05, "speed_std": 0.15, "surge_size": 5.0},
)
