"""LQG: the MPC's plant, observer and weights without horizon and limits, clipped to them afterwards; P4 §5's rival."""

import math

import numpy as np

from steerway.control.heading_mpc import default_weights
from steerway.control.heading_plant import (
    BiasObserver,
    Identified,
    InputLimits,
    LinearPlant,
    SampledHeading,
    parts_for,
)


class HeadingLqg(SampledHeading):
    """Δu = −L ([x; u] − [x; u] at rest on the wanted heading), with the observer's bias at rest made up for.

    Arguments as HeadingMpc's. The gain minimises Σ Q e² + R Δu² over all time.
    """

    def __init__(
        self,
        plant: LinearPlant,
        limits: InputLimits,
        observer: BiasObserver,
        output_weight: float | None = None,
        change_weight: float | None = None,
    ):
        from scipy.linalg import solve_discrete_are

        output_weight, change_weight = default_weights(limits, output_weight, change_weight)
        n = len(plant.b)
        a, b = np.eye(n + 1), np.append(plant.b, 1.0)[:, None]
        a[:n, :n], a[:n, n] = plant.a, plant.b
        c = np.append(plant.c, 0.0)[None]
        cost = solve_discrete_are(a, b, output_weight * c.T @ c, np.array([[change_weight]]))
        self.gain = (b.T @ cost @ a / (change_weight + b.T @ cost @ b))[0]
        at_rest = np.zeros((n + 1, n + 1))
        at_rest[:n, :n], at_rest[:n, n], at_rest[n, :n] = plant.a - np.eye(n), plant.b, plant.c
        self._rest = np.linalg.solve(at_rest, np.eye(n + 1)[n])
        super().__init__(plant, limits, observer)

    @classmethod
    def for_(
        cls,
        identified: Identified,
        limit: float,
        rate: float = math.inf,
        angle_std: float = 0.0,
        output_weight: float | None = None,
        change_weight: float | None = None,
    ) -> "HeadingLqg":
        """A controller for an identified heading; see `HeadingMpc.for_`."""
        return cls(*parts_for(identified, limit, rate, angle_std), output_weight, change_weight)

    def change(self, wanted: float) -> float:
        """See `SampledHeading`. At rest the input makes up for the bias: it stands at the model's own less the bias."""
        state = self.observer.state[:-1]
        if self._plant.circular:
            now = float(self._plant.c @ state)
            wanted = now + math.remainder(wanted - now, 2.0 * math.pi)
        away = np.append(state, self.input + self.observer.bias) - self._rest * wanted
        return -float(self.gain @ away)
