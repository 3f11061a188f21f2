"""What is fitted to a log: names of a profile, by what they describe, with the bounds and priors of its schema."""

from steerway.core.profile_fields import fitting_of
from steerway.estimation.course.update.aids import TABLE
from steerway.estimation.profiles import Profile

MOTION = ("position_std", "speed_noise", "course_rate_noise", "course_rate_decay")
"""One mode, and a receiver of white noise."""
TURNS = ("straight_time", "turn_time", "turn_speed_noise", "turn_course_rate_noise", "turn_course_rate_decay")
"""What a second mode adds."""
ACCELERATION = ("acceleration_std",)
OSCILLATION = ("yawing_period", "yawing_time")
SLOW_ERROR = ("error_std", "error_time")
DRIFT = ("drift_std", "drift_time")
INSTRUMENTS = {aid.name: aid.fitted for aid in TABLE if aid.fitted}
"""Noise of the aids that measure motion over ground.

Heading and speed through the water do not: crab angle and stream, between them and it, vary by more than the
instruments err.
"""
BOUNDS = fitting_of(Profile.model_fields, "bounds")
"""Least and largest value of every parameter that is fitted."""
PRIOR = fitting_of(Profile.model_fields, "prior")
"""Median and standard deviation of the logarithm: wide, so that only what a log does not determine is held."""
