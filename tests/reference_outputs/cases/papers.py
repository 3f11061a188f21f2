"""The papers' forms as printed, and their corrections."""

import math

import numpy as np

from steerway.core import Measurements
from steerway.guidance import Mission, Route
from steerway.vessels import CALM, Springer, Surge
from steerway_studies.testing import (
    MARINER_NOMOTO,
    OTTER_NOMOTO,
    OTTER_PRINTED_GAINS,
    PRINTED_GAINS,
    AlwaysByCourse,
    Ekf5States,
    OutputCorrectedMpc,
    PrintedEstimator,
    PrintedMrac,
    PrintedPositionPID,
    PrintedSpeedEkf,
    RangeRatePassing,
    RangeRateTest,
    along_track,
    closed_loop_poles,
    ekf_5states,
    feedforward,
    los_observer,
    paper_mpc,
    propeller_speeds,
    reference_model,
    rudder,
    saturation,
    switches,
)
from tests.reference_outputs.generated import columns
from tests.reference_outputs.tables import case

STEP = 0.1


def way(rows=600):
    """(rows, 2) noisy north and east of a weaving boat at 10 Hz."""
    time = STEP * np.arange(rows)
    course = 0.5 + np.sin(time / 8.0)
    place = np.cumsum(0.15 * np.column_stack([np.cos(course), np.sin(course)]), axis=0)
    return place + 0.2 * np.random.default_rng(16).standard_normal((rows, 2))


def filtered(pos, frame, q_d=(0.1, 0.1), r_d=(0.04, 0.04), **more):
    states, covariances = ekf_5states(*pos.T, STEP, 5, frame, q_d, r_d, return_covariance=True, **more)
    return {"state": states[::8], "std": np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))[::8]}


def on_earth():
    return np.array([1.107, 0.181]) + way() / (6.38e6, 2.85e6)


@case("paper_ekf_north_east")
def north_east():
    return filtered(way(), "NED")


@case("paper_ekf_started")
def started():
    return filtered(way(), "NED", x_init=[0.0, 0.0, 1.5, 0.5, 0.0], alpha_1=0.02, alpha_2=0.2)


@case("paper_ekf_latitude_longitude")
def latitude_longitude():
    return filtered(on_earth(), "LL", r_d=(1e-15, 5e-15))


@case("paper_ekf_by_jacobian")
def by_jacobian():
    ekf = Ekf5States(STEP, 5, "NED", [0.1, 0.1], [0.04, 0.04], by_jacobian=True)
    return {"state": np.array([ekf.step(*each) for each in way()])[::8]}


@case("paper_ekf_radius")
def radius():
    ekf = Ekf5States(STEP, None, "LL", [0.1, 0.1], [1e-15, 5e-15], radius_34=True)
    steps = [ekf.step(*each) if k % 5 == 0 else ekf.step() for k, each in enumerate(on_earth())]
    return {"state": np.array(steps)[::8]}


@case("paper_estimator_aboard")
def aboard():
    estimator, rows = PrintedEstimator(Ekf5States(STEP, 5, "NED", [0.1, 0.1], [0.04, 0.04])), []
    for north, east in way(200):
        rows.append((*estimator.step(Measurements(north, east), STEP)[:5], AlwaysByCourse().step(0.0, 0.0, 0.0, STEP)))
    return columns("north east sog cog course_rate by_course", rows, 4)


@case("paper_course_autopilot")
def course_autopilot():
    chance, rows = np.random.default_rng(17), []
    for _ in range(30):
        error, integral, rate, acceleration = chance.standard_normal(4)
        row = []
        for printed in (True, False):
            row += [
                rudder(error, integral, rate, OTTER_PRINTED_GAINS, 0.1, printed),
                feedforward(rate, acceleration, OTTER_NOMOTO, printed),
                feedforward(rate, acceleration, MARINER_NOMOTO, printed),
            ]
        rows.append((row, propeller_speeds(100.0 * error, 20.0 * integral)))
    names = "rudder otter mariner corrected_rudder corrected_otter corrected_mariner left right"
    return columns(names, rows)


@case("paper_closed_loop_poles")
def poles():
    found = {}
    for name, gains, model in (
        ("otter", OTTER_PRINTED_GAINS, OTTER_NOMOTO),
        ("mariner", (1.45, 200.0, 36.3), MARINER_NOMOTO),
    ):
        for printed in (True, False):
            roots = np.sort_complex(closed_loop_poles(gains, model, printed))
            found |= {f"{name}_{printed}_real": roots.real, f"{name}_{printed}_imaginary": np.abs(roots.imag)}
    return found


@case("paper_path_following")
def path_following():
    test, rows = RangeRateTest(), []
    for k in range(60):
        north, east = 3.0 * k - 20.0, 40.0 * math.sin(0.1 * k)
        row = []
        for printed in (True, False):
            along = along_track(north, east, 1.0, -2.0, 0.4, printed)
            row += [along, switches(100.0, along, 10.0, printed)]
        rows.append((row, test.step(math.hypot(north - 60.0, east))))
    return columns("along switches corrected_along corrected_switches missed", rows)


@case("paper_range_rate_passing")
def range_rate_passing():
    mission, rows = Mission(Route([0.0, 50.0, 50.0], [10.0, 10.0, 60.0], 4.0), RangeRatePassing(), start="point"), []
    for k in range(120):
        leg = mission.step(-10.0 + k, 12.0 + 0.4 * k, 1.0)
        rows.append((leg.target, leg.distance, len(mission.log.reached), len(mission.log.missed)))
    return columns("target distance reached missed", rows, 2)


@case("paper_references")
def references():
    rows, following, shaped = [], (0.1, 0.0), (0.0, 0.0, 0.0)
    for k in range(200):
        command = 1.0 if k < 100 else -2.5
        following = los_observer(*following, command, 0.3, 0.1)
        shaped = reference_model(*shaped, command, 0.8, 1.0, 0.2, 0.1)
        rows.append((*following, *shaped))
    return columns("angle rate model_angle model_rate model_acceleration", rows, 4)


@case("paper_positioning")
def positioning():
    pid, rows = PrintedPositionPID(PRINTED_GAINS), []
    for k in range(40):
        force = pid.step(np.array([1.0, 0.5, 0.2]), 0.02 * k, 0.01 * k, 0.01 * k, np.array([0.1, 0.05, 0.0]), 0.1)
        rows.append((*force, saturation(0.05 * k - 0.5)))
    return columns("x y moment saturation", rows)


@case("paper_speed")
def speed():
    """The printed controllers on the boat, and the printed filter of what they do."""
    found = {}
    for name, how in (("printed", {}), ("wrong_sign", {"sign": -1.0, "high": 17.5}), ("late", {"adapt_first": False})):
        boat, control, rows = Surge(), PrintedMrac(**how), []
        right, wrong = PrintedSpeedEkf(printed=False), PrintedSpeedEkf()
        state, chance = boat.start(), np.random.default_rng(18)
        for _ in range(1000):
            command = control.step(3.0, state[3], 0.05, state[4])
            state = boat.step(state, (command,), CALM, 0.05)
            reading = state[3] + 0.03 * chance.standard_normal()
            for ekf in (right, wrong):
                ekf.predict(state[4], 0.05)
                ekf.update(reading, 0.03)
            rows.append(
                (state[3], command, control.model, *control.parameters, right.speed, right.variance, wrong.speed)
            )
        names = "speed command model a_s a_u a_uu estimate variance printed_estimate".split()
        found |= columns(" ".join(f"{name}_{each}" for each in names), rows, 20)
    return found


@case("paper_output_corrected_mpc")
def output_corrected_mpc():
    control, boat, rows = OutputCorrectedMpc(paper_mpc()), Springer("paper", bias=1.0), []
    state = boat.start()
    for _ in range(120):
        heading = boat.heading(state)
        difference = control.step(1.0, heading)
        rows.append((heading, difference))
        state = boat.step(state, (difference,), CALM, 1.0)
    return columns("heading difference", rows)
