"""Identification from generated manoeuvres. What an optimiser finds is compared at 1e-3, the rest as everywhere."""

import math
from functools import cache

import numpy as np

from steerway.identification import SurgeModel, identify_heading, identify_surge, identify_yaw, identify_yaw_from_fixes
from steerway.identification.testing import Interval, binary_sequence, covariance
from steerway.sensors import white
from steerway.vessels import CALM, RPM, Actuator, Nomoto, Propeller, Springer, Surge
from tests.reference_outputs.generated import columns
from tests.reference_outputs.tables import case

FITTED = 1e-3


@cache
def zigzag():
    """(time, rudder, north, east, heading) of a 20–20 zigzag, with a heading to 1°."""
    boat, chance = Nomoto(0.185, 10.0, 2.0, 0.05), np.random.default_rng(19)
    state, rows, side = boat.start(), [], 1.0
    for k in range(900):
        if side * state[2] > math.radians(20.0):
            side = -side
        rudder = 0.0 if k < 40 else side * math.radians(20.0)
        rows.append((0.2 * k, rudder, *state[:2], state[2] + 0.017 * chance.standard_normal()))
        state = boat.step(state, (rudder,), CALM, 0.2)
        state[3] += 4e-4 * chance.standard_normal()
    return np.array(rows).T


def of_yaw(model):
    gains = model.gains(0.3, 1.0, 0.6)
    found = {"samples": model.samples, "proportional": gains.proportional, "integral_time": gains.integral_time}
    for name in ("gain", "time_constant", "rudder_bias"):
        found |= {f"{name}_{part}": getattr(getattr(model, name), part) for part in ("value", "low", "high")}
    return found


@case("identify_yaw_by_compass", rtol=FITTED)
def yaw_by_compass():
    time, rudder, _, _, heading = zigzag()
    return of_yaw(identify_yaw(time, rudder, heading))


@case("identify_yaw_from_fixes", rtol=FITTED)
def yaw_from_fixes():
    time, rudder, north, east, _ = zigzag()
    fixes = white(0.1, 5.0).fixes(time, north, east, seed=20, origin=(0.6, 3.1))
    return of_yaw(identify_yaw_from_fixes(fixes, time, rudder))


def staircase(shafts=(5.0, 9.0, 14.0, 9.0)):
    boat, chance = Surge(shaft=Actuator("shaft", 0.0, 17.5, math.inf, 0.5)), np.random.default_rng(21)
    state, rows = boat.start(), []
    for k in range(800 * len(shafts) // 4):
        state = boat.step(state, (shafts[k // 200],), CALM, 0.2)
        rows.append((0.2 * k + 0.2, state[3] + 0.01 * chance.standard_normal(), state[4]))
    return np.array(rows).T


@case("identify_surge", rtol=FITTED)
def surge():
    found = {}
    for name, shafts in (("steps", (5.0, 9.0, 14.0, 9.0)), ("constant", (9.0,))):
        output = identify_surge(*staircase(shafts), Propeller())
        model = output.model
        found |= {
            f"{name}_{key}": value
            for key, value in {
                "linear_drag": model.linear_drag,
                "quadratic_drag": model.quadratic_drag,
                "thrust": model.thrust,
                "residual": output.residual,
                "identified": output.identified,
                **{f"std_{k}": std for k, std in enumerate(output.std)},
            }.items()
            if name == "steps" or key in ("residual", "identified")
        }
    return found


@case("identified_surge_model")
def surge_model():
    model = SurgeModel(0.04, 0.005, 0.03, Propeller(wake_fraction=0.1))
    shaft, log, rows = Actuator("shaft", 0.0, 17.5, 2.0, 0.5), model.start(1.0), []
    for k in range(60):
        speed = 0.2 * k + 0.2
        reached = model.time_to(speed, shaft)
        rows.append((log.step(0.25 * k, 0.5), reached, model.feasible(speed, shaft, 20.0)[0]))
    return columns("speed time_to feasible", rows)


@case("identify_heading", rtol=FITTED)
def heading():
    found = {}
    for name, integrating in (("integrating", True), ("free", False)):
        chance = np.random.default_rng(22)
        steering, boat = binary_sequence(300, 15, 100.0, chance), Springer("physical", bias=5.0 * RPM)
        state, angles = boat.start(heading=1.0 if integrating else 0.0), []
        for each in steering:
            angles.append(boat.heading(state) + 0.005 * chance.standard_normal())
            state[4] = each * RPM
            state = boat.step(state, (each * RPM,), CALM, 1.0)
        model = identify_heading(np.arange(300.0), steering, np.array(angles), integrating)
        found |= {
            f"{name}_{key}": value
            for key, value in {
                "pole_0": model.poles[0],
                "pole_1": model.poles[1],
                "turn_rate": model.turn_rate,
                "time_constant": model.time_constant,
                "bias": model.bias,
                "heading0": model.heading0,
                "residual_rms": model.residual_rms,
                "fit": model.fit,
                "sample": model.sample,
                "end": model.run(steering)[-1],
            }.items()
        }
    return found


@case("identification_intervals")
def intervals():
    around, positive = Interval.around(1.5, 0.2), Interval.around_positive(2.0, 0.3)
    spread = covariance(lambda x: 3.0 * x[0] ** 2 + x[0] * x[1] + 2.0 * x[1] ** 2, np.zeros(2), np.full(2, 0.01))
    sequence = binary_sequence(40, 5, 2.0, np.random.default_rng(23))
    return {
        "interval": np.array([[*around, *positive]]),
        "covariance": spread.reshape(1, 4),
        "sequence": sequence[None],
    }
