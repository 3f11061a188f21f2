"""The boats of the study, the surge model every run takes for granted, and chance's own boats."""

import math

import numpy as np

from steerway.control import AdaptiveSpeed, AdaptiveSpeedGains
from steerway.identification import SurgeModel
from steerway.vessels import (
    CALDAS_LINEAR_DRAG,
    CALDAS_MASS,
    CALDAS_QUADRATIC_DRAG,
    Actuator,
    Propeller,
    Surge,
    published_surrogate,
)
from steerway.vessels import CALDAS_SHAFT as SHAFT

SPEEDS = (3, 6, 9)
SURROGATE_LAG = 10.683
PLANTS = {"a": "T, 0.5 s lag", "b": "T, 1.75 rev/s²", "c": "P, inner loop"}

NOMINAL = SurgeModel(
    CALDAS_LINEAR_DRAG / CALDAS_MASS, CALDAS_QUADRATIC_DRAG / CALDAS_MASS, Propeller().gain / CALDAS_MASS
)
"""Plant T's own numbers: the propeller model that votes."""


def shaft(lag=0.0, rate=math.inf, high=17.5) -> Actuator:
    """A shaft by its lag (s), largest rate (rev/s²) and speed (rev/s)."""
    return Actuator("shaft speed", 0.0, high, rate, lag)


def plant(name: str) -> Surge:
    """T as printed, a to c of the study, P the surrogate of the published curves."""
    if name in ("c", "P"):
        return published_surrogate()
    return Surge(shaft={"T": SHAFT, "a": shaft(lag=0.5), "b": shaft(rate=1.75)}[name])


def controller(name: str) -> AdaptiveSpeed:
    """MRAC+ for a plant: the same everywhere, but for the inner loop that P's slow shaft needs."""
    return AdaptiveSpeed(AdaptiveSpeedGains(shaft_lag=SURROGATE_LAG if name in ("c", "P") else 0.0))


def random_plant(seed: int) -> Surge:
    """Mass ±20 %, each damping ±40 %, thrust ±20 %, shaft lag 0–1.5 s, rate 1–3 rev/s²."""
    draws = np.random.default_rng(seed)
    mass, linear, quadratic, thrust = 1.0 + draws.uniform(-1.0, 1.0, 4) * (0.2, 0.4, 0.4, 0.2)
    machine = shaft(lag=draws.uniform(0.0, 1.5), rate=draws.uniform(1.0, 3.0))
    return Surge(
        CALDAS_MASS * mass,
        CALDAS_LINEAR_DRAG * linear,
        CALDAS_QUADRATIC_DRAG * quadratic,
        Propeller(efficiency=0.8 * thrust),
        machine,
    )
