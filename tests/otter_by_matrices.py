"""The Otter once more, in the matrix form of Fossen's Handbook (2021): what the kernels must equal.

Written for clarity only, from the mass matrix and the particulars; shares neither the vector equations nor the packed
array with `steerway.vessels.otter`.
"""

import numpy as np

from steerway.vessels.testing import otter_hull as ship


def skew(a):
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def moved(r):
    """H(r), (C.7)."""
    h = np.eye(6)
    h[:3, 3:] = skew(r).T
    return h


def rotation(phi, theta, psi):
    def about(axis, angle):
        k = skew(np.eye(3)[axis])
        return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k

    return about(2, psi) @ about(1, theta) @ about(0, phi)


def euler_rates(phi, theta):
    t, s, c = np.tan(theta), np.sin(phi), np.cos(phi)
    return np.array([[1.0, s * t, c * t], [0.0, c, -s], [0.0, s / np.cos(theta), c / np.cos(theta)]])


def derivatives(x, n, mp, rp, current_speed, current_direction, edition):
    x, rp = np.asarray(x), np.asarray(rp, dtype=float)
    old = edition == "2021"
    m = ship.MASS
    total = m + mp
    rg = (m * ship.CENTRE_OF_GRAVITY + mp * rp) / total
    arms = (rg, rp) if old else (ship.CENTRE_OF_GRAVITY - rg, rp - rg)
    ig = m * np.diag(ship.GYRATION**2) - m * skew(arms[0]) @ skew(arms[0]) - mp * skew(arms[1]) @ skew(arms[1])
    rigid = np.zeros((6, 6))
    rigid[:3, :3], rigid[3:, 3:] = total * np.eye(3), ig
    surge = 2.7 * 1025.0 * (m / 1025.0) ** (5 / 3) / ship.LENGTH**2
    added = np.diag([surge, 1.5 * m, m, 0.2 * ig[0, 0], 0.8 * ig[1, 1], 1.7 * ig[2, 2]])
    h = moved(rg)
    mass = h.T @ rigid @ h + added

    nu, omega, psi = x[:6], x[3:6], x[11]
    nu_c = np.zeros(6)
    nu_c[:2] = current_speed * np.cos(current_direction - psi), current_speed * np.sin(current_direction - psi)
    nu_r = nu - nu_c
    c_rigid = np.zeros((6, 6))
    c_rigid[:3, :3], c_rigid[3:, 3:] = total * skew(omega), -skew(ig @ omega)
    c_rigid = h.T @ c_rigid @ h
    linear, angular = added[:3, :3] @ nu_r[:3], added[3:, 3:] @ nu_r[3:]
    c_added = np.zeros((6, 6))
    c_added[:3, 3:], c_added[3:, :3], c_added[3:, 3:] = -skew(linear), -skew(linear), -skew(angular)
    if old:
        c_added[5, :2] = 0.0

    volume = total / 1025.0
    draught = volume / (2 * 0.4 * 0.25 * 2.0)
    area = 0.75 * 2.0 * 0.25
    i_t = 2 / 12 * 2.0 * 0.25**3 * (6 * 0.75**3 / (1.75 * 2.5)) + 2 * area * 0.395**2
    i_l = 0.8 * 2 / 12 * 0.25 * 2.0**3
    kb = (2.5 * draught - 0.5 * volume / 0.5) / 3
    gm = kb + np.array([i_t, i_l]) / volume - (draught - rg[2])
    weight = 1025.0 * 9.81
    g_cf = np.diag([0, 0, weight * 2 * area, *(weight * volume * gm), 0])
    g = moved([-0.2, 0, 0]).T @ g_cf @ moved([-0.2, 0, 0])

    w = np.sqrt(np.diag(g_cf)[2:5] / np.diag(mass)[2:5])
    damping = np.zeros(6)
    damping[0] = 24.4 * 9.81 / (6 * 0.5144)
    damping[1] = 0.0 if old else mass[1, 1]
    damping[2:5] = 2 * np.array([0.3, 0.2, 0.4]) * w * np.diag(mass)[2:5]
    damping[5] = mass[5, 5] * (1 + 10 * abs(nu_r[5]))

    drag = 0.5 * (1026.0 if old else 1025.0) * draught * 0.1 * ship._drag_coefficient(draught)
    crossflow = np.zeros(6)
    for station in np.linspace(-1.0, 1.0, 21):
        side, down = nu_r[1] + station * nu_r[5], nu_r[2] + station * nu_r[4]
        crossflow[[1, 5]] -= drag * side * abs(side) * np.array([1.0, station])
        if not old:
            crossflow[[2, 4]] -= drag * down * abs(down) * np.array([1.0, station])

    n = np.clip(n, ship.PROPELLER_MIN, ship.PROPELLER_MAX)
    thrust = np.where(n > 0, 0.02216 / 2, 0.01289 / 2) * n * abs(n)
    tau = np.array([thrust.sum(), 0, 0, 0, 0, 0.395 * (thrust[0] - thrust[1])])

    eta, extra, nu_c_dot = x[6:].copy(), np.zeros(6), np.zeros(6)
    if old:
        extra[4] = -280.0
    else:
        force = rotation(*x[9:12]).T @ [0.0, 0.0, mp * 9.81]
        load = np.concatenate([force, skew(rp) @ force])
        eta[2:5] -= np.linalg.solve(g[2:5, 2:5], load[2:5])
        nu_c_dot[:3] = -skew(omega) @ nu_c[:3]
    forces = tau - damping * nu_r + crossflow - (c_rigid + c_added) @ nu_r - g @ eta + extra
    return np.concatenate(
        [nu_c_dot + np.linalg.solve(mass, forces), rotation(*eta[3:]) @ nu[:3], euler_rates(*eta[3:5]) @ omega]
    )
