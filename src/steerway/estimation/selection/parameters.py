"""What is fitted to a log: names of a profile, within what bounds, and what is expected before a log has spoken."""

MOTION = ("position_std", "speed_noise", "course_rate_noise", "course_rate_decay")
"""A vessel of one manner of moving, and a receiver of white noise."""
TURNS = ("straight_time", "turn_time", "turn_speed_noise", "turn_course_rate_noise", "turn_course_rate_decay")
"""What a second manner of moving adds."""
LASTING = ("acceleration_std",)
YAWING = ("yawing_period", "yawing_time")
SLOW_ERROR = ("error_std", "error_time")
DRIFT = ("drift_std", "drift_time")
INSTRUMENTS = {
    "sog": ("sog_std",),
    "cog": ("velocity_std",),
    "yaw_rate": ("yaw_rate_std", "gyro_bias_time"),
}
"""How well an aid measures, of those that tell of the motion over ground.

Heading and speed through the water do not: crab angle and stream, between them and it, wander by more than the
instruments err.
"""

BOUNDS = {
    "position_std": (2e-3, 30.0),
    "speed_noise": (1e-7, 10.0),
    "course_rate_noise": (1e-10, 10.0),
    "course_rate_decay": (5e-3, 2.0),
    "straight_time": (20.0, 1e4),
    "turn_time": (2.0, 3e3),
    "turn_speed_noise": (1e-7, 10.0),
    "turn_course_rate_noise": (1e-8, 10.0),
    "turn_course_rate_decay": (5e-3, 1.0),
    "acceleration_std": (1e-3, 2.0),
    "yawing_period": (3.0, 100.0),
    "yawing_time": (1.0, 1e3),
    "error_std": (3e-3, 10.0),
    "error_time": (30.0, 2e3),
    "drift_std": (3e-3, 30.0),
    "drift_time": (1.0, 1e4),
    "sog_std": (0.05, 3.0),  # a receiver that wavers by less is filtered, and late
    "velocity_std": (0.05, 3.0),
    "yaw_rate_std": (1e-3, 0.2),
    "gyro_bias_time": (100.0, 1e5),
}
"""Least and largest value of every parameter that is fitted."""
EXPECTED = {
    "position_std": (0.5, 2.0),
    "speed_noise": (1e-2, 4.0),
    "course_rate_noise": (1e-3, 4.0),
    "course_rate_decay": (0.2, 2.0),
    "straight_time": (100.0, 2.0),
    "turn_time": (20.0, 2.0),
    "turn_speed_noise": (1e-2, 4.0),
    "turn_course_rate_noise": (1e-3, 4.0),
    "turn_course_rate_decay": (0.2, 2.0),
    "acceleration_std": (0.1, 2.0),
    "yawing_period": (10.0, 1.0),
    "yawing_time": (15.0, 1.0),
    "error_std": (1.0, 2.0),
    "error_time": (300.0, 1.0),
    "drift_std": (1.0, 2.0),
    "drift_time": (300.0, 2.0),
    "sog_std": (0.1, 1.0),
    "velocity_std": (0.1, 1.0),
    "yaw_rate_std": (3e-3, 1.0),
    "gyro_bias_time": (3000.0, 1.5),
}
"""Median and standard deviation of the logarithm: wide, so that only what a log cannot tell is held.

How long a receiver's error lasts is such a thing: a walk that turns back after half a minute or after five makes a log
as likely, within one in a thousand. Errors of multipath and atmosphere last minutes; one that is gone within seconds
would be made of waves.
"""
