"""The motion models a mode can have, and what filter, smoother and forecast ask of them.

A model is one kernel `predict(x, p, step, parameters)`: x ← f(x) and P ← F P Fᵀ + Q, where F is the Jacobian of f. It
is the only statement of f, F and Q. P may be wider than n: the columns beyond are covariances with constants, which a
prediction multiplies by F alone. With P = 0 and the identity beside it, `predict` leaves Q and F there.
"""

import math

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.estimation.course.motion import acceleration, five_state, low_speed, oscillation
from steerway.estimation.course.motion.layout import (
    ACCELERATION_STATE,
    COURSE,
    EXTRAS,
    LONGEST_STEP,
    LOST_COURSE_VARIANCE,
    MOTION,
    RATE,
    RATE_DECAY,
    RATE_NOISE,
    SPEED,
    SPEED_DECAY,
    STEERAGEWAY,
    STEP_SLACK,
    VELOCITY_CHANGE,
)

MODELS = (five_state, acceleration, oscillation)
"""The dispatch table: a model's place is its code, and a profile has the last of those that it gives numbers for."""
FIVE_STATE, ACCELERATION, OSCILLATION = range(3)

_LONGEST = 30.0
"""s of a step under way at most, and parts of a radian and of its speed by which the vessel turns and accelerates in
one. Chosen: `tests/test_long_intervals.py` compares with steps of 1 s on generated reports of AIS."""
_LARGEST_TURN, _LARGEST_CHANGE = 0.03, 0.05
LEAST_SPEED = 1e-3
"""m/s, to divide by: a vessel under way is faster (see `steerageway`)."""

_set_five_states = five_state.set_step
_set_acceleration = acceleration.set_step
_predict_five_states = five_state.predict
_predict_acceleration = acceleration.predict
_predict_oscillation = oscillation.predict
_predict_low_speed = low_speed.predict
_long_run_of_oscillation = oscillation.long_run


def pack(profile, row, add_state) -> None:
    """Fill what a row of parameters holds of the motion; add_state(rate, density, variance) gives a state its index."""
    row[MOTION] = max(k for k, model in enumerate(MODELS) if model.pack(profile, row, add_state))


@called_kernel
def set_step(step: Floats, dt: float, parameters: Floats) -> None:
    """Fill `step` with what a prediction over dt ≥ 0 seconds needs that depends on dt alone.

    step: (3, n) or longer, (5, n) where acceleration persists.
    """
    _set_five_states(step, dt, parameters)
    if parameters[ACCELERATION_STATE]:
        _set_acceleration(step, parameters)


@called_kernel
def parts_of(x, p, under_way, dt, parameters):
    """Into how many equal steps to divide the prediction of one mode over dt > 0 seconds.

    Low speed is linear: one step. Under way a step assumes a constant turn and, for the noise across the course, a
    constant speed; where the course may become undefined on the way, that is looked for at every longest step.
    """
    most = max(math.ceil(dt / parameters[LONGEST_STEP] - STEP_SLACK), 1)
    if most == 1 or parameters[MOTION] == OSCILLATION:
        return most
    if not under_way:
        return 1
    if may_lose_course(p, dt, parameters):
        return most
    turn = abs(x[RATE]) * lasting(parameters[RATE_DECAY], dt)
    change, a = parameters[SPEED_DECAY] * dt, int(parameters[ACCELERATION_STATE])
    if a:
        change += abs(x[a]) * lasting(parameters[EXTRAS + 3 * (a - 5)], dt) / max(x[SPEED], LEAST_SPEED)
    parts = max(dt / _LONGEST, turn / _LARGEST_TURN, change / _LARGEST_CHANGE)
    return min(max(math.ceil(parts - STEP_SLACK), 1), most)


@lean_kernel
def change_velocity(x, p, under_way, parameters):
    """Add to P what a change of velocity at this moment would do, if the parameters say that there is one."""
    variance = parameters[VELOCITY_CHANGE]
    if variance > 0.0:
        p[SPEED, SPEED] += variance
        p[COURSE, COURSE] += variance / max(x[SPEED], parameters[STEERAGEWAY]) ** 2 if under_way else variance


@lean_kernel
def lasting(rate, dt):
    """s for which what decays at `rate` lasts within dt, at most."""
    return min(dt, 1.0 / rate) if rate > 0.0 else dt


@lean_kernel
def may_lose_course(p, dt, parameters):
    """Whether a bound of the course's variance after dt under way exceeds that at which it is undefined."""
    s = lasting(parameters[RATE_DECAY], dt)
    wander = parameters[RATE_NOISE] * dt * s * s
    known = p[COURSE, COURSE] + s * (2.0 * abs(p[COURSE, RATE]) + s * p[RATE, RATE])
    return known + wander > LOST_COURSE_VARIANCE


@called_kernel
def predict(x, p, step, parameters):
    """Prediction under way, by the model of the mode."""
    model = parameters[MOTION]
    if model == ACCELERATION:
        _predict_acceleration(x, p, step, parameters)
    elif model == OSCILLATION:
        _predict_oscillation(x, p, step, parameters)
    else:
        _predict_five_states(x, p, step, parameters)


@lean_kernel
def predict_phase(x, p, under_way, step, parameters):
    """Prediction under way or at low speed."""
    if under_way:
        predict(x, p, step, parameters)
    else:
        _predict_low_speed(x, p, step, parameters)


@called_kernel
def linearise(x, p, under_way, step, parameters):
    """Move x by a step and fill p (n, 2n): Q, upper triangle, and F beside it."""
    n = len(x)
    for i in range(n):
        for j in range(2 * n):
            p[i, j] = 1.0 if j == n + i else 0.0
    predict_phase(x, p, under_way, step, parameters)


@kernel
def transition(x: Floats, under_way: bool, step: Floats, parameters: Floats, f: Floats) -> None:
    """Fill f (n, n) with the Jacobian of a step from state x."""
    n = len(x)
    both = np.empty((n, 2 * n))
    linearise(x.copy(), both, under_way, step, parameters)
    f[:] = both[:, n:]


@kernel
def long_run(x, p, parameters):
    """Parameters of the five-state model (with acceleration) that a forecast follows; x and P become its state."""
    if parameters[MOTION] == OSCILLATION:
        return _long_run_of_oscillation(x, p, parameters)
    return parameters
