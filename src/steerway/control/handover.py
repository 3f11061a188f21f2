"""The autopilot: one controller for course or heading, and the hand-over between the two without a jump.

Below steerageway, course over ground does not show where the bow points: at rest it is undefined, and in a current it
is the direction of the drift. The autopilot therefore steers by course only above a speed and below a crab angle, else
by heading. Simulation and live runs use this class.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from steerway.control.bandwidth import GainSchedule
from steerway.control.course import AnglePID
from steerway.core.angles import wrap
from steerway.core.checks import not_negative, positive
from steerway.core.errors import InputError
from steerway.core.reference import Reference, ReferenceModel

if TYPE_CHECKING:
    from steerway.control.heading_steering import SampledSteering


@dataclass(frozen=True)
class Steerageway:
    """When the autopilot steers by course. Speeds over ground in m/s, angle in rad, time in s.

    Steering by course begins above `take` and ends below `give`. A known crab angle must be within `largest_crab` to
    begin, and within 1.5 times that to go on. A change waits until its condition has lasted for `dwell`; an unknown
    course ends steering by course at once.
    """

    take: float = 0.5
    give: float = 0.3
    largest_crab: float = math.radians(60.0)
    dwell: float = 1.0

    def __post_init__(self) -> None:
        positive("steerageway.give", self.give)
        if not self.take > self.give:
            raise InputError(f"steerageway.take is {self.take:g} m/s, expected more than give, {self.give:g} m/s")
        positive("steerageway.largest_crab", self.largest_crab)
        not_negative("steerageway.dwell", self.dwell)


class HandOver:
    """Chooses between course and heading, with hysteresis and dwell time."""

    def __init__(self, steerageway: Steerageway | None = None):
        self.steerageway = steerageway or Steerageway()
        self.by_course = False
        self._waited = 0.0

    def step(self, speed: float, course: float, heading: float, dt: float, wanted: bool = True) -> bool:
        """Whether to steer by course; `wanted` False (station keeping) changes to heading at once."""
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

    def _should_change(self, speed: float, crab: float) -> bool:
        bounds = self.steerageway
        if self.by_course:
            return speed < bounds.give or crab > 1.5 * bounds.largest_crab
        return speed > bounds.take and crab < bounds.largest_crab


class Shaper(Protocol):
    """A filter from a command to a reference that the boat can follow; `core.reference` has three."""

    @property
    def reference(self) -> Reference | None: ...

    @property
    def lag(self) -> float: ...

    def start(self, angle: float, rate: float = 0.0, acceleration: float = 0.0) -> object: ...

    def step(self, command: tuple[float, float, float], dt: float) -> Reference: ...


class Autopilot:
    """Steers by course or by heading, as `hand_over` decides, without a jump between them.

    At a hand-over the reference changes to the other angle with the same control error, and the integral absorbs what
    remains, so that the command does not jump. With a `schedule` the gains follow the bandwidth of the course estimate
    while `course_wanted`.
    """

    def __init__(
        self,
        controller: "AnglePID | SampledSteering",
        shaper: Shaper,
        hand_over: HandOver | None = None,
        schedule: GainSchedule | None = None,
    ):
        self.controller = controller
        self.shaper = shaper
        self.hand_over = hand_over or HandOver()
        self.schedule = schedule
        self._steered_by: bool | None = None
        self._last = (math.nan, math.nan)

    @property
    def by_course(self) -> bool:
        """Whether the autopilot steers by course now."""
        return self.hand_over.by_course

    @property
    def model(self) -> ReferenceModel:
        """The reference model, for steering in a current. Raises TypeError for another shaper."""
        if not isinstance(self.shaper, ReferenceModel):
            raise TypeError(f"an autopilot in a current has a {type(self.shaper).__name__}, expected a ReferenceModel")
        return self.shaper

    def step(
        self,
        command: tuple[float, float, float],
        course: float,
        course_rate: float,
        heading: float,
        yaw_rate: float,
        speed: float,
        dt: float,
        course_wanted: bool = True,
    ) -> float:
        """Output for a desired (angle, rate, acceleration): a course if `course_wanted`, else a heading. rad, m/s, s.

        Below steerageway the desired course is steered as a heading. Without a heading (NaN) only the integral and the
        damping of a known yaw rate remain.
        """
        if self.schedule is not None and course_wanted and isinstance(self.controller, AnglePID):
            self.controller.gains = self.schedule.gains(speed)
        by_course = self.hand_over.step(speed, course, heading, dt, course_wanted)
        angle, rate = (course, course_rate) if by_course else (heading, yaw_rate)
        if math.isnan(angle):
            self._steered_by = None
            return self.controller.step((math.nan, 0.0, 0.0), angle, rate, dt)
        known_rate = 0.0 if math.isnan(rate) else rate
        if self._steered_by is not by_course:
            self._take_over(angle, known_rate)
            self._steered_by = by_course
        self._last = (angle, known_rate)
        return self.controller.step(self.shaper.step(command, dt), angle, rate, dt)

    def limited_to(self, achieved: float) -> None:
        """Report the part of the last output that the actuators achieved."""
        self.controller.limited_to(achieved)

    def release(self) -> None:
        """Stop steering; the next step begins at the boat's own angle, with the trim learned so far."""
        self.hand_over.by_course = False
        self._steered_by = None

    def _take_over(self, angle: float, rate: float) -> None:
        shaper = self.shaper
        if self._steered_by is None or shaper.reference is None:
            shaper.start(angle, rate)
            return
        last_angle, last_rate = self._last
        desired, desired_rate, acceleration = shaper.reference
        shaper.start(angle - wrap(last_angle - desired), desired_rate + rate - last_rate, acceleration)
        self.controller.start(self.controller.command, shaper.reference, angle, rate)
