"""Where the search for a structure's numbers begins."""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from steerway.estimation.inference.fit import Rows
from steerway.estimation.inference.record import white_std
from steerway.estimation.inference.spectrum import Periods, periods_of
from steerway.estimation.inference.structures import LONGEST_ROLL, SHIP, parameters_of

_RESOLVED = 2.0
"""Usual intervals between fixes in the shortest period that they resolve (the sampling theorem)."""
_PLAIN = ("base", "wander")
_HALVES = np.array(
    # Half prior deviations of the plain structure's numbers but the first from their medians. Of fits to recorded logs
    # and scenes these are the thirteen from which fits to the others go farthest up.
    [
    (-1, 0, -1, 0, 1, 2, 0, 5, 0, -1, 0, 0, 2, -2, 1, 2, 2, 0, 1, -1),
    (3, -1, -1, 5, -2, 2, 1, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 0, 3, -5),
    (-1, 0, -2, -1, 0, -2, -1, -1, 0, 2, 0, 0, -1, -1, 2, -2, -2, 1, -2, 1),
    (0, -2, -1, 6, 1, 0, 0, 6, 0, -3, 0, 1, 2, -2, 0, 8, 0, 0, 4, -8),
    (-1, 2, -1, 0, 1, 2, 0, 5, 0, -1, -1, 0, 1, -3, 0, 4, 3, 0, 3, -3),
    (-1, 0, 0, 0, 2, 1, 0, 5, 0, -1, -3, 1, 0, -1, 1, 0, 2, 1, -1, 0),
    (5, -2, -1, 0, 1, 1, -1, 5, 0, 0, -2, 0, 0, -6, 0, 8, 0, 0, 3, -5),
    (3, -1, -1, 1, -2, 3, -1, 2, -4, 1, -1, 0, 0, 1, 0, 0, -2, 0, -2, -2),
    (5, -3, 2, 1, 2, 0, 2, 0, 0, 0, 0, -1, 4, -1, 0, 4, 0, -5, 3, -7),
    (-1, -1, -1, 4, 1, 0, -1, 5, 0, -2, -1, 0, 1, -5, 0, 4, 0, 0, 2, -3),
    (1, -1, 3, 4, -1, 2, -1, 0, 0, -1, -1, 0, 0, -5, -4, 4, 2, 3, 3, -3),
    (-1, 0, -1, -1, 1, 1, -1, -1, 0, -2, -2, 0, -1, 0, 0, -1, -2, 0, -1, -1),
    (0, 0, 0, -2, -4, 6, 1, -1, -2, -1, 0, -4, 0, 2, 3, 0, 2, 1, -1, -1),
    ]
)  # fmt: skip
_NOISES = np.array((1.1, 0.78, 1.1, 0.97, 0.38, 0.91, 0.59, 1.0, 1.1, 0.07, 1.6, 1.1, 0.92))
"""The first, noise of a fix, in that of third differences: motion makes those larger, a receiver's filter less."""

_WAVE, _SWELLS = 3.0, (4.0, 7.0, 12.0, 20.0)
"""s: a line of a shorter period is looked for in the receiver and its antenna first. Waves begin from longer ones, or
where there is none from a grid. Chosen: with all lines a roll of 2.5 s is fitted as a yaw of the vessel, 1,100 of log
evidence below it."""


class Scales(NamedTuple):
    """What a record tells before any fit: noise of a fix by third differences (m), the shortest period (s) that the
    fixes resolve, and the periods that stand out in its spectrum."""

    noise: float
    shortest: float
    periods: Periods


def scales_of(record: Rows) -> Scales:
    """The scales of a record with at least a few fixes."""
    fixed = np.isfinite(record.north)
    places = record.time[fixed], record.north[fixed], record.east[fixed]
    return Scales(white_std(*places), _RESOLVED * float(np.median(np.diff(places[0]))), periods_of(*places))


def vessels(noise) -> list[dict]:
    """Numbers of the plain structure to begin from, of a receiver of this noise (m)."""
    names, medians, deviations = parameters_of(_PLAIN)
    others = np.exp(medians[1:] + 0.5 * deviations[1:] * _HALVES)
    return [dict(zip(names, each, strict=True)) for each in np.column_stack([noise * _NOISES, others]).tolist()]


def ships(noise) -> list[dict]:
    """The same of vessels whose fixes are far apart: a ship that keeps her speed, and one that slows down."""
    return [SHIP | {"fix_std": noise}, SHIP | {"fix_std": noise, "surge_size": 2.0}]


def starts(part, values, scales: Scales) -> list[list[dict]]:
    """Where to begin the search for a part's numbers: lists of numbers, each to be added to the likeliest so far; none
    where a record shows no sign of the part."""
    noise, shortest, periods = scales
    v = values
    less = values | {"fix_std": 0.5 * values["fix_std"]}
    rolls = [period for period in periods.across if period < LONGEST_ROLL] or [2.0, 3.0]
    if part == "waves":
        along, across = ([p for p in each if p > _WAVE] or _SWELLS for each in periods)
        surges = product(({}, {"speed_std": 0.01}), along, (0.005, 0.05, 0.2))
        yaws = product(({}, {"wander_std": 0.003}), across, (0.005, 0.03, 0.1))
        return [
            [
                v | still | {"surge_period": period, "wave_surge": std, "wave_yaw": 0.01}
                for still, period, std in surges
            ],
            [still | {"yaw_period": period, "wave_yaw": std} for still, period, std in yaws],
        ]
    if part == "strokes":
        period = periods.along[0]  # oars make the strongest line, if any
        strokes = product((values, less), (0.03, 0.2))
        return (
            [[v | {"stroke_period": period, "stroke_surge": std} for v, std in strokes]]
            if shortest < period < _WAVE
            else []
        )
    if part == "antenna":
        all_ = product((values, less, values | {"fix_std": noise}), rolls, (0.005, 0.02, 0.15))
        return [[v | {"antenna_period": period, "antenna_std": std} for v, period, std in all_]]
    if part == "second_roll":
        return [[v | {"roll_period": period, "roll_std": std} for period, std in product(rolls, (0.02, 0.1))]]
    if part == "quick_error":
        errors = product(_sizes(noise, 0.2), (1.5, 5.0))
        return [[v | {"quick_std": std, "quick_time": time} for std, time in errors]]
    if part == "clock":
        return [[v | {"time_std": std} for v, std in product((values, less), (0.001, 0.01, 0.1))]]
    if part == "beat":
        beats = product((1.0, 0.3), (0.1, 0.3), (0.05, 0.2), periods.along)
        return [
            [
                v | {"time_std": share * v["time_std"], "beat_std": std, "beat_damping": damping, "beat_period": period}
                for share, std, damping, period in beats
            ]
        ]
    if part == "slips":
        share = values | {"step_std": 0.3 * values["step_std"]}
        return [[v | {"slip_std": std} for v, std in product((values, share), (0.1, 0.3, 1.0))]]
    if part == "steps":
        steps = product((values, less), (10.0, 60.0), (3.0 * noise, 10.0 * noise))
        return [[v | {"step_every": every, "step_std": std} for v, every, std in steps]]
    if part == "obstructions":  # which may have been taken for manoeuvres
        poor = product((values, *vessels(noise)), (5.0, 20.0))
        return [[v | {"poor_rate": 0.01, "obstructed_noise": ratio, "obstructed_time": 20.0} for v, ratio in poor]]
    errors = product((values, less, values | {"fix_std": noise}), _sizes(noise, 1.0), (20.0, 200.0))
    return [[v | {"error_std": std, "error_time": time} for v, std, time in errors]]


def _sizes(noise, largest):
    """Where to begin the search for the size (m) of a receiver's error: from its noise to that of a receiver alone."""
    return noise, math.sqrt(noise * largest), largest
