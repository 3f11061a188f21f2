"""Motion below steerageway: velocity as a random walk along either axis, states [x^n y^n v_N v_E ω_χ].

A linear model, which no speed can mislead: from a diffuse velocity it is the straight-line fit through the first fixes,
and at a standstill it has no course to lose. The course rate does not move.
"""

from steerway.core.compiled import called_kernel
from steerway.estimation.course.motion.five_state import predict_extras, turn_noise
from steerway.estimation.course.motion.layout import (
    DT,
    EAST,
    NORTH,
    SPEED_DECAY,
    SPEED_INTEGRAL,
    SPEED_LEFT,
    SPEED_NOISE,
    STEERAGEWAY,
    VELOCITY_EAST,
    VELOCITY_NORTH,
)

SPEED_UP_TIME = 10.0
"""s in which a vessel may reach steerageway from rest, whatever S_U is. Chosen: the 2 m Otter takes some 3 s, a ship
minutes, which only costs a wider variance at rest."""


@called_kernel
def predict(x, p, step, parameters):
    """x ← F x, P ← F P Fᵀ + Q in place."""
    left, integral = step[SPEED_LEFT], step[SPEED_INTEGRAL]
    vv, yv, yy, _, _, _ = turn_noise(parameters[SPEED_DECAY], step[DT])  # velocity and place, as rate and course
    density = parameters[SPEED_NOISE] + parameters[STEERAGEWAY] ** 2 / SPEED_UP_TIME
    x[NORTH] += integral * x[VELOCITY_NORTH]
    x[EAST] += integral * x[VELOCITY_EAST]
    x[VELOCITY_NORTH] *= left
    x[VELOCITY_EAST] *= left
    p[0, 0] += integral * (2.0 * p[0, 2] + integral * p[2, 2]) + density * yy
    p[1, 1] += integral * (2.0 * p[1, 3] + integral * p[3, 3]) + density * yy
    p[0, 1] += integral * (p[0, 3] + p[1, 2] + integral * p[2, 3])
    p[0, 2] = left * (p[0, 2] + integral * p[2, 2]) + density * yv
    p[1, 3] = left * (p[1, 3] + integral * p[3, 3]) + density * yv
    p[0, 3] = left * (p[0, 3] + integral * p[2, 3])
    p[1, 2] = left * (p[1, 2] + integral * p[2, 3])
    p[2, 2] = left * left * p[2, 2] + density * vv
    p[3, 3] = left * left * p[3, 3] + density * vv
    p[2, 3] *= left * left
    for j in range(5, p.shape[1]):
        p[0, j] += integral * p[2, j]
        p[1, j] += integral * p[3, j]
        p[2, j] *= left
        p[3, j] *= left
    predict_extras(x, p, step)
