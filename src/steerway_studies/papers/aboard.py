"""The papers' filter and their course steering as blocks of a pilot. Labelled: for studies and tests."""

import math

from steerway.core import Estimate, Measurements, wrap
from steerway_studies.papers.ekf_5states import Ekf5States

_UNSAID = (math.nan,) * 6


class PrintedEstimator:
    """P0 Appendix A in the loop, one step of it a step of the loop: course is always believed, whatever it is worth."""

    def __init__(self, ekf: Ekf5States):
        self.ekf = ekf

    def step(self, readings: Measurements, dt: float) -> Estimate:
        """The filter's state; `dt` is the h that it was made with. The speed may be negative, as the paper lets it."""
        north, east, speed, course, rate = self.ekf.step(readings.north, readings.east).tolist()
        return Estimate(north, east, speed, wrap(course), rate, *_UNSAID)


class AlwaysByCourse:
    """The papers hand over to nothing: course steers at any speed, from the first step."""

    by_course = True

    def step(self, speed, course, heading, dt, wanted=True) -> bool:
        """True, see `control.handover.HandOver`."""
        return True
