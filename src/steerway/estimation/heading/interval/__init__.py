"""Intervals: arithmetic that never loses the true value, and Kalman filters on it."""
