"""The paper's own design: steady states, its controller as printed and as published, and its filter. Two of the paper's
arguments are tested: the Lyapunov function of (17)–(21), and that the boat goes straight."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from steerway.vessels import CALM, Caldas, Surge, runge_kutta
from steerway.vessels import propeller_thrust as thrust
from steerway_studies.adaptive_speed import sailing
from steerway_studies.adaptive_speed.sailing import ACCELEROMETER, GPS, LEAK, LOG
from steerway_studies.papers.speed import PRINTED_GUESS, SENSOR_STDS, PrintedMrac, PrintedSpeedEkf

FINE, COARSE = 0.001, 0.1


@dataclass(frozen=True)
class PrintedRun:
    """A run without sensors: time, speed, shaft speed and reference speed (n,), adapted parameters (n, 3)."""

    time: np.ndarray
    speed: np.ndarray
    shaft: np.ndarray
    model: np.ndarray
    parameters: np.ndarray


def sail_true(boat, control, setpoint, duration=200.0, step=FINE, control_step=FINE) -> PrintedRun:
    """Simulate a boat whose controller is given the true speed."""
    n = round(duration / step)
    every = round(control_step / step)
    out = np.zeros((3, n + 1))
    parameters = np.tile(_parameters(control), (n + 1, 1))
    state, command = boat.start(), 0.0
    for k in range(n):
        if k % every == 0:
            command = control.step(setpoint, state[3], control_step, state[4])
        state = boat.step(state, (command,), CALM, step)
        out[:, k + 1] = state[3], state[4], getattr(control, "model", math.nan)
        parameters[k + 1] = _parameters(control)
    return PrintedRun(step * np.arange(n + 1), *out, parameters)


def _parameters(control):
    """(3,) adapted parameters â; NaN for a controller without adaptation."""
    return getattr(control, "parameters", (math.nan,) * 3)


def steady_shaft(setpoint) -> float:
    """Shaft speed (rev/s) that holds a speed (m/s) on plant T."""
    boat = sailing.plant("T")
    return brentq(lambda shaft: boat.acceleration(setpoint, shaft), 1.0, 30.0)


def top_speed() -> float:
    """Steady speed (m/s) of plant T at 17.5 rev/s."""
    boat = sailing.plant("T")
    return brentq(lambda speed: boat.acceleration(speed, 17.5), 1.0, 30.0)


def as_printed(setpoint) -> PrintedRun:
    """(14)–(18) with γ = 0.5 on plant T at 1 kHz."""
    return sail_true(sailing.plant("T"), PrintedMrac(), setpoint)


def as_published(setpoint) -> PrintedRun:
    """The printed controller without adaptation, on the surrogate of the published curves."""
    return sail_true(sailing.plant("P"), PrintedMrac(adaptation=0.0), setpoint, step=0.01, control_step=0.01)


def at_ten_hertz(setpoint, adapt_first) -> PrintedRun:
    """The printed law at 10 Hz without a limit of n, to compare the two orders of output and adaptation."""
    boat = Surge(shaft=sailing.shaft(high=1e9))
    return sail_true(boat, PrintedMrac(adapt_first=adapt_first), setpoint, step=0.01, control_step=COARSE)


def with_lag(setpoint) -> PrintedRun:
    """The printed law at 1 kHz on a shaft with 1 s lag."""
    return sail_true(Surge(shaft=sailing.shaft(lag=1.0)), PrintedMrac(), setpoint)


def with_wrong_sign(setpoint) -> PrintedRun:
    """(18) with the wrong sgn(g), n limited."""
    return sail_true(sailing.plant("T"), PrintedMrac(sign=-1.0, high=17.5), setpoint)


def filtered(track: PrintedRun, seed: int, imu: str | None = "literal", printed_sign=False):
    """(time, truth, estimate, gps, dvl) of the printed filter at 200 Hz; gps and dvl at 10 Hz. `track` is at 1 kHz.

    `imu`: "literal", a white speed sensor of 5 µg; "integrated", a speed integrated from a real accelerometer; or None.
    """
    every = 5
    time, truth, shaft = track.time[::every], track.speed[::every], track.shaft[::every]
    step = float(time[1])
    draws = np.random.default_rng(seed).spawn(5)
    feels = np.gradient(truth, step) + ACCELEROMETER.measured(time, 0.0, draws[0])[1]
    feels += LEAK.measured(time, 0.0, draws[1])[1]
    integrated = np.concatenate(([0.0], np.cumsum(feels[1:] * step)))
    literal = truth + SENSOR_STDS[2] * draws[4].standard_normal(len(time))
    inertial = {"literal": literal, "integrated": integrated, None: truth}[imu].tolist()
    gps = truth[::20] + GPS.measured(time, 0.0, draws[2])[1]
    dvl = truth[::20] + LOG.measured(time, 0.0, draws[3])[1]
    ekf = PrintedSpeedEkf(printed=printed_sign)
    out = np.zeros(len(time))
    turns = shaft.tolist()
    for k in range(1, len(time)):
        ekf.predict(turns[k], step)
        if imu:
            ekf.update(inertial[k], SENSOR_STDS[2])
        if k % 20 == 0:
            ekf.update(float(gps[k // 20]), SENSOR_STDS[0])
            ekf.update(float(dvl[k // 20]), SENSOR_STDS[1])
        out[k] = ekf.speed
    return time, truth, out, gps, dvl


def filter_errors(job) -> dict[str, float]:
    """Largest error after 10 s of four variants of the printed filter, % of the set-point."""
    track = sail_true(sailing.plant("T"), PrintedMrac(), job.setpoint, 100.0)
    found = {}
    readings = {
        "literal": {"imu": "literal"},
        "integrated": {"imu": "integrated"},
        "gps_dvl": {"imu": None},
        "printed_sign": {"imu": None, "printed_sign": True},
    }
    for name, how in readings.items():
        time, truth, estimate, _, _ = filtered(track, job.seed, **how)
        error = np.abs(estimate - truth)[time > sailing.TRANSIENT]
        found[name] = 100.0 * float(min(error.max(), 1e6)) / job.setpoint
    return found


def settling_about_final(track: PrintedRun) -> float:
    """Time (s) until the speed stays within 2 % of its value at 200 s, as it was read from the paper's figures."""
    return sailing.settling(track.time, track.speed, float(track.speed[-1]))


RATE, GAMMA = 0.1, 0.5
_STEP = 0.005


@dataclass(frozen=True)
class Descent:
    """V of (19) along a run, its derivative, and the −d_m z² that (21) claims; arrays (n,)."""

    time: np.ndarray
    value: np.ndarray
    derivative: np.ndarray
    claimed: np.ndarray


def descent(setpoint: float, constant: bool, duration: float = 60.0) -> Descent:
    """The closed loop (13)–(18) in continuous time, with constant g or the propeller's g(u, n)."""
    d, b = sailing.NOMINAL.linear_drag, sailing.NOMINAL.quadratic_drag
    curve = sailing.NOMINAL.curve()
    d0, b0, g0 = PRINTED_GUESS

    def square(x):
        u = x[0]
        return max(0.0, x[2] * setpoint + x[3] * u + x[4] * u * abs(u))

    def thrust_gain(x):
        if constant:
            return g0
        shaft = math.sqrt(square(x))
        return thrust(x[0], shaft, curve) / square(x) if shaft > 0.0 else g0

    def rates(x):
        u, model = x[0], x[1]
        z = u - model
        drive = thrust_gain(x) * square(x)
        return np.array(
            [
                -d * u - b * u * abs(u) + drive,
                RATE * (setpoint - model),
                -GAMMA * z * setpoint,
                -GAMMA * z * u,
                -GAMMA * z * u * abs(u),
            ]
        )

    def lyapunov(x):
        g = thrust_gain(x)
        ideal = np.array([RATE, d - RATE, b]) / g
        wrong = x[2:] - ideal
        return 0.5 * (x[0] - x[1]) ** 2 + 0.5 * g / GAMMA * float(wrong @ wrong)

    n = round(duration / _STEP)
    x = np.array([0.0, 0.0, RATE / g0, (d0 - RATE) / g0, b0 / g0])
    values, claimed = np.empty(n), np.empty(n)
    for k in range(n):
        values[k], claimed[k] = lyapunov(x), -RATE * (x[0] - x[1]) ** 2
        x = runge_kutta(rates, x, _STEP)
    return Descent(_STEP * np.arange(n), values, np.gradient(values, _STEP), claimed)


def straight_run(speed: float):
    """(boat, state) of the three-degree-of-freedom boat going straight at a speed."""
    boat = sailing.plant("T")
    state = Caldas().start(speed=speed)
    state[6] = brentq(lambda shaft: boat.acceleration(speed, shaft), 1.0, 30.0)
    return Caldas(), state


def lateral_matrix(speed: float, stiffness: float = 0.0) -> np.ndarray:
    """(3, 3) of heading, sway and yaw rate about a straight run, with a yaw moment −stiffness · heading (N·m/rad)."""
    boat, state = straight_run(speed)
    places, h = (2, 4, 5), 1e-6
    columns = []
    for place in places:
        sides = []
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[place] += sign * h
            sides.append(boat.rates(moved, -stiffness * moved[2], CALM)[list(places)])
        columns.append((sides[0] - sides[1]) / (2.0 * h))
    return np.stack(columns, axis=1)


def growth(speed: float, stiffness: float = 0.0) -> float:
    """The largest real part (1/s) of the lateral eigenvalues."""
    return float(np.linalg.eigvals(lateral_matrix(speed, stiffness)).real.max())


def least_stiffness(speed: float) -> float:
    """The heading gain (N·m/rad) above which no lateral eigenvalue grows, by bisection."""
    low, high = 0.0, 50e3 * speed**2
    while high - low > 1e-4 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if growth(speed, middle) > 1e-3 * speed else (low, middle)
    return high


def numbers(as_printed, as_published) -> dict[str, float]:
    """Steady states of the printed boat, the published curves and the printed controller."""
    n = {f"steady_rps_{speed}": steady_shaft(speed) for speed in sailing.SPEEDS} | {"top_speed_mps": top_speed()}
    for speed, track in as_published.items():
        n[f"published_settling_final_s_{speed}"] = settling_about_final(track)
        n[f"published_settling_s_{speed}"] = sailing.settling(track.time, track.speed, speed)
        n[f"published_overshoot_pct_{speed}"] = sailing.overshoot_pct(track.speed, speed)
    for speed, track in as_printed.items():
        found = sailing.response(track.time, track.speed, track.shaft, speed)
        n |= {f"printed_mrac_{key}_{speed}": found[key] for key in ("settling_s", "overshoot_pct", "tail_pct")}
    for speed in (6, 9):
        for adapt_first, name in ((False, "output_first"), (True, "adapt_first")):
            over = sailing.overshoot_pct(at_ten_hertz(speed, adapt_first).speed, speed)
            n[f"printed_mrac_10hz_{name}_overshoot_pct_{speed}"] = over
    n["printed_mrac_lag_overshoot_pct_3"] = sailing.overshoot_pct(with_lag(3).speed, 3)
    track = with_wrong_sign(3)
    n["printed_mrac_wrong_sign_tail_pct_3"] = sailing.tail_pct(track.time, track.speed, 3)
    return n


def theory_numbers() -> dict[str, float]:
    """Numbers of the paper's Lyapunov function along the loop, and of the boat's directional stability."""
    inner = slice(2, -2)
    held, free = descent(3.0, constant=True), descent(3.0, constant=False)
    off = np.abs(held.derivative - held.claimed)[inner].max() / np.abs(held.claimed).max()
    rise = np.maximum(np.diff(free.value), 0.0).sum() / free.value[0]
    n = {"lyapunov_constant_g_error": float(off), "lyapunov_varying_g_rise": float(rise)}
    for speed in sailing.SPEEDS:
        n[f"eigenvalue_{speed}"] = growth(speed) / speed
        n[f"heading_gain_{speed}"] = least_stiffness(speed) / speed**2 / 1e3
    return n
