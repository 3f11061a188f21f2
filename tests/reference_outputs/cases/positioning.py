"""Position and velocity of a vessel under known forces (P2): the filter in its variants."""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from steerway.estimation.positioning import (
    SpeedDependentFixNoise,
    TimeVaryingNoise,
    VariationalNoise,
    VesselFilter,
    VesselNoise,
)
from steerway.vessels import CyberShip2, conditions
from steerway.vessels.testing import DAMPING, INERTIA
from tests.reference_outputs.tables import case, columns

STEP = 0.1
BODY = VesselNoise(position_std=0.1)
FORCE = replace(BODY, force_std=(0.29, 0.29, 0.029))
WAVES = replace(FORCE, wave_std=0.28)


@cache
def record(identification="linear"):
    """(forces (n, 3), fixes (n, 2), headings (n,)): 60 s at 10 Hz, fixes at 1 Hz, one of them 20 m off, six s 15 m."""
    chance = np.random.default_rng(1)
    boat, rows = CyberShip2(identification), []
    state = boat.start()
    for k in range(601):
        time = STEP * k
        force = np.array([1.2, 0.5 * math.sin(0.2 * time), 0.15 * math.cos(0.11 * time)])
        sea = conditions((0.0, 0.0), (0.3 * math.sin(0.05 * time), -0.2), 0.02)
        fix = state[:2] + 0.1 * chance.standard_normal(2)
        if k == 150:
            fix = fix + 20.0
        if 300 <= k <= 350:
            fix = fix - (15.0, 0.0)
        rows.append((force, fix if k % 10 == 0 else (math.nan, math.nan), state[2] + 0.01 * chance.standard_normal()))
        state = boat.step(state, force, sea, STEP)
    return tuple(np.array(each) for each in zip(*rows, strict=True))


def watched(filter, identification="linear", compass=True):
    """What a filter makes of the record, once a second."""
    rows = []
    filter.start(0.0, 0.0, 0.1)
    for force, fix, heading in zip(*record(identification), strict=True):
        filter.predict(force, STEP)
        if compass:
            filter.update_heading(heading)
        nis = filter.update(*fix) if math.isfinite(fix[0]) else math.nan
        motion = filter.motion
        deviations = np.sqrt(np.diag(filter.covariance))[:3]
        rows.append((*motion[:3], *motion.velocity, *motion.force, nis, *deviations))
    names = "north east heading surge sway yaw_rate force_x force_y moment nis north_std east_std heading_std"
    return columns(names, rows, 10)


def vessel_filter(noise=FORCE, **more):
    return VesselFilter(INERTIA, DAMPING, noise, **more)


for name, compute in {
    "body": lambda: watched(vessel_filter(BODY)),
    "force": lambda: watched(vessel_filter()),
    "waves": lambda: watched(vessel_filter(WAVES)),
    "no_gate_nonlinear_plant": lambda: watched(vessel_filter(gate=math.inf), "nonlinear"),
    "no_compass": lambda: watched(vessel_filter(), compass=False),
    "learns": lambda: watched(vessel_filter(fix_noise=VariationalNoise())),
    "time_varying": lambda: watched(vessel_filter(BODY, gate=math.inf, scheduled=TimeVaryingNoise())),
    "speed_dependent": lambda: watched(vessel_filter(BODY, fix_noise=SpeedDependentFixNoise(0.1, 0.25))),
}.items():
    case(f"positioning_filter_{name}")(compute)
