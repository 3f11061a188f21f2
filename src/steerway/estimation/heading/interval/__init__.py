"""Intervals: arithmetic that never loses the true value, and Kalman filters on it."""

from steerway.estimation.heading.interval.filter import IntervalFilter

__all__ = ["IntervalFilter"]
