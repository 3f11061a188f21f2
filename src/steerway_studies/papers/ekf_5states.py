"""P0 Appendix A exactly as printed, over a whole record. Speed may become negative and course is not wrapped. The
process noise is h² Q_d, which depends on the rate. The "LL" state is in radians. Elsewhere use `FiveStateFilter`.
"""

import math

import numpy as np

from steerway.core import Estimate, InputError, Measurements, radii, wrap


def ekf_5states(pos1, pos2, h, z, frame, q_d, r_d, alpha_1=0.01, alpha_2=0.1, x_init=None, return_covariance=False):
    """The five-state EKF of P0 Table 1 as in Appendix A: corrected state at every z-th row, the prior at the others.

    Args:
        pos1, pos2: (n,) north and east in m ("NED") or latitude and longitude in rad ("LL"), one row a step; the finite
            ones of rows 0, z, 2z, … are used.
        h: sampling time, s.
        z: steps from one measurement to the next; None uses every finite row.
        frame: "NED" or "LL".
        q_d: (2, 2) covariance of the speed and course-rate noise, or its diagonal.
        r_d: (2, 2) covariance of the measurement, or its diagonal.
        alpha_1, alpha_2: Singer constants of (13) and (15), 1/s.
        x_init: (5,) first prior; [pos1[0], pos2[0], 0, 0, 0] if None.

    Returns:
        (n, 5) array of [x y U χ ω], and with `return_covariance` also (n, 5, 5). Raises InputError for another frame.
    """
    pos1, pos2 = np.asarray(pos1, float), np.asarray(pos2, float)
    ekf = Ekf5States(h, z, frame, q_d, r_d, alpha_1, alpha_2, x_init)
    states = np.empty((len(pos1), 5))
    covariances = np.empty((len(pos1), 5, 5))
    for k in range(len(pos1)):
        states[k] = ekf.step(pos1[k], pos2[k])
        covariances[k] = ekf.covariance
    return (states, covariances) if return_covariance else states


class Ekf5States:
    """`ekf_5states` step by step, for a loop: a step is one call of Appendix A's function. Same parameters."""

    def __init__(self, h, z, frame, q_d, r_d, alpha_1=0.01, alpha_2=0.1, x_init=None):
        if frame not in ("NED", "LL"):
            raise InputError(f"frame is {frame!r}, expected 'NED' or 'LL'")
        self._h, self._z, self._frame = h, z, frame
        self._alphas = (alpha_1, alpha_2)
        self._model = _north_east if frame == "NED" else _latitude_longitude
        q_d, self._r_d = (m if m.ndim == 2 else np.diag(m) for m in (np.asarray(q_d, float), np.asarray(r_d, float)))
        self._identity = np.eye(5)
        self._c_d = self._identity[:2]
        e_d = h * self._identity[:, [2, 4]]
        self._process_noise = e_d @ q_d @ e_d.T
        self._prior = None if x_init is None else np.array(x_init, float)
        self._prior_covariance = self._identity
        self._count = 0
        self.covariance = self._identity

    def step(self, pos1=np.nan, pos2=np.nan) -> np.ndarray:
        """(5,) corrected state if a position is used, else the prior; `covariance` is its (5, 5)."""
        x, p = self._prior, self._prior_covariance
        is_known = pos1 == pos1 and pos2 == pos2
        if x is None and not is_known:
            return np.full(5, np.nan)
        if x is None:
            x = np.array([pos1, pos2, 0.0, 0.0, 0.0])
        if is_known and (not self._z or self._count % self._z == 0):
            x, p = self._corrected(x, p, np.array([pos1, pos2]))
        self._count += 1
        rate, jacobian = self._model(x, *self._alphas)
        a_d = self._identity + self._h * jacobian
        self._prior = x + self._h * rate
        self._prior_covariance = a_d @ p @ a_d.T + self._process_noise
        self.covariance = p
        return x

    def _corrected(self, x, p, measured):
        c_d, r_d = self._c_d, self._r_d
        gain = p @ c_d.T @ np.linalg.inv(c_d @ p @ c_d.T + r_d)
        innovation = measured - x[:2]
        if self._frame == "LL":
            innovation = _ssa(innovation)
        kept = self._identity - gain @ c_d
        return x + gain @ innovation, kept @ p @ kept.T + gain @ r_d @ gain.T


def _ssa(angle):
    """The mapping under (54). It rounds to 4e-16 rad, as the published results do; `angles.wrap` does not round."""
    return np.mod(angle + np.pi, 2.0 * np.pi) - np.pi


def _north_east(x, alpha_1, alpha_2):
    """Right-hand side and Jacobian of (11)–(15)."""
    _, _, u, chi, omega = x
    cos, sin = np.cos(chi), np.sin(chi)
    rate = np.array([u * cos, u * sin, -alpha_1 * u, omega, -alpha_2 * omega])
    jacobian = np.zeros((5, 5))
    jacobian[0, 2:4] = cos, -u * sin
    jacobian[1, 2:4] = sin, u * cos
    jacobian[2, 2], jacobian[3, 4], jacobian[4, 4] = -alpha_1, 1.0, -alpha_2
    return rate, jacobian


def _latitude_longitude(x, alpha_1, alpha_2):
    """Right-hand side and Jacobian of (35)–(36), (13)–(15); radii at the present latitude, as in Appendix A."""
    meridian, prime_vertical = radii(x[0])
    parallel = prime_vertical * np.cos(x[0])
    rate, jacobian = _north_east(x, alpha_1, alpha_2)
    rate[:2] /= meridian, parallel
    jacobian[0] /= meridian
    jacobian[1] /= parallel
    jacobian[1, 0] = np.tan(x[0]) * rate[1]
    return rate, jacobian


_UNSAID = (math.nan,) * 6


class PrintedEstimator:
    """P0 Appendix A in the loop, a filter step for each step of the loop. Its course is used however inaccurate."""

    def __init__(self, ekf: Ekf5States):
        self.ekf = ekf

    def step(self, readings: Measurements, dt: float) -> Estimate:
        """The filter's state. `dt` has to equal the filter's h. The speed may be negative, as in the paper."""
        north, east, speed, course, rate = self.ekf.step(readings.north, readings.east).tolist()
        return Estimate(north, east, speed, wrap(course), rate, *_UNSAID)
