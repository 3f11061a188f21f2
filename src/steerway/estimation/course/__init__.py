"""Speed over ground, course over ground and course rate from positions, and the kernels these are made of."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.core.kalman import correct, innovation, normalised_square
    from steerway.estimation.aboard import AtFaceValue, FilterEstimator
    from steerway.estimation.course.motion.five_state import chord
    from steerway.estimation.course.motion.five_state import predict as predict_five_state
    from steerway.estimation.course.motion.layout import (
        LEAVING,
        POSITION_VARIANCE,
        Q_LL,
        Q_LU,
        Q_UU,
        Q_WW,
        Q_XW,
        Q_XX,
        Q_YW,
        Q_YX,
        Q_YY,
        RATE_LEFT,
        SPEED_LEFT,
        START_RATE_VARIANCE,
        START_SPEED_VARIANCE,
        TURN,
    )
    from steerway.estimation.course.motion.models import set_step, transition
    from steerway.estimation.course.smoothing.rauch_tung_striebel import smoothing_step
    from steerway.estimation.course.update.invariant import rotate_correction
    from steerway.estimation.log.compare import Agreement, compare

__all__ = [
    "LEAVING",
    "POSITION_VARIANCE",
    "Q_LL",
    "Q_LU",
    "Q_UU",
    "Q_WW",
    "Q_XW",
    "Q_XX",
    "Q_YW",
    "Q_YX",
    "Q_YY",
    "RATE_LEFT",
    "SPEED_LEFT",
    "START_RATE_VARIANCE",
    "START_SPEED_VARIANCE",
    "TURN",
    "Agreement",
    "AtFaceValue",
    "FilterEstimator",
    "chord",
    "compare",
    "correct",
    "innovation",
    "normalised_square",
    "predict_five_state",
    "rotate_correction",
    "set_step",
    "smoothing_step",
    "transition",
]
__getattr__, __dir__ = on_demand(__name__)
