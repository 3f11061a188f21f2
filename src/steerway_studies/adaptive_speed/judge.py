"""How a speed response and an estimate are judged: settling, overshoot, tail, error."""

import numpy as np

from steerway.core import NORMAL_95, rms

BAND = 0.02
TAIL = 20.0
TRANSIENT = 10.0
"""s left out of judging estimates, as the paper's figures 13–15 leave them out."""


def settling(time, speed, about: float) -> float:
    """s of the last exit from ±2 % of `about`, after time[0]; inf where it is still outside at the end."""
    outside = np.flatnonzero(~(np.abs(speed - about) <= BAND * about))
    if len(outside) == 0:
        return 0.0
    last = outside[-1]
    return float("inf") if last == len(speed) - 1 else float(time[last + 1] - time[0])


def overshoot_pct(speed, setpoint: float) -> float:
    """(max − s)/s in %, 0 where it stays below."""
    return max(0.0, 100.0 * (float(np.max(speed)) - setpoint) / setpoint)


def tail_pct(time, speed, setpoint: float) -> float:
    """Largest error over the last 20 s, % of the set-point."""
    return 100.0 * float(np.abs(speed[time > time[-1] - TAIL] - setpoint).max()) / setpoint


def response(time, speed, shaft, setpoint: float) -> dict[str, float]:
    """The paper's requirements on one response."""
    return {
        "settling_s": settling(time, speed, setpoint),
        "overshoot_pct": overshoot_pct(speed, setpoint),
        "tail_pct": tail_pct(time, speed, setpoint),
        "shaft_max": float(shaft.max()),
    }


def estimate(voyage, setpoint: float, since: float = TRANSIENT) -> dict[str, float]:
    """RMS and largest error in % of the set-point, NIS, and coverage of the 95 % interval."""
    late = voyage.time > since
    error = (voyage.estimate - voyage.speed)[late]
    return {
        "rms_pct": 100.0 * rms(error) / setpoint,
        "max_pct": 100.0 * float(np.abs(error).max()) / setpoint,
        "nis": float(voyage.nis.mean()) if len(voyage.nis) else float("nan"),
        "coverage": float(np.mean(np.abs(error) < NORMAL_95 * voyage.std[late])),
        "exclusions": float(sum(event.what == "excluded" for event in voyage.events)),
    }
