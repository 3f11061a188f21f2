"""P4's Kalman filter as printed: good where it is told what it should find, and nowhere else."""

import numpy as np
import pytest

from steerway import InputError
from steerway.core import rms
from steerway.sensors import TCM2, DynamicCompass
from steerway.vessels import CALM, SPRINGER_PHYSICAL_YAW, Springer
from steerway_studies.testing import PrintedCompassKalman

TICKS = 40


def headings(rate, seconds=60):
    """Heading (deg) at the ticks of a steady turn, and the compass's readings of it."""
    true = rate * np.arange(seconds * TICKS) / TICKS
    compass = DynamicCompass(TCM2).start(0.0, np.random.default_rng(1))
    return true, np.degrees([compass.readings(np.radians(each), 1)[0] for each in true])


def estimated(rate, fed):
    """Errors (deg) against the compass's own reading without noise, from 20 s on."""
    true, readings = headings(rate)
    known, own = PrintedCompassKalman(), 0.0
    error = []
    for heading, reading in zip(true, readings, strict=True):
        own = known.step(heading if fed == "truth" else own, reading)
        error.append(own - heading)
    return np.array(error[20 * TICKS :])


def test_told_the_heading_it_smooths_the_readings():
    true, readings = headings(0.0)
    assert rms(estimated(0.0, "truth")) < 0.5 * rms((readings - true)[20 * TICKS :])


def test_told_its_own_estimate_it_lags_further_in_a_turn():
    """The input that the paper takes is the unknown heading: without it the estimate falls behind."""
    told, alone = (abs(estimated(5.0, fed).mean()) for fed in ("truth", "own"))
    assert alone > 1.5 * told


def test_springer_takes_the_yaw_of_another_boat():
    slow = SPRINGER_PHYSICAL_YAW._replace(inputs=tuple(0.5 * each for each in SPRINGER_PHYSICAL_YAW.inputs))
    own, other = Springer(), Springer(yaw=slow)
    states = [each.start() for each in (own, other)]
    for _ in range(40):
        states = [each.step(state, (5.0,), CALM, 0.5) for each, state in zip((own, other), states, strict=True)]
    assert other.heading(states[1]) == pytest.approx(0.5 * own.heading(states[0]), rel=1e-9)
    with pytest.raises(InputError, match=r"springer\.yaw is "):
        Springer(yaw=slow._replace(outputs=(0.0, 1.0)))
