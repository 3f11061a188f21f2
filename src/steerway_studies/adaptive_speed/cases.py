"""Runs of the study, by kind, and the numbers of each. Functions are at module level, so that workers can call them."""

import math
from typing import NamedTuple

import numpy as np

from steerway.vessels import conditions
from steerway_studies.adaptive_speed import printed, sailing
from steerway_studies.adaptive_speed.sailing import sail

FAULT_AT = 100.0
FAULTS = {"dvl": "log step", "dvl_ramp": "log ramp", "gps": "gps step", "imu": "accelerometer step"}
WIND_ARRIVES, CURRENT_ARRIVES = 140.0, 90.0


class Job(NamedTuple):
    kind: str
    seed: int
    setpoint: int = 3
    plant: str = "a"


def run(job: Job) -> dict[str, float]:
    """The numbers of one run, by key."""
    return KINDS[job.kind](job)


def ours(job):
    """MRAC+ with the fused speed as feedback: numbers of the response and of the estimate."""
    speed = job.setpoint
    voyage = sail(sailing.plant(job.plant), sailing.controller(job.plant), ((0.0, speed),), job.seed)
    return sailing.response(voyage.time, voyage.speed, voyage.shaft, speed) | sailing.estimate(voyage, speed)


def chance(job):
    """A random boat; a current arrives at 90 s and wind at 140 s."""
    signs = np.random.default_rng([job.seed, 1]).choice((-1.0, 1.0), 2)
    boat = sailing.random_plant(job.seed)
    sea = _weather(*signs)
    voyage = sail(boat, sailing.controller("a"), ((0.0, job.setpoint),), job.seed, sea=sea, propeller=sailing.NOMINAL)
    calm = voyage.time < CURRENT_ARRIVES
    error = np.abs(voyage.speed - job.setpoint)[~calm]
    return {
        "settling_s": sailing.settling(voyage.time[calm], voyage.speed[calm], job.setpoint),
        "overshoot_pct": sailing.overshoot_pct(voyage.speed[calm], job.setpoint),
        "tail_pct": sailing.tail_pct(voyage.time, voyage.speed, job.setpoint),
        "peak_pct": 100.0 * float(error.max()) / job.setpoint,
        "exclusions": sailing.estimate(voyage, job.setpoint)["exclusions"],
    }


def _weather(current, wind):
    with_current = conditions(current=(0.5 * current, 0.0))
    with_both = conditions(current=(0.5 * current, 0.0), force=(1000.0 * wind, 0.0))
    return ((0.0, conditions()), (CURRENT_ARRIVES, with_current), (WIND_ARRIVES, with_both))


def faultless(job):
    """Plant T in current and wind without faults: no instrument may be excluded."""
    signs = np.random.default_rng([job.seed, 2]).choice((-1.0, 1.0), 2)
    boat, control = sailing.plant("a"), sailing.controller("a")
    voyage = sail(boat, control, ((0.0, job.setpoint),), job.seed, sea=_weather(*signs), propeller=sailing.NOMINAL)
    return sailing.estimate(voyage, job.setpoint) | {"doubts": float(len(voyage.events))}


def gps_only(job):
    """GPS and accelerometer, without the log."""
    return _estimated(job, log=False)


def _estimated(job, **how):
    voyage = sail(sailing.plant("a"), sailing.controller("a"), ((0.0, job.setpoint),), job.seed, **how)
    return sailing.estimate(voyage, job.setpoint)


def fault(job):
    """A run in which the instrument named by `plant` fails at 100 s. The controller uses the estimate."""
    voyage = sail(
        sailing.plant("a"),
        sailing.controller("a"),
        ((0.0, job.setpoint),),
        job.seed,
        propeller=sailing.NOMINAL,
        fault=(FAULTS[job.plant], FAULT_AT),
    )
    late = voyage.time > FAULT_AT
    error = 100.0 * np.abs(voyage.estimate - voyage.speed)[late] / job.setpoint
    bad = np.flatnonzero(error > 1.0)
    events = [event for event in voyage.events if event.what != "readmitted"]
    guilty = {"dvl": "bottom_speed", "dvl_ramp": "bottom_speed", "gps": "sog", "imu": "acceleration"}[job.plant]
    right = bool(events) and events[0].instrument == guilty and len({event.instrument for event in events}) == 1
    return {
        "max_pct": float(error.max()),
        "recovered_s": float(voyage.time[late][bad[-1]] - FAULT_AT) if len(bad) else 0.0,
        "named_s": events[0].time - FAULT_AT if right else math.inf,
    }


KINDS = {
    "ours": ours,
    "chance": chance,
    "faultless": faultless,
    "gps_only": gps_only,
    "fault": fault,
    "printed_filter": printed.filter_errors,
}
