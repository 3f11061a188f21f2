"""The observers of the study, each made anew for every run."""

import math
import warnings
from dataclasses import replace

import numpy as np

from steerway.estimation.positioning import (
    DEMO_GAINS,
    ObserverGains,
    PassiveObserver,
    SpeedDependentFixNoise,
    TimeVaryingNoise,
    VariationalNoise,
    VesselFilter,
    VesselNoise,
)
from steerway.vessels import CYBERSHIP2_DAMPING as DAMPING
from steerway.vessels import CYBERSHIP2_INERTIA as INERTIA
from steerway_studies.cybership_observers import scenario

BASE = VesselNoise(position_std=scenario.FIX_STD, heading_std=scenario.HEADING_STD)
PRODUCT = replace(BASE, force_std=tuple(scenario.FORCE_STD), force_time=scenario.FORCE_TIME)
WAVES = replace(
    PRODUCT,
    wave_std=scenario.WAVE_STD,
    wave_frequency=scenario.WAVE_FREQUENCY,
    wave_damping=scenario.WAVE_DAMPING,
)
SWELL = replace(WAVES, wave_damping=scenario.SWELL_DAMPING)
DOUBTFUL = replace(PRODUCT, acceleration=(1e-4, 1e-4, 1e-5), force_std=tuple(2.0 * scenario.FORCE_STD))
"""For a vessel whose drag is not what the filter's linear model says."""

RECIPE_B = 1.5e-3
"""The scale of Q under which Table III comes out."""

TUNED_GAINS = ObserverGains(
    cutoff=(0.333, 0.333, 1.0),
    force=(0.013 * INERTIA[0, 0], 0.013 * INERTIA[1, 1], 0.03 * INERTIA[2, 2]),
    velocity=(0.082 * INERTIA[0, 0], 0.082 * INERTIA[1, 1], 0.3 * INERTIA[2, 2]),
)


PRINTED_NOISE = TimeVaryingNoise()
"""Q as (19) prints it."""


def time_varying(noise=PRINTED_NOISE, fix_noise=None) -> VesselFilter:
    """P2's filter, corrected: (20) clips, Q is a density, no gate. The printed Q by default."""
    return VesselFilter(INERTIA, DAMPING, BASE, math.inf, fix_noise, noise)


def constant(scale: float, yaw: float) -> TimeVaryingNoise:
    """Q that does not follow the velocity."""
    return TimeVaryingNoise(coefficient=0.0, scale=scale, yaw=yaw)


def product(noise=PRODUCT, gate=13.8, learns=False) -> VesselFilter:
    """The nine-state filter, or with a wave the one of thirteen."""
    return VesselFilter(INERTIA, DAMPING, noise, gate, VariationalNoise() if learns else None)


def stepping_oracle() -> VesselFilter:
    """The nine-state filter that knows when the noise of fixes steps up."""
    return VesselFilter(INERTIA, DAMPING, replace(PRODUCT, position_std=scenario.QUIET), 13.8, _KnownStep())


def speed_aware(noise) -> VesselFilter:
    """A filter whose R grows with the estimated speed, as the noise of fixes does where it grows."""
    return time_varying(noise, SpeedDependentFixNoise(scenario.FIX_STD, scenario.DOUBLING))


def observer(gains=TUNED_GAINS, correction="impulsive", check=True) -> PassiveObserver:
    """The passive observer; its warnings are what the study itself is about."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return PassiveObserver(INERTIA, DAMPING, gains, correction, check=check)


def stock_observer() -> PassiveObserver:
    """The public simulator's gains on held measurements."""
    return observer(DEMO_GAINS, "held")


class _KnownStep:
    """A `FixNoise` that knows when the noise steps up."""

    def start(self, variances):
        self._seen = 0

    def expected(self, x):
        std = scenario.LOUD if self._seen + 1 >= scenario.LOUD_FROM else scenario.QUIET
        return std**2, std**2

    def learned(self, x, p, north, east):
        variances = self.expected(x)
        self._seen += 1
        return variances


def bound(record, noise=PRODUCT) -> tuple[float, float]:
    """The least mean |error| (m) an unbiased estimator can have on a record, over all times and at fixes.

    The Cramér–Rao bound of P. Tichavský, C. Muravchik and A. Nehorai (1998), Posterior Cramér–Rao bounds for
    discrete-time nonlinear filtering, IEEE Transactions on Signal Processing 46(5): the filter's covariance along the
    true states, with no process noise but the sea's. A Gaussian error of 1σ s has a mean |error| of s √(2/π).
    """
    known = product(replace(noise, acceleration=(0.0, 0.0, 0.0)), math.inf)
    variances = np.full((scenario.ROWS, 2), BASE.start_std[0] ** 2)
    for k in range(1, scenario.ROWS):
        known.state[:6], known.state[6:9] = record.states[k - 1], record.pushes[k - 1]
        known.predict(record.forces[k - 1], scenario.STEP)
        known.update_heading(known.state[2])
        if k % scenario.PER_FIX == 0:
            known.update(*known.state[:2])
        variances[k] = known.covariance_upper.diagonal()[:2]
    mean_error = math.sqrt(2.0 / math.pi) * np.sqrt(variances)
    return float(mean_error.mean()), float(mean_error[scenario.PER_FIX :: scenario.PER_FIX].mean())
