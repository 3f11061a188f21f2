"""P2's saturation (20) and control law (30) exactly as printed. Labelled: the first is a constant, the second pushes
the vessel away from its goal. The product is `control.positioning` and `estimation.positioning.time_varying`.
"""

import numpy as np


def saturation(speed):
    """(20): min(max(x, 0.5), 0.25), which is 0.25 for every x."""
    return min(max(speed, 0.5), 0.25)


class PrintedPositionPID:
    """(30): τ = K_p x̃ + K_d dx̃/dt + K_i ∫x̃ dt with x̃ = x − x_d, positive gains and no turn into the body."""

    def __init__(self, gains):
        self._gains = gains
        self._integral = np.zeros(3)

    def step(self, desired, north, east, heading, velocity, dt) -> np.ndarray:
        """Force (3,) within the limits; `velocity` is that of north, east and heading, for a resting x_d."""
        gains = self._gains
        error = np.array([north, east, heading]) - desired
        self._integral += dt * error
        wanted = gains.proportional @ error + gains.derivative @ velocity + gains.integral @ self._integral
        return np.clip(wanted, -np.array(gains.limit), gains.limit)
