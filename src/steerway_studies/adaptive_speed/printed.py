"""What the paper's own design does: steady states, its controller as printed and as published, its filter."""

import math
from dataclasses import dataclass

import numpy as np

from steerway.vessels import CALM, Surge
from steerway_studies.adaptive_speed import sailing
from steerway_studies.adaptive_speed.sailing import ACCELEROMETER, GPS, LEAK, LOG
from steerway_studies.papers.speed_ekf import SENSOR_STDS, PrintedSpeedEkf
from steerway_studies.papers.speed_mrac import PrintedMrac

FINE, COARSE = 0.001, 0.1


@dataclass(frozen=True)
class PrintedRun:
    """A voyage without sensors: arrays (n,)."""

    time: np.ndarray
    speed: np.ndarray
    shaft: np.ndarray
    model: np.ndarray
    parameters: np.ndarray


def sail_true(boat, control, setpoint, duration=200.0, step=FINE, control_step=FINE) -> PrintedRun:
    """Control sees the true speed."""
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
    """(3,) â of a controller that adapts, NaN of another."""
    return getattr(control, "parameters", (math.nan,) * 3)


def steady_shaft(setpoint) -> float:
    """rev/s that hold a speed on plant T."""
    from scipy.optimize import brentq

    boat = sailing.plant("T")
    return brentq(lambda shaft: boat.acceleration(setpoint, shaft), 1.0, 30.0)


def top_speed() -> float:
    """m/s of plant T at 17.5 rev/s."""
    from scipy.optimize import brentq

    boat = sailing.plant("T")
    return brentq(lambda speed: boat.acceleration(speed, 17.5), 1.0, 30.0)


def as_printed(setpoint) -> PrintedRun:
    """(14)–(18) with γ = 0.5 on plant T at 1 kHz."""
    return sail_true(sailing.plant("T"), PrintedMrac(), setpoint)


def as_published(setpoint) -> PrintedRun:
    """The surrogate of the published curves, parameters held."""
    return sail_true(sailing.plant("P"), PrintedMrac(adaptation=0.0), setpoint, step=0.01, control_step=0.01)


def at_ten_hertz(setpoint, adapt_first) -> PrintedRun:
    """The printed law at 10 Hz, no limit on n: what the order of output and adaptation decides."""
    boat = Surge(shaft=sailing.shaft(high=1e9))
    return sail_true(boat, PrintedMrac(adapt_first=adapt_first), setpoint, step=0.01, control_step=COARSE)


def with_lag(setpoint) -> PrintedRun:
    """The printed law at 1 kHz on a shaft with 1 s lag."""
    return sail_true(Surge(shaft=sailing.shaft(lag=1.0)), PrintedMrac(), setpoint)


def with_wrong_sign(setpoint) -> PrintedRun:
    """(18) with sgn(g) the wrong way round, n limited."""
    return sail_true(sailing.plant("T"), PrintedMrac(sign=-1.0, high=17.5), setpoint)


def filtered(track: PrintedRun, seed: int, imu: str | None = "literal", printed_sign=False):
    """(time, truth, estimate, gps, dvl) at 200 Hz of the printed filter on a track at 1 kHz.

    `imu`: "literal" a white speed sensor of 5 µg; "integrated" what a speed made from a real accelerometer is; None.
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
    """Largest error after 10 s, % of the set-point, of the printed filter in four readings."""
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
    """As the paper's figures were read: s to stay within 2 % of the value at 200 s."""
    return sailing.settling(track.time, track.speed, float(track.speed[-1]))
