"""The boats of the study, a run along a straight line, and the numbers by which response and estimate are judged.

In a run the boat and its accelerometer have 200 Hz, GPS and log 10 Hz, control 20 Hz. Every filter is given the same
surge model, NOMINAL.
"""

import math
from dataclasses import dataclass

import numpy as np

from steerway.control import AdaptiveSpeed, AdaptiveSpeedGains
from steerway.core import NORMAL_95, rms
from steerway.estimation.speed import SurgeFusion, SurgeTuning
from steerway.identification import SurgeModel
from steerway.sensors import Instrument, accelerometer
from steerway.simulation import settling as settled_after
from steerway.vessels import (
    CALDAS_LINEAR_DRAG,
    CALDAS_MASS,
    CALDAS_QUADRATIC_DRAG,
    CALM,
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
"""The surge model of plant T: the third source when GPS and log contradict each other."""


def shaft(lag=0.0, rate=math.inf, high=17.5) -> Actuator:
    """A shaft with a lag (s), a largest rate (rev/s²) and a largest speed (rev/s)."""
    return Actuator("shaft speed", 0.0, high, rate, lag)


def plant(name: str) -> Surge:
    """Plant "T" as printed, "a" to "c" of the study, or "P", the surrogate of the published curves."""
    if name in ("c", "P"):
        return published_surrogate()
    return Surge(shaft={"T": SHAFT, "a": shaft(lag=0.5), "b": shaft(rate=1.75)}[name])


def controller(name: str) -> AdaptiveSpeed:
    """MRAC+ for a plant: the same gains for all, and an inner loop for the slow shaft of P."""
    return AdaptiveSpeed(AdaptiveSpeedGains(shaft_lag=SURROGATE_LAG if name in ("c", "P") else 0.0))


def random_plant(seed: int) -> Surge:
    """A random boat: mass ±20 %, each damping ±40 %, thrust ±20 %, shaft lag 0–1.5 s, rate 1–3 rev/s²."""
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


STEP = 0.005
_AID, _CONTROL = 20, 10  # steps between two readings, and between two orders; GPS and log alternate
ACCELEROMETER = accelerometer(rate=200.0)
LEAK = Instrument(rate=200.0, wander=(0.0034, 5.0))
GPS = Instrument(rate=10.0, white=0.03)
LOG = Instrument(rate=10.0, white=0.002)
_UNKNOWN = (math.nan,) * 3
TABLE_III = SurgeTuning(scale_std=0.0)
"""Tuning of the filter for P3's instruments; their log has no scale error."""


@dataclass(frozen=True)
class SpeedRun:
    """A run: arrays (n,) at every step, events of the filter, and the NIS of the readings of GPS and log."""

    time: np.ndarray
    setpoint: np.ndarray
    speed: np.ndarray
    estimate: np.ndarray
    std: np.ndarray
    current: np.ndarray
    shaft: np.ndarray
    model: np.ndarray
    parameters: np.ndarray  # (n, 3)
    nis: np.ndarray
    events: list
    gps: np.ndarray  # readings, NaN between
    log: np.ndarray


def _bias(kind, time, since):
    """Errors that a fault adds to the readings of (accelerometer, GPS, log) at a time, m/s² and m/s."""
    if kind is None or time <= since:
        return 0.0, 0.0, 0.0
    return {
        "log step": (0.0, 0.0, 0.1),
        "log ramp": (0.0, 0.0, 0.005 * (time - since)),
        "gps step": (0.0, 0.3, 0.0),
        "accelerometer step": (0.1, 0.0, 0.0),
    }[kind]


def _at(schedule, time):
    """The value of a ((from, value), …) at a time."""
    value = schedule[0][1]
    for since, each in schedule:
        if time >= since:
            value = each
    return value


def sail(
    boat,
    control,
    setpoints,
    seed: int,
    duration: float = 200.0,
    sea=((0.0, CALM),),
    log: bool = True,
    propeller=None,
    fault: tuple[str | None, float] = (None, 0.0),
) -> SpeedRun:
    """Simulate a run. `setpoints` and `sea` are ((from, value), …). The controller uses the estimate.

    `log`: whether there is a log, with bottom lock. `propeller`: a `SurgeModel`, the third source when GPS and log
    contradict each other. `fault`: (kind, time from which on it acts).
    """
    time = STEP * np.arange(round(duration / STEP) + 1)
    n = len(time)
    draws = np.random.default_rng(seed).spawn(4)
    errors = ACCELEROMETER.measured(time, 0.0, draws[0])[1] + LEAK.measured(time, 0.0, draws[1])[1]
    gps_errors, log_errors = (
        instrument.measured(time, 0.0, each)[1].tolist() for instrument, each in ((GPS, draws[2]), (LOG, draws[3]))
    )
    errors = errors.tolist()

    fusion, turns = SurgeFusion(TABLE_III), None if propeller is None else propeller.start()
    state = boat.start()
    received = np.full((2, n), np.nan)
    nis = []
    setpoint, command, estimate = _at(setpoints, 0.0), 0.0, 0.0
    rows, parameters = [(0.0,) * 6 + (setpoint,)], [_UNKNOWN]
    model, adapted = math.nan, _UNKNOWN
    for k in range(1, n):
        now = k * STEP
        if k % _CONTROL == 1:
            setpoint, conditions = _at(setpoints, now), _at(sea, now)
            command = control.step(setpoint, estimate, _CONTROL * STEP, state[4])
            model, adapted = getattr(control, "model", math.nan), tuple(getattr(control, "parameters", _UNKNOWN))
        before = state[3]
        state = boat.step(state, (command,), conditions, STEP)
        speed = state[3]
        of_acceleration, of_gps, of_log = _bias(*fault[:1], now, fault[1])
        reported = {}
        third = turns.step(state[4], STEP) if turns else math.nan
        if k % _AID == 0:
            reported["sog"] = received[0, k] = speed + gps_errors[k // _AID] + of_gps
        elif k % _AID == _AID // 2 and log:
            reported["bottom_speed"] = received[1, k] = speed + log_errors[k // _AID] + of_log
        acceleration = (speed - before) / STEP + errors[k] + of_acceleration
        estimate = fusion.step(acceleration, STEP, reference=third, **reported)
        if reported and now > 10.0:
            nis += [each for each in fusion.nis[:3] if not math.isnan(each)]
        rows.append((speed, estimate, fusion.speed_std, fusion.current, state[4], model, setpoint))
        parameters.append(adapted)
    out = np.array(rows).T
    return SpeedRun(time, out[6], *out[:6], np.array(parameters), np.array(nis), fusion.events, *received)


BAND = 0.02
TAIL = 20.0
TRANSIENT = 10.0
"""s at the start in which estimates are not judged, as in the paper's figures 13–15."""


def settling(time, speed, about: float) -> float:
    """Time (s) from time[0] until the speed stays within ±2 % of `about`; inf if it ends outside."""
    return settled_after(time, speed - about, BAND * about)


def overshoot_pct(speed, setpoint: float) -> float:
    """Overshoot over the set-point, %; 0 if the speed stays below it."""
    return max(0.0, 100.0 * (float(np.max(speed)) - setpoint) / setpoint)


def tail_pct(time, speed, setpoint: float) -> float:
    """Largest error over the last 20 s, % of the set-point."""
    return 100.0 * float(np.abs(speed[time > time[-1] - TAIL] - setpoint).max()) / setpoint


def response(time, speed, shaft, setpoint: float) -> dict[str, float]:
    """Numbers of one response for which the paper has requirements."""
    return {
        "settling_s": settling(time, speed, setpoint),
        "overshoot_pct": overshoot_pct(speed, setpoint),
        "tail_pct": tail_pct(time, speed, setpoint),
        "shaft_max": float(shaft.max()),
    }


def estimate(voyage, setpoint: float, since: float = TRANSIENT) -> dict[str, float]:
    """RMS and largest error in % of the set-point, NIS, coverage of the 95 % interval, and number of exclusions."""
    late = voyage.time > since
    error = (voyage.estimate - voyage.speed)[late]
    return {
        "rms_pct": 100.0 * rms(error) / setpoint,
        "max_pct": 100.0 * float(np.abs(error).max()) / setpoint,
        "nis": float(voyage.nis.mean()) if len(voyage.nis) else float("nan"),
        "coverage": float(np.mean(np.abs(error) < NORMAL_95 * voyage.std[late])),
        "exclusions": float(sum(event.what == "excluded" for event in voyage.events)),
    }
