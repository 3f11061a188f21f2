"""The papers' controllers as printed, and their corrections."""

import numpy as np

from steerway.vessels import CALM, Springer
from steerway_studies.testing import (
    MARINER_NOMOTO,
    OTTER_NOMOTO,
    OTTER_PRINTED_GAINS,
    OutputCorrectedMpc,
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
