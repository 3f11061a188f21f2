"""Position and velocity of a vessel under known forces (P2): filters in their variants, smoother, passive observer."""

import math
import warnings
from dataclasses import replace
from functools import cache

import numpy as np

from steerway.estimation.positioning import (
    DEMO_GAINS,
    ObserverGains,
    PassiveObserver,
    SpeedDependentFixNoise,
    TimeVaryingNoise,
    VariationalNoise,
    VesselFilter,
    VesselNoise,
    smooth,
)
from steerway.estimation.positioning.testing import low_speed
from steerway.vessels import CyberShip2, conditions
from steerway.vessels.testing import DAMPING, INERTIA
from tests.reference_outputs.generated import columns
from tests.reference_outputs.tables import case

STEP = 0.1
BODY = VesselNoise(position_std=0.1)
FORCE = replace(BODY, force_std=(0.29, 0.29, 0.029))
WAVES = replace(FORCE, wave_std=0.28)
GAINS = ObserverGains((0.333, 0.333, 1.0), (0.34, 0.44, 0.08), (2.1, 2.8, 0.83))


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


def watched(observer, identification="linear", compass=True):
    """What an observer makes of the record, once a second."""
    rows = []
    observer.start(0.0, 0.0, 0.1)
    for force, fix, heading in zip(*record(identification), strict=True):
        observer.predict(force, STEP)
        if compass:
            observer.update_heading(heading)
        nis = observer.update(*fix) if math.isfinite(fix[0]) else math.nan
        motion = observer.motion
        rows.append((*motion[:3], *motion.velocity, *motion.force))
        if hasattr(observer, "covariance"):
            rows[-1] += (nis, *np.sqrt(np.diag(observer.covariance))[:3])
    names = "north east heading surge sway yaw_rate force_x force_y moment nis north_std east_std heading_std".split()
    return columns(" ".join(names[: len(rows[0])]), rows, 10)


def vessel_filter(noise=FORCE, **more):
    return VesselFilter(INERTIA, DAMPING, noise, **more)


@case("positioning_filter_body")
def body():
    return watched(vessel_filter(BODY))


@case("positioning_filter_force")
def force():
    return watched(vessel_filter())


@case("positioning_filter_waves")
def waves():
    return watched(vessel_filter(WAVES))


@case("positioning_filter_no_gate_nonlinear_plant")
def no_gate():
    return watched(vessel_filter(gate=math.inf), "nonlinear")


@case("positioning_filter_no_compass")
def no_compass():
    return watched(vessel_filter(), compass=False)


@case("positioning_filter_learns")
def learns():
    return watched(vessel_filter(fix_noise=VariationalNoise()))


@case("positioning_filter_time_varying")
def time_varying():
    return watched(vessel_filter(BODY, gate=math.inf, scheduled=TimeVaryingNoise()))


@case("positioning_filter_inverse_square")
def inverse_square():
    return watched(vessel_filter(BODY, scheduled=TimeVaryingNoise(power=2.0, scale=1.5e-3, yaw=1e-3)))


@case("positioning_filter_speed_dependent")
def speed_dependent():
    return watched(vessel_filter(BODY, fix_noise=SpeedDependentFixNoise(0.1, 0.25)))


def observer(gains, correction):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return PassiveObserver(INERTIA, DAMPING, gains, correction)


@case("positioning_passive_impulsive")
def impulsive():
    return watched(observer(GAINS, "impulsive"))


@case("positioning_passive_held")
def held():
    return watched(observer(DEMO_GAINS, "held"))


@case("positioning_passive_held_innovation")
def held_innovation():
    return watched(observer(GAINS, "held innovation"))


def smoothed(estimator):
    forces, fixes, headings = record()
    estimator.start(0.0, 0.0, 0.1)
    passes = smooth(estimator, forces[:-1], fixes, headings, STEP)
    deviations = np.sqrt(np.diagonal(passes.smoothed_covariance, axis1=1, axis2=2))
    every = slice(None, None, 10)
    return {"filtered": passes.filtered[every], "smoothed": passes.smoothed[every], "std": deviations[every, :3]} | {
        "nis": passes.nis[every]
    }


@case("positioning_smoother")
def smoother():
    return smoothed(vessel_filter())


@case("positioning_smoother_waves")
def smoother_waves():
    return smoothed(vessel_filter(WAVES))


@case("positioning_low_speed_model")
def model():
    """Rates, Jacobian, mean and transition of 6, 9 and 13 states at ten states."""
    packed = low_speed.pack(INERTIA, DAMPING, 50.0, 0.8, 0.1)
    chance, found = np.random.default_rng(2), {}
    for n in (low_speed.BODY, low_speed.WITH_FORCE, low_speed.WITH_WAVES):
        rows = []
        for _ in range(10):
            x, force = 0.5 * chance.standard_normal(n), chance.standard_normal(3)
            rates, f, phi, product, middle = (
                np.empty(n),
                np.empty((n, n)),
                np.empty((n, n)),
                np.empty((n, n)),
                np.empty(n),
            )
            low_speed.rates(x, force, packed, rates)
            low_speed.jacobian(x, packed, f)
            low_speed.transition(x, packed, 0.1, phi, f.copy(), product)
            moved = x.copy()
            low_speed.advance_mean(moved, force, packed, 0.1, middle)
            rows.append(np.concatenate([rates, moved, [np.abs(f).sum(), (f**2).sum()], phi.sum(axis=0)]))
        found |= {f"of_{n}_states": np.array(rows)}
    return found


@case("positioning_schedules")
def schedules():
    """Q of P2 (19) over surge and sway; what is learned of R from fixes."""
    speeds = np.linspace(-1.0, 1.0, 21)
    learner, x, p = VariationalNoise(), np.zeros(9), 0.01 * np.eye(9)
    learner.start((0.01, 0.01))
    fixes = np.random.default_rng(3).standard_normal((21, 2)) * (0.05, 0.4)
    return {
        "inverse": np.array([TimeVaryingNoise()(speed, 0.3) for speed in speeds]),
        "square": np.array([TimeVaryingNoise(power=2.0, scale=3.0, yaw=2.0)(speed, -speed) for speed in speeds]),
        "learned": np.array([learner.learned(x, p, *fix) for fix in fixes]),
    }
