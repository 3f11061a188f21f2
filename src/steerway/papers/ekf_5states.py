"""P0 Appendix A exactly as printed, over a whole record. Labelled: nothing is folded or wrapped, the process noise is
h² Q_d and so changes with the rate, and the "LL" state is in radians. The product is `steerway.FiveStateFilter`.
"""

import numpy as np

from steerway.earth import radii
from steerway.errors import InputError


def ekf_5states(pos1, pos2, h, z, frame, q_d, r_d, alpha_1=0.01, alpha_2=0.1, x_init=None, return_covariance=False):
    """The five-state EKF of P0 Table 1 as Appendix A runs it: corrected state at every z-th row, the prior between.

    Args:
        pos1, pos2: (n,) north and east in m ("NED") or latitude and longitude in rad ("LL"), one row a step; rows
            0, z, 2z, … are used.
        h: sampling time, s.
        z: steps from one measurement to the next.
        frame: "NED" or "LL".
        q_d: (2, 2) covariance of the speed and course-rate noise, or its diagonal.
        r_d: (2, 2) covariance of the measurement, or its diagonal.
        alpha_1, alpha_2: Singer constants of (13) and (15), 1/s.
        x_init: (5,) first prior; [pos1[0], pos2[0], 0, 0, 0] if None.

    Returns:
        (n, 5) array of [x y U χ ω], and with `return_covariance` also (n, 5, 5). Raises InputError for another frame.
    """
    if frame not in ("NED", "LL"):
        raise InputError(f"frame is {frame!r}, expected 'NED' or 'LL'")
    pos1, pos2 = np.asarray(pos1, float), np.asarray(pos2, float)
    q_d, r_d = (m if m.ndim == 2 else np.diag(m) for m in (np.asarray(q_d, float), np.asarray(r_d, float)))
    identity = np.eye(5)
    c_d = identity[:2]
    e_d = h * identity[:, [2, 4]]
    process_noise = e_d @ q_d @ e_d.T
    model = _north_east if frame == "NED" else _latitude_longitude

    x = np.array([pos1[0], pos2[0], 0.0, 0.0, 0.0]) if x_init is None else np.array(x_init, float)
    p = identity
    states = np.empty((len(pos1), 5))
    covariances = np.empty((len(pos1), 5, 5))
    for k in range(len(pos1)):
        if k % z == 0:
            gain = p @ c_d.T @ np.linalg.inv(c_d @ p @ c_d.T + r_d)
            innovation = np.array([pos1[k] - x[0], pos2[k] - x[1]])
            if frame == "LL":
                innovation = _ssa(innovation)
            kept = identity - gain @ c_d
            x = x + gain @ innovation
            p = kept @ p @ kept.T + gain @ r_d @ gain.T
        states[k], covariances[k] = x, p
        rate, jacobian = model(x, alpha_1, alpha_2)
        a_d = identity + h * jacobian
        x = x + h * rate
        p = a_d @ p @ a_d.T + process_noise
    return (states, covariances) if return_covariance else states


def _ssa(angle):
    """The mapping under (54), whose rounding to 4e-16 rad the published results contain; `angles.wrap` has none."""
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
    """Right-hand side and Jacobian of (35)–(36), (13)–(15); the radii at the current latitude, as Appendix A has it."""
    meridian, prime_vertical = radii(x[0])
    parallel = prime_vertical * np.cos(x[0])
    rate, jacobian = _north_east(x, alpha_1, alpha_2)
    rate[:2] /= meridian, parallel
    jacobian[0] /= meridian
    jacobian[1] /= parallel
    jacobian[1, 0] = np.tan(x[0]) * rate[1]
    return rate, jacobian
