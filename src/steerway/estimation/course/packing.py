"""A profile as the arrays of the kernels (see `course.motion.layout`)."""

import math

import numpy as np

from steerway.core.statistics import DIFFUSE_SPEED_STD, FIX_GATE, UNBROKEN_REJECTION
from steerway.estimation.course.motion import models
from steerway.estimation.course.motion.five_state import gauss_markov
from steerway.estimation.course.motion.layout import (
    AGEING,
    AGES_TO,
    ERROR_PAIRS,
    ERROR_STATE,
    EXTRAS,
    GATE,
    LEAVING,
    LONGEST_REJECTION,
    MOTION_STATES,
    OUTLIER_NLL,
    POSITION_VARIANCE,
    START_SPEED_VARIANCE,
    STARTS_IN,
    STATES,
    STEERAGEWAY,
    SWITCHES_TO,
    TIME_VARIANCE,
    VELOCITY_VARIANCE,
)
from steerway.estimation.course.update import aids as aiding
from steerway.estimation.course.update.outliers import OSCILLATION_OUTLIER_NLL

_LONG_HELD, _YOUNG_COURSE, _TURN = 1, 2, 3
"""Rows of a profile with two modes: a course long held, one just taken up, a turn. Row 0 is the vessel as a whole."""
_YOUNG = 0.8
"""Mean time for which a course just taken up counts as such, in mean turns. Chosen: about one turn, in which what is
left of it dies away; `steerway study estimator-limits` judges it."""


def pack(profile, aids: tuple[str, ...] = ()) -> np.ndarray:
    """(1, k) of a profile with one mode, (4, k) of one with two.

    Those are the vessel while its mode is unknown or it is at low speed, a course long held, one just taken up, and a
    turn (see `course.imm`).
    """
    turning = profile.turning
    if turning is None:
        return _row(profile, aids)[None]
    ends, begins = 1.0 / profile.turn_time, 1.0 / profile.straight_time
    turn_share = begins / (begins + ends)
    young = _YOUNG * profile.turn_time
    noises = ("speed_noise", "course_rate_noise")
    either = {name: max(getattr(profile, name), getattr(turning, name)) for name in noises}
    to_turn = {LEAVING: begins, SWITCHES_TO: _TURN}
    return np.stack(
        [
            _row(turning.model_copy(update=either), aids),
            _row(profile, aids, to_turn | {STARTS_IN: 1.0 - turn_share}),
            _row(profile, aids, to_turn | {AGEING: 1.0 / young, AGES_TO: _LONG_HELD}),
            _row(turning, aids, {LEAVING: ends, SWITCHES_TO: _YOUNG_COURSE, STARTS_IN: turn_share}),
        ]
    )


def _row(profile, aids, switching=None) -> np.ndarray:
    row, triples = np.zeros(EXTRAS), []

    def add_state(rate, density, variance) -> int:
        triples.append((rate, density, variance))
        return 4 + len(triples)

    slow = ((profile.error_std, profile.error_time), (profile.drift_std, profile.drift_time))
    for std, time in slow:
        if std > 0.0:
            row[ERROR_PAIRS] += 1
            row[ERROR_STATE] = 5
            for _ in ("north", "east"):
                add_state(*gauss_markov(std, time))
    places, companions = aiding.companion_states(profile, aids)
    first = 5 + len(triples)
    for std, time in companions:
        add_state(*gauss_markov(std, time))
    row[MOTION_STATES] = 5 + len(triples)
    models.pack(profile, row, add_state)
    row[STATES] = 5 + len(triples)
    row[POSITION_VARIANCE] = profile.position_std**2
    row[TIME_VARIANCE] = profile.time_std**2
    row[STEERAGEWAY] = profile.steerageway
    row[START_SPEED_VARIANCE] = DIFFUSE_SPEED_STD**2
    row[VELOCITY_VARIANCE] = profile.velocity_std**2
    row[GATE] = FIX_GATE
    row[OUTLIER_NLL] = OSCILLATION_OUTLIER_NLL if profile.yawing_period > 0.0 else -math.inf
    row[LONGEST_REJECTION] = UNBROKEN_REJECTION
    for index, value in (switching or {}).items():
        row[index] = value
    aid_block = aiding.packed(profile, {name: first + k for name, k in places.items()})
    return np.concatenate([row, np.ravel(triples), aid_block])
