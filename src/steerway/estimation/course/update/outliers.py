"""One likelihood for fixes and aids, by which outliers are refused and models are compared.

A measurement is accepted within the gate of at least one mode, or where it is more probable than an outlier. Negative
log likelihoods (nll) are natural logarithms of densities in SI units, all constants included.
"""

import math

from steerway.core.compiled import lean_kernel
from steerway.estimation.course.motion.layout import GATE, OUTLIER_NLL

OSCILLATION_OUTLIER_NLL = 10.0
"""−log density of an outlier, 1/m²: one fix in a thousand, within three metres. Where wave-induced yaw is modelled the
gate is centimetres wide, and accepting what is more probable than this keeps good fixes in irregular waves."""
AID_OUTLIER_NLL = 10.0
"""−log density of an outlier: one measurement in ten thousand, anywhere between −1 and 1 (SI)."""

LOG_2PI = math.log(2.0 * math.pi)


@lean_kernel
def fix_nll(nis, determinant):
    """−log density of a fix, by its NIS and the determinant of the covariance of its innovation."""
    return 0.5 * (nis + math.log(determinant)) + LOG_2PI


@lean_kernel
def aid_nll(nis, variance):
    """−log density of a scalar measurement."""
    return 0.5 * (nis + math.log(variance) + LOG_2PI)


@lean_kernel
def fix_is_accepted(least_nis, nll, parameters):
    """Whether a fix is within the gate, or else more probable than an outlier."""
    return least_nis <= parameters[GATE] or nll <= parameters[OUTLIER_NLL]
