"""Unwinding: what P0 (54) spares a boat by wrapping the course error, on the Nomoto model that its gains come from."""

from steerway.core import wrap
from steerway_studies.papers.course_autopilot import OTTER_NOMOTO, rudder

_STEP = 0.02


def turned(gains, start: float, command: float, wrapped: bool, seconds: float = 60.0) -> float:
    """How far (rad, + to starboard) an Otter at rest in yaw turns from one course to another.

    gains: (K_p, T_i, T_d) of P0 (54); `wrapped` False takes the error as the plain difference, without an integral.
    """
    gain, time_constant = OTTER_NOMOTO
    proportional, _, derivative_time = gains
    course, rate, integral = start, 0.0, 0.0
    for _ in range(round(seconds / _STEP)):
        error = course - command
        if wrapped:
            moment = rudder(error, integral, rate, gains, printed=False)
            integral += _STEP * wrap(error)
        else:
            moment = -proportional * (error + derivative_time * rate)
        course += _STEP * rate
        rate += _STEP * (gain * moment - rate) / time_constant
    return course - start
