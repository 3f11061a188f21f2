"""The papers' controllers as printed, and their corrections."""

import numpy as np

from steerway.vessels import CALM, Springer, Surge
from steerway_studies.testing import (
    MARINER_NOMOTO,
    OTTER_NOMOTO,
    OTTER_PRINTED_GAINS,
    OutputCorrectedMpc,
    PrintedMrac,
    PrintedSpeedEkf,
    closed_loop_poles,
    feedforward,
    paper_mpc,
    propeller_speeds,
    rudder,
)
from tests.reference_outputs.tables import case, columns


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
