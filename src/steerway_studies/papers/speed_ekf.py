"""P3's speed filter as printed: one state, three "speed sensors", the propeller model of (23) as its prediction.

(28) as printed adds the expected measurement and diverges; `printed=False` subtracts it, and takes the Jacobian (27)
with |u|. The paper gives neither Q, P0, û0 nor the step: here q = 0.05² m²/s³, P0 = 1 m²/s², û0 = 0. For studies and
tests, never for a boat: see `steerway.estimation.speed.fusion`.
"""

import math

from steerway_studies.papers.speed_mrac import PRINTED_GUESS

SENSOR_STDS = (0.03, 0.002, 5e-6 * 9.80665)
"""m/s of GPS, DVL and IMU: Table III, the accelerometer's 5 µg read as the paper uses it, as a speed."""


class PrintedSpeedEkf:
    """P3 (22)–(30), sensors taken one by one as they come, which for a diagonal R is the joint update."""

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
