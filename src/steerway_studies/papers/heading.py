"""P4's Kalman filter (5)–(7) as printed, which filters the compass with the heading as input.

The heading is the quantity to be estimated, so only a simulation can supply this input. The filter of the studies and
of `steerway` has four states, vehicle and compass; its input is the speed difference of the propellers.
"""

import numpy as np

from steerway.sensors import TCM2, CompassModel

STATE_VARIANCE, READING_VARIANCE = 1.0, 2.0
"""Variances, deg², P4 (7): of each compass state in a tick, and of a reading."""


class PrintedCompassKalman:
    """Filter of the compass, with a step every 1/40 s; angles in degrees. `covariance` (2, 2) is of the two states.

    variances: the variance that a step adds to each state, and the variance of a reading, deg².
    """

    def __init__(self, model: CompassModel = TCM2, variances: tuple[float, float] = (STATE_VARIANCE, READING_VARIANCE)):
        self._added, self._read = variances
        self._a = np.array([[model.a1, model.a2], [model.shift, 0.0]])
        self._b, self._c = np.array([model.b, 0.0]), np.array([model.k, 0.0])
        self.state = np.zeros(2)
        self.covariance = np.eye(2)

    @property
    def heading(self) -> float:
        """The estimated reading, degrees; for a compass of gain 1 at rest it equals the heading."""
        return float(self._c @ self.state)

    def step(self, heading: float, reading: float) -> float:
        """Predict with the input `heading`, (5); correct by a `reading`, (6). Returns the new estimated reading."""
        self.state = self._a @ self.state + self._b * heading
        self.covariance = self._a @ self.covariance @ self._a.T + self._added * np.eye(2)
        variance = float(self._c @ self.covariance @ self._c) + self._read
        gain = self.covariance @ self._c / variance
        self.state = self.state + gain * (reading - self.heading)
        self.covariance = self.covariance - np.outer(gain, self._c @ self.covariance)
        return self.heading
