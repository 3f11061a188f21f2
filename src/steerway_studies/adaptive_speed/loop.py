"""One voyage along a straight line: boat at 200 Hz, accelerometer at 200 Hz, GPS and log at 10 Hz, control at 20 Hz."""

import math
from dataclasses import dataclass

import numpy as np

from steerway.estimation.speed import SurgeFusion, SurgeTuning
from steerway.sensors import Instrument, accelerometer
from steerway.vessels import CALM, CURRENT_NORTH

STEP = 0.005
_AID, _CONTROL = 20, 10  # steps from one to the next; GPS and log take turns
ACCELEROMETER = accelerometer(rate=200.0)
LEAK = Instrument(rate=200.0, wander=(0.0034, 5.0))
GPS = Instrument(rate=10.0, white=0.03)
LOG = Instrument(rate=10.0, white=0.002)
_UNKNOWN = (math.nan,) * 3
TABLE_III = SurgeTuning(scale_std=0.0)
"""The filter for P3's instruments, whose log has no scale error."""


@dataclass(frozen=True)
class SpeedRun:
    """What a voyage gives: arrays (n,) at every step, events, and NIS of what aided."""

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
    """What a fault adds to (acceleration, GPS, log) at a time."""
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
    gps: bool = True,
    log: str | None = "bottom",
    propeller=None,
    aid_by_propeller: bool = False,
    fault: tuple[str | None, float] = (None, 0.0),
    outage: tuple[float, float] = (math.inf, math.inf),
) -> SpeedRun:
    """Sail. `setpoints` and `sea` are ((from, value), …).

    `log`: "bottom", "water" or None; `propeller` a `SurgeModel` that gives the vote its third voice and with
    `aid_by_propeller` aids the filter; `fault` (kind, since); `outage` of GPS and log from, to. Control sees
    the estimate.
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
        silent = outage[0] < now <= outage[1]
        if k % _AID == 0:
            if gps and not silent:
                reported["sog"] = received[0, k] = speed + gps_errors[k // _AID] + of_gps
            if aid_by_propeller:
                reported["propeller_speed"] = third
        elif k % _AID == _AID // 2 and log and not silent:
            stream = conditions[CURRENT_NORTH] if log == "water" else 0.0
            reported[f"{log}_speed"] = received[1, k] = speed - stream + log_errors[k // _AID] + of_log
        acceleration = (speed - before) / STEP + errors[k] + of_acceleration
        estimate = fusion.step(acceleration, STEP, reference=third, **reported)
        if reported and now > 10.0:
            nis += [each for each in fusion.nis[:3] if not math.isnan(each)]
        rows.append((speed, estimate, fusion.speed_std, fusion.current, state[4], model, setpoint))
        parameters.append(adapted)
    out = np.array(rows).T
    return SpeedRun(time, out[6], *out[:6], np.array(parameters), np.array(nis), fusion.events, *received)
