"""The base of all other packages: records, angles, the earth, noise, checks, compilation."""

from typing import TYPE_CHECKING

from steerway.core.on_demand import on_demand

if TYPE_CHECKING:
    from steerway.core.angles import wrap, wrap_array
    from steerway.core.compiled import kernel
    from steerway.core.earth import ECCENTRICITY_SQUARED, SEMI_MAJOR_AXIS, displacement, radii
    from steerway.core.errors import InputError
    from steerway.core.estimate import NO_MEASUREMENTS, Estimate, Estimator, Measurements
    from steerway.core.files import complete_or_absent, made_directory
    from steerway.core.leg import LegState, leg_direction, track_errors
    from steerway.core.linear_algebra import fill_lower
    from steerway.core.noise import markov_decay, markov_std, markov_step, oscillator, oscillator_step
    from steerway.core.records import OK, REJECTED, Fixes, Motion
    from steerway.core.statistics import NORMAL_95, rms

__all__ = [
    "ECCENTRICITY_SQUARED",
    "NORMAL_95",
    "NO_MEASUREMENTS",
    "OK",
    "REJECTED",
    "SEMI_MAJOR_AXIS",
    "Estimate",
    "Estimator",
    "Fixes",
    "InputError",
    "LegState",
    "Measurements",
    "Motion",
    "complete_or_absent",
    "displacement",
    "fill_lower",
    "kernel",
    "leg_direction",
    "made_directory",
    "markov_decay",
    "markov_std",
    "markov_step",
    "oscillator",
    "oscillator_step",
    "radii",
    "rms",
    "track_errors",
    "wrap",
    "wrap_array",
]
__getattr__, __dir__ = on_demand(__name__)
