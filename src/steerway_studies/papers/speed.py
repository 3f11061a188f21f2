"""P3's adaptive speed controller and its speed filter as printed.

The controller has one γ for three parameters of different units, no limit, and no feedback except the adaptation.

L. H. S. Caldas, Speed control and sensor fusion implementation for an autonomous surface vessel using adaptive control
and extended Kalman filter: P3. The last term of (15) is read as â_u|u| u|u|, and a negative radicand counts as 0. For
studies and tests; on a boat use `steerway.control.AdaptiveSpeed` and `steerway.estimation.speed.SurgeFusion`.
"""

import math

import numpy as np

from steerway.core import kernel

PRINTED_GUESS = (0.0015, 0.01, 0.0049)
"""d0 in 1/s, b0 in 1/m, g0 in m/rev²: section V."""


class PrintedMrac:
    """P3 (14)–(18). `step` returns the shaft speed, rev/s.

    `adaptation` is γ; with 0 the parameters stay at the first guess, as they seem to do in the published figures.
    `sign` is sgn(g). With `adapt_first` a step updates the parameters before it computes the output, else after it.
    `high` limits n.
    """

    def __init__(self, adaptation=0.5, model_rate=0.1, sign=1.0, adapt_first=True, high=math.inf):
        d0, b0, g0 = PRINTED_GUESS
        self.parameters = np.array([model_rate, d0 - model_rate, b0]) / g0
        self.model = 0.0
        self._constants = (adaptation * sign, model_rate, adapt_first, high)

    def step(self, setpoint: float, speed: float, dt: float, shaft: float = math.nan) -> float:
        self.model, command = _printed_step(self.parameters, self.model, float(setpoint), speed, dt, *self._constants)
        return command


@kernel
def _printed_step(a, model, setpoint, speed, dt, adaptation, model_rate, adapt_first, high):
    model += dt * model_rate * (setpoint - model)
    z = speed - model
    regressor = (setpoint, speed, speed * abs(speed))
    for order in range(2):
        if (order == 0) == adapt_first:
            for i in range(3):
                a[i] -= adaptation * z * regressor[i] * dt
        else:
            command = math.sqrt(max(0.0, a[0] * regressor[0] + a[1] * regressor[1] + a[2] * regressor[2]))
    return model, min(command, high)


SENSOR_STDS = (0.03, 0.002, 5e-6 * 9.80665)
"""1σ of GPS, DVL and IMU, m/s: Table III. The accelerometer's 5 µg is read as a speed, as the paper uses it."""


class PrintedSpeedEkf:
    """P3 (22)–(30), with an update by each sensor in turn, which for a diagonal R equals the joint update.

    One state, three "speed sensors", and the propeller model of (23) for the prediction. (28) as printed adds the
    expected measurement and diverges; `printed=False` subtracts it, and uses |u| in the Jacobian (27). The paper states
    neither Q, P0, û0 nor the step: here q = 0.05² m²/s³, P0 = 1 m²/s², û0 = 0.
    """

    def __init__(self, printed=True, density=0.05**2, variance=1.0, speed=0.0, guess=PRINTED_GUESS):
        self.speed, self.variance = speed, variance
        self._printed, self._density, self._guess = printed, density, guess

    def predict(self, shaft: float, dt: float) -> None:
        """(23), (26), (27) over dt s at a shaft speed in rev/s."""
        d, b, g = self._guess
        u = self.speed
        slope = 1.0 + (-d - 2.0 * b * (u if self._printed else abs(u))) * dt
        self.speed = u + (-d * u - b * u * abs(u) + g * shaft * shaft) * dt
        self.variance = slope * self.variance * slope + self._density * dt

    def update(self, reading: float, std: float) -> None:
        """(28)–(30) with one sensor's reading, m/s."""
        gain = self.variance / (self.variance + std * std)
        expected = -self.speed if self._printed else self.speed
        self.speed += gain * (reading - expected)
        if not math.isfinite(self.speed) or abs(self.speed) > 1e12:
            self.speed = math.copysign(1e12, self.speed)
        self.variance *= 1.0 - gain
