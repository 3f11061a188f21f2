"""P4's Kalman filter (5)–(7) as printed, of the compass alone with the heading for a known input; and a textbook's MPC.

The heading is what is sought, so that only a simulation can feed it. The studies' filter and the product's have four
states, vehicle and compass, and the propellers' difference for an input.
"""

import math

import numpy as np

from steerway.sensors import TCM2, CompassModel

STATE_VARIANCE, READING_VARIANCE = 1.0, 2.0
"""deg², (7)."""


class PrintedCompassKalman:
    """One step a tick of 1/40 s; angles in degrees. `covariance` is that of the two compass states, (2, 2).

    variances: that a tick adds to either state, and of a reading, deg².
    """

    def __init__(self, model: CompassModel = TCM2, variances: tuple[float, float] = (STATE_VARIANCE, READING_VARIANCE)):
        self._added, self._read = variances
        self._a = np.array([[model.a1, model.a2], [model.shift, 0.0]])
        self._b, self._c = np.array([model.b, 0.0]), np.array([model.k, 0.0])
        self.state = np.zeros(2)
        self.covariance = np.eye(2)

    @property
    def heading(self) -> float:
        """The estimated reading, which for a gain of 1 at rest is the heading, degrees."""
        return float(self._c @ self.state)

    def step(self, heading: float, reading: float) -> float:
        """Predict with the `heading` for input, (5); correct by a `reading`, (6). Returns the estimate."""
        self.state = self._a @ self.state + self._b * heading
        self.covariance = self._a @ self.covariance @ self._a.T + self._added * np.eye(2)
        variance = float(self._c @ self.covariance @ self._c) + self._read
        gain = self.covariance @ self._c / variance
        self.state = self.state + gain * (reading - self.heading)
        self.covariance = self.covariance - np.outer(gain, self._c @ self.covariance)
        return self.heading


class OutputCorrectedMpc:
    """A HeadingMpc whose plant states run free: the last output error is added to the prediction (step-response MPC).

    On a plant that is not asymptotically stable the free states drift off, and with them the prediction.
    """

    def __init__(self, mpc):
        self._mpc = mpc
        mpc.reset(0.0)

    def step(self, wanted: float, estimated: float) -> float:
        error = estimated - self._mpc.observer.output
        return self._mpc.step(wanted - error, math.nan)
