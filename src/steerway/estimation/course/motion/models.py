"""The motion models a mode can have, and what filter, smoother and forecast ask of them.

A model is one kernel `predict(x, p, step, parameters)`: x ← f(x) and P ← F P Fᵀ + Q, where F is the Jacobian of f. It
is the only statement of f, F and Q. P may be wider than n: the columns beyond are covariances with constants, which a
prediction multiplies by F alone. With P = 0 and the identity beside it, `predict` leaves Q and F there.
"""

import numpy as np

from steerway.core.arrays import Floats
from steerway.core.compiled import called_kernel, kernel, lean_kernel
from steerway.estimation.course.motion import acceleration, five_state, low_speed, oscillation
from steerway.estimation.course.motion.layout import MOTION

MODELS = (five_state, acceleration, oscillation)
"""The dispatch table: a model's place is its code, and a profile has the last of those that it gives numbers for."""
FIVE_STATE, ACCELERATION, OSCILLATION = range(3)

_predict_five_states = five_state.predict
_predict_acceleration = acceleration.predict
_predict_oscillation = oscillation.predict
_predict_low_speed = low_speed.predict
_long_run_of_oscillation = oscillation.long_run


def pack(profile, row, add_state) -> None:
    """Fill what a row of parameters holds of the motion; add_state(rate, density, variance) gives a state its index."""
    row[MOTION] = max(k for k, model in enumerate(MODELS) if model.pack(profile, row, add_state))


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
