"""Below steerageway course means nothing: who steers by course, who by heading, and how one takes over from the other.

At rest course is undefined, and in a current it is where the water goes, astern for a boat that drifts on her anchor
line. So course steers only above a speed, and only while the boat moves the way she points.
"""

import math
from dataclasses import dataclass
from typing import Protocol

from steerway.control.course import AnglePID
from steerway.core.angles import wrap
from steerway.core.checks import not_negative, positive
from steerway.core.errors import InputError


@dataclass(frozen=True)
class Steerageway:
    """When course may steer. Speeds over ground in m/s, angle in rad, time in s.

    Course takes over above `take` and gives up below `give`; while the crab angle is known it takes over within
    `largest_crab` and gives up beyond one and a half of it. Either has to last `dwell`; an unknown course gives up at
    once.
    """

    take: float = 0.5
    give: float = 0.3
    largest_crab: float = math.radians(60.0)
    dwell: float = 1.0

    def __post_init__(self):
        positive("steerageway.give", self.give)
        if not self.take > self.give:
            raise InputError(f"steerageway.take is {self.take:g} m/s, expected more than give, {self.give:g} m/s")
        positive("steerageway.largest_crab", self.largest_crab)
        not_negative("steerageway.dwell", self.dwell)


class HandOver:
    """Decides between course and heading with hysteresis and dwell: no chatter whatever the speed does."""

    def __init__(self, steerageway: Steerageway | None = None):
        self.steerageway = steerageway or Steerageway()
        self.by_course = False
        self._waited = 0.0

    def step(self, speed: float, course: float, heading: float, dt: float, wanted: bool = True) -> bool:
        """True while course steers; `wanted` False (station keeping) hands over to heading at once."""
        if not wanted or math.isnan(course) or math.isnan(speed):
            self.by_course = False
            self._waited = 0.0
            return False
        crab = abs(wrap(course - heading)) if math.isfinite(heading) else 0.0
        self._waited = self._waited + dt if self._should_change(speed, crab) else 0.0
        if self._waited > self.steerageway.dwell:
            self.by_course = not self.by_course
            self._waited = 0.0
        return self.by_course

    def _should_change(self, speed, crab):
        bounds = self.steerageway
        if self.by_course:
            return speed < bounds.give or crab > 1.5 * bounds.largest_crab
        return speed > bounds.take and crab < bounds.largest_crab


class Shaper(Protocol):
    """What makes a followable reference of a command: guidance.reference has three."""

    reference: tuple[float, float, float] | None

    def start(self, angle: float, rate: float = 0.0, acceleration: float = 0.0): ...

    def step(self, command, dt: float) -> tuple[float, float, float]: ...


class Helm:
    """One autopilot that steers by course or by heading, whichever `hand_over` says, without a jump between them.

    At a hand-over the reference moves to the other angle and takes the error with it; the trim makes up the rest, so
    that the command goes on where it was. The command that follows is then sailed to as any other.
    """

    def __init__(self, pilot: AnglePID, shaper: Shaper, hand_over: HandOver | None = None):
        self.pilot = pilot
        self.shaper = shaper
        self.hand_over = hand_over or HandOver()
        self._steered_by = None
        self._last = (math.nan, math.nan)

    @property
    def by_course(self) -> bool:
        """Whether course steers now."""
        return self.hand_over.by_course

    def step(
        self,
        command,
        course: float,
        course_rate: float,
        heading: float,
        yaw_rate: float,
        speed: float,
        dt: float,
        course_wanted: bool = True,
    ) -> float:
        """The autopilot's output for a desired (angle, rate, acceleration): a course where course is wanted.

        Below steerageway the desired course is steered as a heading, without a compass not at all: the trim and the
        damping of a known yaw rate remain. rad, rad/s, m/s; NaN for unknown.
        """
        by_course = self.hand_over.step(speed, course, heading, dt, course_wanted)
        angle, rate = (course, course_rate) if by_course else (heading, yaw_rate)
        if math.isnan(angle):
            self._steered_by = None
            return self.pilot.step((math.nan, 0.0, 0.0), angle, rate, dt)
        known_rate = 0.0 if math.isnan(rate) else rate
        if self._steered_by is not by_course:
            self._take_over(angle, known_rate)
            self._steered_by = by_course
        self._last = (angle, known_rate)
        return self.pilot.step(self.shaper.step(command, dt), angle, rate, dt)

    def limited_to(self, achieved: float):
        """What the actuators made of the last output."""
        self.pilot.limited_to(achieved)

    def release(self):
        """Nobody steers now; the next step begins with the boat's own angle, and with the trim learned so far."""
        self.hand_over.by_course = False
        self._steered_by = None

    def _take_over(self, angle, rate):
        shaper = self.shaper
        if self._steered_by is None:
            shaper.start(angle, rate)
            return
        last_angle, last_rate = self._last
        desired, desired_rate, acceleration = shaper.reference
        shaper.start(angle - wrap(last_angle - desired), desired_rate + rate - last_rate, acceleration)
        self.pilot.start(self.pilot.command, shaper.reference, angle, rate)
